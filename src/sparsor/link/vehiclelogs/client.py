"""The vehicle's own logs through MAVLink's log protocol (LOG_REQUEST_LIST, LOG_REQUEST_DATA), on bad links too.

A log is fetched in windows, as QGroundControl and MAVSDK do: a window is asked for at once, then what is missing
of it. ArduPilot passes over what is asked for while it still sends, PX4 drops what it was sending: so the next
request goes out when the last one was answered or fell silent.
"""

from __future__ import annotations

import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

from sparsor.core.progress import silent
from sparsor.errors import LinkFailureError
from sparsor.link.roundtrip import RoundTrip
from sparsor.link.vehiclelogs.window import CHUNK, Pace, Window

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import BinaryIO

    from sparsor.core.progress import Progress
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Inbox, Received
    from sparsor.link.vehicles import FoundVehicle

WINDOW: Final = 2048 * CHUNK
QUIET_S: Final = 0.1  # data that flowed has ended when nothing came for this long, or for four round trips
ALL: Final = 0xFFFF
SOON: Final = 64  # chunks between two words on the progress
REFUSAL: Final = "Disarm for log download"  # ArduPilot
BUSY: Final = "Log download in progress"  # ArduPilot, on another link than the one it serves


@dataclass(frozen=True)
class LogEntry:
    """One log on the vehicle.

    Parameters
    ----------
    number : int
        The vehicle's own: ArduPilot counts from 1, PX4 from 0.
    size : int
        Bytes.
    unix_s : int
        When it was written, seconds since 1970; 0 where the vehicle did not know.
    """

    number: int
    size: int
    unix_s: int

    @property
    def date(self) -> str:
        """When it was written, UTC, as ISO 8601; empty where the vehicle did not know."""
        return f"{datetime.fromtimestamp(self.unix_s, UTC):%Y-%m-%dT%H:%M:%SZ}" if self.unix_s else ""

    def file_name(self, vehicle: FoundVehicle) -> str:
        """Return what the file is called: as on ArduPilot's card, or as QGroundControl calls those of PX4.

        Examples
        --------
        >>> from sparsor.link.vehicles import FoundVehicle
        >>> LogEntry(3, 90, 0).file_name(FoundVehicle(1, 1, 3, 2, False))
        '00000003.BIN'
        >>> LogEntry(0, 90, 1_700_000_000).file_name(FoundVehicle(1, 1, 12, 2, False))
        'log_0_2023-11-14-22-13-20.ulg'
        """
        name = vehicle.autopilot.name if vehicle.autopilot else ""
        if name == "ardupilot":
            return f"{self.number:08d}.BIN"
        date = self.date.rstrip("Z").replace("T", "-").replace(":", "-") or "unknown"
        return f"log_{self.number}_{date}.{'ulg' if name == 'px4' else 'log'}"


class LogClient:
    """Asks one vehicle for its logs; `open_logs` makes one.

    Parameters
    ----------
    connection : Connection
    vehicle : FoundVehicle
    inbox : Inbox
        With LOG_ENTRY, LOG_DATA and STATUSTEXT of that vehicle.
    timeout_s : float
        How long the vehicle may bring nothing new.
    """

    def __init__(self, connection: Connection, vehicle: FoundVehicle, inbox: Inbox, timeout_s: float) -> None:
        from pymavlink.dialects.v20 import ardupilotmega

        self._connection, self._vehicle, self._inbox = connection, vehicle, inbox
        self._mavlink, self._timeout_s = ardupilotmega, timeout_s
        self._target = (vehicle.system_id, vehicle.component_id)
        self._trip = RoundTrip()
        self._pace = Pace()
        self._busy = False

    def entries(self) -> tuple[LogEntry, ...]:
        """Return the logs on the vehicle, oldest first.

        Raises
        ------
        LinkFailureError
            When the vehicle does not answer, refuses, or the link is gone.
        """
        found: dict[int, LogEntry] = {}
        news_s = time.monotonic()
        while time.monotonic() - news_s < self._timeout_s:
            self._request_list(0, ALL)
            while (received := self._next()) is not None:
                if received.kind != "LOG_ENTRY":
                    continue
                entry = received.message
                if entry.num_logs == 0:
                    return ()
                if entry.id not in found:
                    news_s = time.monotonic()
                found[entry.id] = LogEntry(entry.id, entry.size, entry.time_utc)
                if len(found) >= entry.num_logs:
                    return tuple(found[number] for number in sorted(found))
            self._trip.expired()
        raise self._silence("listing its logs")

    def fetch(self, entry: LogEntry, stream: BinaryIO, progress: Progress = silent) -> int:
        """Write a log to a stream, in order; returns its bytes (less than listed where it turns out shorter).

        Raises
        ------
        LinkFailureError
            When the vehicle stops sending, refuses, or the link is gone.
        """
        at = 0
        while at < entry.size:
            window = Window(at, min(WINDOW, entry.size - at))
            self._fill(entry, window, progress)
            stream.write(window.data)
            at += len(window.data)
            progress(f"log {entry.number}", at, entry.size)
            if window.cut:
                break
        return at

    def end(self) -> None:
        """Tell the vehicle that this was all: it may log again."""
        self._connection.send(self._mavlink.MAVLink_log_request_end_message(*self._target))

    def _fill(self, entry: LogEntry, window: Window, progress: Progress) -> None:
        news_s, clear = time.monotonic(), True
        while window.missing:
            if not clear:
                # PX4 sends data only to who listed since the last LOG_REQUEST_END, another ground station's too.
                self._request_list(entry.number, entry.number)
            before = len(window.missing)
            clear = self._round(entry, window, progress, clear=clear)
            if len(window.missing) < before:
                news_s = time.monotonic()
            elif time.monotonic() - news_s > self._timeout_s:
                raise self._silence(f"sending log {entry.number} after {window.received} of {entry.size} bytes")

    def _round(self, entry: LogEntry, window: Window, progress: Progress, *, clear: bool) -> bool:
        """Ask for a stretch that is missing and take what comes; returns whether anything did.

        `clear` says that what comes can be told from answers to earlier requests.
        """
        first, last = window.stretch(self._pace.worth)
        request = self._mavlink.MAVLink_log_request_data_message(
            *self._target, entry.number, window.start + first * CHUNK, (last + 1 - first) * CHUNK
        )
        self._connection.send(request)
        asked_s = time.monotonic()
        times_s: list[float] = []
        while (received := self._next(flowing=bool(times_s))) is not None:
            message = received.message
            if received.kind != "LOG_DATA" or message.id != entry.number:
                continue
            place = window.take(message.ofs, bytes(message.data[: message.count]))
            if place is None or received.time_s < asked_s:
                continue
            times_s.append(received.time_s)
            if len(times_s) % SOON == 0:
                progress(f"log {entry.number}", window.received, entry.size)
            if place >= last or window.cut:
                break
        if times_s:
            self._trip.answered(times_s[0] - asked_s if clear else None)
        else:
            self._trip.expired()
        self._pace.learn(asked_s, times_s, time.monotonic())
        return bool(times_s)

    def _request_list(self, first: int, last: int) -> None:
        self._connection.send(self._mavlink.MAVLink_log_request_list_message(*self._target, first, last))

    def _next(self, *, flowing: bool = False) -> Received | None:
        """Return what comes within the time that the link is expected to take."""
        wait_s = self._trip.resend_s
        if flowing:
            wait_s = min(wait_s, max(QUIET_S, 4 * self._pace.latency_s))
        received = next(self._inbox.until(time.monotonic() + wait_s), None)
        if received is not None and received.kind == "STATUSTEXT":
            if received.message.text == REFUSAL:
                raise LinkFailureError(f"{self._vehicle.words} refuses: '{REFUSAL}'. Fetch the log after the landing")
            self._busy = self._busy or received.message.text == BUSY
        return received

    def _silence(self, doing: str) -> LinkFailureError:
        sentence = f"{self._vehicle.words} stopped {doing}: nothing new for {self._timeout_s:g} s"
        if self._busy:
            return LinkFailureError(f"{sentence}; it says '{BUSY}': another ground station is fetching")
        if self._vehicle.armed:
            return LinkFailureError(f"{sentence}. It is armed: fetch the log after the landing")
        return LinkFailureError(f"{sentence}. Is it in range? Some boards keep no log without a memory card")


@contextmanager
def open_logs(connection: Connection, vehicle: FoundVehicle, timeout_s: float = 10.0) -> Iterator[LogClient]:
    """Yield what asks a vehicle for its logs; the vehicle is told when it is over, however it ends."""
    with connection.inbox("LOG_ENTRY", "LOG_DATA", "STATUSTEXT", system_id=vehicle.system_id) as inbox:
        client = LogClient(connection, vehicle, inbox, timeout_s)
        try:
            yield client
        finally:
            with suppress(LinkFailureError):  # what ended it is what matters
                client.end()
