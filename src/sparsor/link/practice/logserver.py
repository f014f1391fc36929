"""MAVLink's log protocol: which logs there are, and their bytes, 90 at a time.

ArduPilot (AP_Logger_MAVLinkLogTransfer.cpp): logs are numbered from 1; refused while armed; one link at a time,
and what that link asks for while it is being served is passed over. PX4 1.15 (mavlink_log_handler.cpp): numbered
from 0; each link is served by itself, a new request takes the place of the old one, and data is sent only to who
asked for the list since the last LOG_REQUEST_END.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.exchange import Message, Outgoing, Peer

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sparsor.link.practice.vehiclelog import StoredLog, VehicleLog

REQUESTS: Final = frozenset({"LOG_REQUEST_LIST", "LOG_REQUEST_DATA", "LOG_REQUEST_END", "LOG_ERASE"})
CHUNK: Final = 90
# As much as a fast link takes (360 kB/s) and a client's socket holds between two looks at it.
MESSAGES_S: Final = 4000.0
MOST_AT_ONCE: Final = 40


@dataclass
class _Listing:
    """Entries that are still to be sent, both ends included."""

    next: int
    last: int


@dataclass
class _Sending:
    """A range of a log that is still to be sent."""

    number: int
    log: StoredLog
    offset: int
    remaining: int


class LogServer:
    """Answers LOG_* messages; `advance` sends what was asked for, at a bounded rate.

    Parameters
    ----------
    log : VehicleLog
    px4 : bool
        Which autopilot's habits.
    """

    def __init__(self, log: VehicleLog, *, px4: bool) -> None:
        self._log, self._px4 = log, px4
        self._first = 0 if px4 else 1
        self._work: dict[int, _Listing | _Sending] = {}
        self._listed: dict[int, list[StoredLog]] = {}  # PX4: what each link was shown
        self._warned = False
        self._sent_s = float("-inf")

    def receive(self, message: Message, peer: Peer, *, armed: bool) -> list[Outgoing]:
        """Return the answers to one of `REQUESTS` that have to be given at once; the rest comes from `advance`."""
        if armed and not self._px4:
            return self._refuse(peer)
        self._warned = False
        kind = message.get_type()
        if kind == "LOG_REQUEST_END":
            self._end(peer)
        elif kind == "LOG_ERASE":
            self._log.erase()
            self._listed.clear()
            self._work.clear()
        elif not self._px4 and self._work:
            return (
                [] if peer.link in self._work else [_text(peer, mavlink.MAV_SEVERITY_INFO, "Log download in progress")]
            )
        else:
            if kind == "LOG_REQUEST_LIST":
                self._list(message.start, message.end, peer)
            else:
                self._send(message, peer)
            # The first one at once, as ArduPilot does: a list of one is over before the next request comes.
            return list(self._some(peer.link, 1)) if peer.link in self._work else []
        return []

    def leave(self, link: int) -> None:
        """Forget a link that closed."""
        self._work.pop(link, None)
        self._listed.pop(link, None)

    def advance(self, now_s: float, *, armed: bool) -> list[Outgoing]:
        """Return what may be sent by now, by the wall clock."""
        if not self._work or (armed and not self._px4):
            self._sent_s = now_s
            return []
        room = min(int((now_s - self._sent_s) * MESSAGES_S), MOST_AT_ONCE)
        if room <= 0:
            return []
        self._sent_s = now_s
        return [out for link in list(self._work) for out in self._some(link, max(room // len(self._work), 1))]

    def _refuse(self, peer: Peer) -> list[Outgoing]:
        if self._warned:
            return []
        self._warned = True
        return [_text(peer, mavlink.MAV_SEVERITY_ERROR, "Disarm for log download")]

    def _end(self, peer: Peer) -> None:
        if self._px4:
            self.leave(peer.link)
        else:
            self._work.clear()

    def _list(self, start: int, end: int, peer: Peer) -> None:
        count = len(self._log.stored)
        self._listed[peer.link] = list(self._log.stored)
        last = self._first + count - 1
        if not count:
            self._work[peer.link] = _Listing(0, 0)
        elif self._px4:
            self._work[peer.link] = _Listing(min(start, last), min(end, last))
        else:
            self._work[peer.link] = _Listing(max(start, 1), min(end, last))

    def _send(self, message: Message, peer: Peer) -> None:
        logs = self._listed.get(peer.link, []) if self._px4 else self._log.stored
        place = message.id - self._first
        if not 0 <= place < len(logs):
            return
        remaining = min(max(logs[place].size - message.ofs, 0), message.count)
        self._work[peer.link] = _Sending(message.id, logs[place], message.ofs, remaining)

    def _some(self, link: int, room: int) -> Iterator[Outgoing]:
        work = self._work[link]
        step = self._entry if isinstance(work, _Listing) else self._data
        for _ in range(room):
            yield Outgoing(step(link), link)
            if link not in self._work:
                return

    def _entry(self, link: int) -> Message:
        work, logs = self._work[link], self._listed[link]
        assert isinstance(work, _Listing)
        place = work.next - self._first
        log = logs[place] if 0 <= place < len(logs) else None
        unix_s, size = (log.unix_s, log.size) if log else (0, 0)
        entry = mavlink.MAVLink_log_entry_message(work.next, len(logs), work.last, unix_s, size)
        if work.next >= work.last:
            del self._work[link]
        work.next += 1
        return entry

    def _data(self, link: int) -> Message:
        work = self._work[link]
        assert isinstance(work, _Sending)
        data = work.log.read(work.offset, min(work.remaining, CHUNK))
        message = mavlink.MAVLink_log_data_message(work.number, work.offset, len(data), data.ljust(CHUNK, b"\0"))
        work.offset += len(data)
        work.remaining -= len(data)
        if len(data) < CHUNK or work.remaining == 0:
            del self._work[link]
        return message


def _text(peer: Peer, severity: int, text: str) -> Outgoing:
    return Outgoing(mavlink.MAVLink_statustext_message(severity, text.encode()), peer.link)
