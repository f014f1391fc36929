"""TCP links."""

from __future__ import annotations

import select
import socket
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkError, LinkFailureError
from sparsor.link.ports.sockets import bound

if TYPE_CHECKING:
    from sparsor.link.ports.addresses import Address

BUFFER: Final = 65_536
SEND_S: Final = 10.0  # a vehicle that takes nothing for so long is gone


class TcpOut:
    """A TCP connection that we make."""

    def __init__(self, address: Address, timeout_s: float) -> None:
        try:
            self._socket = socket.create_connection((address.place, address.number), timeout=timeout_s)
        except socket.gaierror as error:
            raise LinkError(f"'{address.url}': there is no host '{address.place}' ({error.strerror})") from error
        except OSError as error:
            raise LinkFailureError(
                f"nobody answers at {address.url}: {error.strerror or error}. Is the autopilot running, "
                "and is this its port (SITL's is 5760)?"
            ) from error
        self._socket.settimeout(SEND_S)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def receive(self, timeout_s: float) -> bytes:
        """Return what has come."""
        return _receive(self._socket, timeout_s)

    def send(self, data: bytes) -> None:
        """Send all of it."""
        _send(self._socket, data)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


class TcpIn:
    """A TCP port that waits for the vehicle to connect; one at a time, and again after it left."""

    def __init__(self, address: Address) -> None:
        self._listener = bound(address, socket.SOCK_STREAM)
        self._listener.listen(1)
        self._client: socket.socket | None = None

    def receive(self, timeout_s: float) -> bytes:
        """Return what has come."""
        if self._client is None:
            self._listener.settimeout(timeout_s)
            try:
                client = self._listener.accept()[0]
                client.settimeout(SEND_S)
                self._client = client
            except TimeoutError:
                return b""
            except OSError as error:
                raise LinkFailureError(f"the link broke: {error.strerror or error}") from error
        try:
            return _receive(self._client, timeout_s)
        except LinkFailureError:
            self._leave()
            return b""

    def send(self, data: bytes) -> None:
        """Send to the vehicle, if it is connected."""
        client = self._client
        if client is not None:
            try:
                _send(client, data)
            except LinkFailureError:
                return

    def close(self) -> None:
        """Close the port and the connection."""
        self._leave()
        self._listener.close()

    def _leave(self) -> None:
        client, self._client = self._client, None
        if client is not None:
            client.close()


def _receive(connection: socket.socket, timeout_s: float) -> bytes:
    try:
        # Not settimeout: it would also cut short what another thread is sending.
        if not select.select([connection], [], [], timeout_s)[0]:
            return b""
        data = connection.recv(BUFFER)
    except (OSError, ValueError) as error:
        raise LinkFailureError(f"the connection broke: {error}") from error
    if not data:
        raise LinkFailureError("the other side closed the connection")
    return data


def _send(connection: socket.socket, data: bytes) -> None:
    try:
        connection.sendall(data)
    except OSError as error:
        raise LinkFailureError(f"the connection broke: {error.strerror or error}") from error
