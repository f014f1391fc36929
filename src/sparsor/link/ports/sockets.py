"""Hosts and ports that cannot be used, said in words."""

from __future__ import annotations

import errno
import socket
from typing import TYPE_CHECKING

from sparsor.errors import LinkError

if TYPE_CHECKING:
    from sparsor.link.ports.addresses import Address


def resolved(address: Address, kind: socket.SocketKind) -> tuple[int, tuple[object, ...]]:
    """Return the address family and the socket address of a host and port; LinkError when there is no such host."""
    try:
        found = socket.getaddrinfo(address.place, address.number, type=kind)[0]
    except (OSError, UnicodeError) as error:
        raise LinkError(f"'{address.url}': there is no host '{address.place}' ({error})") from error
    return int(found[0]), found[4]


def bound(address: Address, kind: socket.SocketKind) -> socket.socket:
    """Return a socket that holds a port; LinkError when the port is taken or the host is not ours."""
    family, here = resolved(address, kind)
    server = socket.socket(family, kind)
    try:
        server.bind(here)
    except OSError as error:
        server.close()
        if error.errno == errno.EADDRINUSE:
            raise LinkError(
                f"port {address.number} is taken: another program (QGroundControl, MAVProxy?) listens on it. "
                f"Close it, or give another port. If that is sparsor simulate, give "
                f"{address.kind.replace('in', 'out')}://127.0.0.1:{address.number}"
            ) from error
        raise LinkError(
            f"cannot listen on {address.url}: {error.strerror or error}. '{address.place}' has to be an address of "
            f"this computer; 0.0.0.0 is all of them. To send to a vehicle there, give "
            f"{address.kind.replace('in', 'out')}://{address.place}:{address.number}"
        ) from error
    return server
