"""The practice vehicle's own logs: one file for each flight, from arming to disarming."""

from __future__ import annotations

import re
import shutil
import tempfile
import weakref
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.errors import OutputError
from sparsor.link.practice.binlog import BinLog
from sparsor.link.practice.ulog import ULog

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from io import FileIO

    from sparsor.link.practice.flight import Flight

_NUMBERED = re.compile(r"(?:log_)?(\d+)(?:_.*)?\.(?:BIN|ulg)")


@dataclass(frozen=True)
class NamedValue:
    """A NAMED_VALUE_FLOAT, and who sent it.

    Parameters
    ----------
    time_boot_ms : int
        By the sender's clock.
    name : str
    value : float
    system, component : int
    """

    time_boot_ms: int
    name: str
    value: float
    system: int
    component: int


@dataclass(frozen=True)
class StoredLog:
    """One log that can be fetched.

    Parameters
    ----------
    path : Path
    unix_s : int
        When it began, by the vehicle's clock.
    """

    path: Path
    unix_s: int

    @property
    def size(self) -> int:
        """Bytes; a log that is being written grows, and one whose file was taken away has none."""
        try:
            return self.path.stat().st_size
        except OSError:
            return 0

    def read(self, offset: int, count: int) -> bytes:
        """Return up to `count` bytes."""
        try:
            with self.path.open("rb") as stream:
                stream.seek(offset)
                return stream.read(count)
        except OSError:
            return b""


class Format(Protocol):
    """What becomes of a flight in one log format; everything is yielded as bytes for the file."""

    def header(self) -> Iterator[bytes]:
        """Yield what the log begins with."""
        ...

    def step(self) -> Iterator[bytes]:
        """Yield what is due now."""
        ...

    def named_value(self, value: NamedValue) -> Iterator[bytes]:
        """Yield a named value."""
        ...

    def text(self, severity: int, text: str) -> Iterator[bytes]:
        """Yield a status message."""
        ...

    def footer(self) -> Iterator[bytes]:
        """Yield what the log ends with."""
        ...


class VehicleLog:
    """Writes the logs of a vehicle as it flies.

    What is written goes to the file at once: a rehearsal that is broken off leaves its log as far as it came.

    Parameters
    ----------
    flight : Flight
    boot_unix_s : float
        What the clock said at power-up.
    system : int
        The vehicle's system id.
    folder : Path or None
        Where the files go, made when it is missing; None keeps them in a temporary folder, which goes with the
        program. Files that are in it stay, and are not offered for download.

    Raises
    ------
    OutputError
        When the folder cannot be made.
    """

    def __init__(self, flight: Flight, boot_unix_s: float, system: int, folder: Path | None) -> None:
        self._flight, self._boot_unix_s, self._system = flight, boot_unix_s, system
        self._folder, self._temporary = folder, folder is None
        self._format: Format | None = None
        self._stream: FileIO | None = None
        self.stored: list[StoredLog] = []
        """Oldest first; the last one may still be written."""
        if folder is not None:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise OutputError(f"cannot make the folder '{folder}' for logs: {error.strerror or error}") from error

    def step(self) -> None:
        """Follow the flight: begin a log, write what is due, end the log."""
        self._begin_if_armed()
        if self._format is None:
            return
        self._write(self._format.step())
        if not self._flight.armed:
            self._end()

    def named_value(self, value: NamedValue) -> None:
        """Log a named value; nothing is logged while disarmed."""
        self._begin_if_armed()
        if self._format is not None:
            self._write(self._format.named_value(value))

    def text(self, severity: int, text: str) -> None:
        """Log a status message."""
        self._begin_if_armed()
        if self._format is not None:
            self._write(self._format.text(severity, text))

    def erase(self) -> None:
        """Offer no log any more but the one that is being written; files in a folder of the user's stay there."""
        kept = self.stored[-1:] if self._stream is not None else []
        if self._temporary:
            for log in self.stored[: len(self.stored) - len(kept)]:
                log.path.unlink(missing_ok=True)
        self.stored = kept

    def _begin_if_armed(self) -> None:
        if self._format is not None or not self._flight.armed:
            return
        if self._flight.flavour.is_px4:
            self._format = ULog(self._flight, self._boot_unix_s, self._system)
        else:
            self._format = BinLog(self._flight, self._boot_unix_s)
        unix_s = self._boot_unix_s + self._flight.time_s
        try:
            path = self._next_path(unix_s)
            self._stream = path.open("xb", buffering=0)
        except OSError as error:
            self._fail(error)
            return
        self.stored.append(StoredLog(path, int(unix_s)))
        self._write(self._format.header())

    def _next_path(self, unix_s: float) -> Path:
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="sparsor-logs-"))
            weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
        taken = [int(match[1]) for path in self._folder.iterdir() if (match := _NUMBERED.fullmatch(path.name))]
        number = max(taken, default=0) + 1
        if self._flight.flavour.is_px4:
            return self._folder / f"log_{number}_{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%d-%H-%M-%S}.ulg"
        return self._folder / f"{number:08d}.BIN"

    def _write(self, records: Iterable[bytes]) -> None:
        if self._stream is None:
            return
        try:
            self._stream.write(b"".join(records))
        except OSError as error:
            self._fail(error)

    def _end(self) -> None:
        if self._format is not None:
            self._write(self._format.footer())
        if self._stream is not None:
            self._stream.close()
        self._format = self._stream = None

    def _fail(self, error: OSError) -> None:
        """Fly on without a log, as a vehicle with a full card does."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None
        self._flight.say(f"Logging failed: {error.strerror}", mavlink.MAV_SEVERITY_CRITICAL)
