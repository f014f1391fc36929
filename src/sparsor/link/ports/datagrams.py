"""UDP links."""

from __future__ import annotations

import errno
import select
import socket
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkFailureError
from sparsor.link.ports.sockets import bound, resolved

if TYPE_CHECKING:
    from sparsor.link.ports.addresses import Address

BUFFER: Final = 65_536


class UdpIn:
    """A bound UDP port; answers everyone who sent to it, as a ground station with several radios does."""

    def __init__(self, address: Address) -> None:
        self._socket = bound(address, socket.SOCK_DGRAM)
        self._senders: dict[tuple[object, ...], None] = {}

    def receive(self, timeout_s: float) -> bytes:
        """Return one datagram."""
        self._socket.settimeout(timeout_s)
        try:
            data, sender = self._socket.recvfrom(BUFFER)
        except (TimeoutError, ConnectionError):  # Windows reports a sender that closed its port as a reset
            return b""
        except OSError as error:
            raise LinkFailureError(f"the link broke: {error.strerror or error}") from error
        self._senders[sender] = None
        return data

    def send(self, data: bytes) -> None:
        """Send to everyone heard so far."""
        for sender in tuple(self._senders):
            try:
                self._socket.sendto(data, sender)
            except OSError:  # gone, or out of reach for the moment: it is heard again when it is back
                continue

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class UdpOut:
    """UDP to one host and port, from whichever port is free."""

    def __init__(self, address: Address) -> None:
        family, target = resolved(address, socket.SOCK_DGRAM)
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._target = target

    def receive(self, timeout_s: float) -> bytes:
        """Return one datagram."""
        self._socket.settimeout(timeout_s)
        try:
            return self._socket.recv(BUFFER)
        except (TimeoutError, ConnectionError):
            return b""
        except OSError as error:
            if error.errno in (errno.EINVAL, getattr(errno, "WSAEINVAL", -1)):  # not bound before the first send
                select.select([], [], [], timeout_s)
                return b""
            raise LinkFailureError(f"the link broke: {error.strerror or error}") from error

    def send(self, data: bytes) -> None:
        """Send to the host; a host that is out of reach is no error, it may come back."""
        try:
            self._socket.sendto(data, self._target)
        except OSError:
            return

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
