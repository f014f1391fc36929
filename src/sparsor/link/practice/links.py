"""The links of the practice autopilot: UDP peers of one bound port, and TCP connections."""

from __future__ import annotations

import socket
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.core.streams import stream
from sparsor.errors import OutputError
from sparsor.link.practice.autopilot import COMPONENT
from sparsor.link.practice.troubles import LinkTroubles

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from sparsor.link.practice.autopilot import PracticeSettings
    from sparsor.link.practice.exchange import Message

Address = tuple[str, int]

UDP_SILENT_S = 30.0
MOST_WAITING_BYTES = 8_000_000
STREAM = 2  # of the seed; sensor and gusts are 0 and 1
INWARD, OUTWARD = 0, 1


class Way:
    """One direction of a link: it may lose, repeat and delay whole messages.

    Parameters
    ----------
    troubles : LinkTroubles
    *key : int
        Seed, and what names the way.
    """

    def __init__(self, troubles: LinkTroubles, *key: int) -> None:
        self._troubles = troubles
        self._good = troubles == LinkTroubles()
        self._draw = stream(key[0], STREAM, *key[1:])
        self._under_way: deque[tuple[float, Any]] = deque()

    def put(self, what: Any, now_s: float) -> None:  # noqa: ANN401 (a message or its bytes)
        """Send something on its way."""
        times = 1
        if not self._good:
            lost, twice = self._draw.random(2)
            times = 0 if lost < self._troubles.lose else 1 + int(twice < self._troubles.repeat)
        for _ in range(times):
            self._under_way.append((now_s + self._troubles.delay_s, what))

    def arrived(self, now_s: float) -> Iterator[Any]:
        """Yield what has arrived by now."""
        while self._under_way and self._under_way[0][0] <= now_s:
            yield self._under_way.popleft()[1]


class Link:
    """One client: its parser, its sequence numbers, its bytes.

    Parameters
    ----------
    number : int
        Names the link.
    settings : PracticeSettings
        Whose system id the vehicle sends as, and how bad links are.
    send : callable
        Takes bytes, returns how many were taken.
    now_s : float
        Wall clock.
    stays : bool
        Whether it is kept however long it is silent.
    """

    def __init__(
        self,
        number: int,
        settings: PracticeSettings,
        send: Callable[[bytes], int],
        now_s: float,
        *,
        stays: bool = False,
    ) -> None:
        self.number = number
        self.systems: set[int] = set()
        """System ids heard on this link."""
        self._heard_s, self._stays = now_s, stays
        self._send = send
        self._waiting = bytearray()
        troubles = settings.troubles.link
        self._inward, self._outward = (Way(troubles, settings.seed, number, way) for way in (INWARD, OUTWARD))
        self._mav = mavlink.MAVLink(None, srcSystem=settings.system, srcComponent=COMPONENT)
        self._mav.robust_parsing = True

    def parse(self, data: bytes, now_s: float) -> None:
        """Take what came in; damaged bytes are passed over."""
        self._heard_s = now_s
        for message in self._mav.parse_buffer(data) or []:
            if message.get_type() != "BAD_DATA":
                self._inward.put(message, now_s)

    def arrived(self, now_s: float) -> Iterable[Message]:
        """Yield the messages that have arrived by now."""
        for message in self._inward.arrived(now_s):
            self.systems.add(message.get_srcSystem())
            yield message

    def send(self, message: Message, now_s: float) -> None:
        """Send a message as the vehicle's own."""
        frame = message.pack(self._mav)
        self._mav.seq = (self._mav.seq + 1) % 256
        self.forward(bytes(frame), now_s)

    def forward(self, frame: bytes, now_s: float) -> None:
        """Send a frame as it is."""
        self._outward.put(frame, now_s)
        self._put_through(now_s)

    def flush(self, now_s: float) -> None:
        """Send what waits and is due."""
        if self._waiting:
            del self._waiting[: self._send(bytes(self._waiting))]
        self._put_through(now_s)

    def gone(self, now_s: float, silent_s: float) -> bool:
        """Return whether the client must have gone: so much waits for it, or it has been silent for too long."""
        silent = not self._stays and now_s - self._heard_s > silent_s
        return silent or len(self._waiting) >= MOST_WAITING_BYTES

    def _put_through(self, now_s: float) -> None:
        for one in self._outward.arrived(now_s):
            frame = one if self._waiting else one[self._send(one) :]
            self._waiting += frame


def udp_sender(server: socket.socket, address: tuple[Any, ...]) -> Callable[[bytes], int]:
    """Return what sends one datagram to a peer; a peer that is gone loses it."""

    def send(frame: bytes) -> int:
        with suppress(OSError):  # a full buffer or a closed peer: UDP loses it
            server.sendto(frame, address)
        return len(frame)

    return send


def tcp_sender(connection: socket.socket) -> Callable[[bytes], int]:
    """Return what sends as much as fits."""

    def send(data: bytes) -> int:
        try:
            return connection.send(data)
        except (BlockingIOError, InterruptedError):
            return 0
        except OSError:  # closed: reading notices
            return len(data)

    return send


def bound(kind: socket.SocketKind, address: Address) -> socket.socket:
    """Return a socket that is bound, and listens where it is TCP.

    Raises
    ------
    OutputError
        When the port is taken.
    """
    server = socket.socket(socket.AF_INET, kind)
    if kind == socket.SOCK_STREAM:
        server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        server.bind(address)
        if kind == socket.SOCK_STREAM:
            server.listen()
    except OSError as error:
        server.close()
        name, other = ("UDP", 14560) if kind == socket.SOCK_DGRAM else ("TCP", 5770)
        raise OutputError(
            f"{name} port {address[1]} of {address[0]} cannot be opened ({error.strerror or error}); "
            "is another program using it? Give another port (sparsor simulate --listen "
            f"{name.lower()}:{other}), or, when that program waits for vehicles as QGroundControl does on UDP 14550, "
            "send to it (--send-to udp:127.0.0.1:14550)"
        ) from error
    server.setblocking(False)
    return server
