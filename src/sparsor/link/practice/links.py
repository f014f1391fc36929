"""The links of the practice autopilot: UDP peers of one bound port, and TCP connections."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.autopilot import COMPONENT

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from sparsor.link.practice.exchange import Message

UDP_SILENT_S = 30.0
MOST_WAITING_BYTES = 8_000_000


class Link:
    """One client: its parser, its sequence numbers, its bytes.

    Parameters
    ----------
    number : int
        Names the link.
    system : int
        System id that the vehicle sends as.
    send : callable
        Takes bytes, returns how many were taken.
    now_s : float
        Wall clock.
    """

    def __init__(self, number: int, system: int, send: Callable[[bytes], int], now_s: float) -> None:
        self.number = number
        self.heard_s = now_s
        self.systems: set[int] = set()
        """System ids heard on this link."""
        self._send = send
        self._waiting = bytearray()
        self._mav = mavlink.MAVLink(None, srcSystem=system, srcComponent=COMPONENT)
        self._mav.robust_parsing = True

    def parse(self, data: bytes, now_s: float) -> list[Any]:
        """Return the whole messages in what arrived; damaged bytes are passed over."""
        self.heard_s = now_s
        messages = self._mav.parse_buffer(data) or []
        good = [message for message in messages if message.get_type() != "BAD_DATA"]
        self.systems.update(message.get_srcSystem() for message in good)
        return good

    def send(self, message: Message) -> None:
        """Send a message as the vehicle's own."""
        frame = message.pack(self._mav)
        self._mav.seq = (self._mav.seq + 1) % 256
        self.forward(bytes(frame))

    def forward(self, frame: bytes) -> None:
        """Send a frame as it is."""
        if not self._waiting:
            frame = frame[self._send(frame) :]
        self._waiting += frame

    def flush(self) -> bool:
        """Send what waits; False when so much waits that the client must have gone."""
        if self._waiting:
            del self._waiting[: self._send(bytes(self._waiting))]
        return len(self._waiting) < MOST_WAITING_BYTES


def udp_sender(server: socket.socket, address: tuple[str, int]) -> Callable[[bytes], int]:
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
