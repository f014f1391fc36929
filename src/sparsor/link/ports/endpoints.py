"""The sockets and serial ports under a link: opened once, read and written as plain bytes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from sparsor.link.ports.datagrams import UdpIn, UdpOut
from sparsor.link.ports.serialport import SerialEndpoint
from sparsor.link.ports.streams import TcpIn, TcpOut

if TYPE_CHECKING:
    from sparsor.link.ports.addresses import Address


class Endpoint(Protocol):
    """One open link."""

    def receive(self, timeout_s: float) -> bytes:
        """Return what has come, b"" when nothing did in time; LinkFailureError when the other side is gone."""
        ...

    def send(self, data: bytes) -> None:
        """Send to whoever is there; nothing happens while nobody is. LinkFailureError when the link is gone."""
        ...

    def close(self) -> None:
        """Give the port back."""
        ...


def open_endpoint(address: Address, timeout_s: float) -> Endpoint:
    """Open a link; a TCP connection has to come up within the timeout.

    Raises
    ------
    LinkError
        When the port is taken, the host or device unknown.
    LinkFailureError
        When nobody answers at the other side.
    """
    if address.kind == "serial":
        return SerialEndpoint(address)
    if address.kind == "tcpout":
        return TcpOut(address, timeout_s)
    if address.kind == "tcpin":
        return TcpIn(address)
    return UdpIn(address) if address.kind == "udpin" else UdpOut(address)
