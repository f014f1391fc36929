"""Addresses of links as people type them: URLs, MAVProxy's and QGroundControl's forms, bare devices."""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass
from typing import Final, Literal

from sparsor.errors import LinkError

Kind = Literal["udpin", "udpout", "tcpin", "tcpout", "serial"]
DEFAULT_BAUD: Final = 57_600  # of telemetry radios, and of MAVProxy and MAVSDK when none is given
ANYWHERE: Final = "0.0.0.0"  # listen on every interface
FORMS: Final = (
    "udpin://0.0.0.0:14550 (listen), udpout://HOST:PORT, tcpout://HOST:5760, tcpin://0.0.0.0:PORT, "
    "serial:///dev/ttyUSB0:57600 or serial://COM3:57600"
)
_NETWORK = re.compile(r"(udpin|udpout|udpbcast|udp|tcpin|tcpout|tcp):(//)?(.*)", re.IGNORECASE)
_SERIAL = re.compile(r"serial:(?://)?(.*)", re.IGNORECASE)
_COM = re.compile(r"(?:\\\\\.\\)?(COM\d+)", re.IGNORECASE)


@dataclass(frozen=True)
class Address:
    """Where a link is.

    Parameters
    ----------
    kind : {"udpin", "udpout", "tcpin", "tcpout", "serial"}
        "in" listens and answers whoever sends; "out" sends first.
    place : str
        Host of a network link; device of a serial one.
    number : int
        Port of a network link; baud of a serial one.
    """

    kind: Kind
    place: str
    number: int

    @property
    def url(self) -> str:
        """The address as MAVSDK writes it.

        Examples
        --------
        >>> parse_address("/dev/ttyACM0").url
        'serial:///dev/ttyACM0:57600'
        """
        host = f"[{self.place}]" if ":" in self.place and self.kind != "serial" else self.place
        return f"{self.kind}://{host}:{self.number}"


def parse_address(text: str) -> Address:
    """Understand an address.

    Raises
    ------
    LinkError
        When it is not one, or could mean two things; names the form that would be right.

    Examples
    --------
    >>> parse_address("tcp:127.0.0.1:5760").url
    'tcpout://127.0.0.1:5760'
    >>> parse_address("COM3,115200").url
    'serial://COM3:115200'
    """
    text = text.strip()
    if serial := _SERIAL.fullmatch(text):
        return _serial(serial[1], text)
    if network := _NETWORK.fullmatch(text):
        return _network(network[1].lower(), network[2] is not None, network[3], text)
    if text.isdigit():
        return Address("udpin", ANYWHERE, _port(text, text))
    if text.startswith("/dev/") or _COM.match(text):
        return _serial(text, text)
    if "://" in text:
        raise LinkError(f"the address '{text}' begins with '{text.partition('://')[0]}://'; known are {FORMS}")
    if ":" in text:
        host, port = _host_and_port(text, text)
        raise LinkError(
            f"'{text}' does not say how to connect; {_either(host, port)}, or to use TCP {_tcp(host, port)}"
        )
    raise LinkError(f"'{text}' is not an address of a link; known are {FORMS}")


def _network(scheme: str, slashes: bool, rest: str, text: str) -> Address:
    host, port = _host_and_port(rest, text)
    open_to_all = host in ("", ANYWHERE, "::", "*")
    local = open_to_all or host == "localhost" or host.startswith("127.")
    if scheme == "udpbcast":
        raise LinkError(f"'{text}': broadcasting is not offered; to listen give udpin://{ANYWHERE}:{port}")
    if scheme in ("udpout", "tcpout", "tcp") and open_to_all:
        listening = "tcpin" if scheme.startswith("tcp") else "udpin"
        raise LinkError(
            f"'{text}' sends to no host; to listen give {listening}://{ANYWHERE}:{port}, "
            f"to connect {'tcpout' if scheme.startswith('tcp') else 'udpout'}://HOST:{port}"
        )
    # MAVProxy's udp:HOST:PORT listens. udp://HOST:PORT has meant both, so only a wildcard is plain.
    if scheme == "udp" and not (open_to_all or (local and not slashes)):
        raise LinkError(f"'{text}' can mean two things; {_either(host, port)}")
    kinds: dict[str, Kind] = {"udp": "udpin", "udpin": "udpin", "tcpin": "tcpin", "udpout": "udpout"}
    return Address(kinds.get(scheme, "tcpout"), ANYWHERE if host in ("", "*") else host, port)


def _serial(rest: str, text: str) -> Address:
    device, baud = rest, str(DEFAULT_BAUD)
    for separator in (":", ","):
        head, found, tail = rest.rpartition(separator)
        if found and head and not tail.startswith(("/", "\\")):
            device, baud = head, tail
            break
    if not device or device == "/":
        raise LinkError(
            f"'{text}' names no device; serial links are serial:///dev/ttyUSB0:57600 or serial://COM3:57600"
        )
    if not (baud.isascii() and baud.isdigit() and 300 <= int(baud) <= 12_000_000):
        raise LinkError(f"'{text}' has the baud rate '{baud}'; allowed are 300..12000000, as in {device}:57600")
    if com := _COM.fullmatch(device):
        device = com[1].upper()
    return Address("serial", device, int(baud))


def _host_and_port(rest: str, text: str) -> tuple[str, int]:
    host, found, port = rest.rpartition(":")
    if not found or "/" in port:
        raise LinkError(f"'{text}' has no port; known are {FORMS}")
    host = host.strip("/")
    if host.startswith("[") and host.endswith("]"):
        host = host[1:-1]
        try:
            ipaddress.IPv6Address(host.partition("%")[0])
        except ValueError as error:
            raise LinkError(f"'{text}': '{host}' is not an IPv6 address") from error
    elif not re.fullmatch(r"[\w.*-]*", host):
        raise LinkError(f"'{text}': '{host}' is not a host; IPv6 addresses go in brackets, udpout://[::1]:14550")
    return host, _port(port, text)


def _port(port: str, text: str) -> int:
    if not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65_535):
        raise LinkError(f"'{text}' has the port '{port}'; allowed are 1..65535")
    return int(port)


def _either(host: str, port: int) -> str:
    shown = f"[{host}]" if ":" in host else host or "HOST"
    return f"to listen for the vehicle give udpin://{ANYWHERE}:{port}, to send to it first udpout://{shown}:{port}"


def _tcp(host: str, port: int) -> str:
    return Address("tcpout", host or "HOST", port).url
