"""Writing a .tlog: every frame with the time at which it passed."""

from __future__ import annotations

import struct
import threading
import time
from typing import TYPE_CHECKING

from sparsor.errors import LinkError, OutputError

if TYPE_CHECKING:
    from pathlib import Path

    from sparsor.core.mavlink_frames import Frame


class TlogWriter:
    """Appends records of 8 bytes (big-endian, microseconds since 1970) and a raw frame.

    The file has its own name from the start and every record goes to the system at once, unlike our other files:
    a recording cannot be made again, so what was heard before a crash has to be there after it. A record that is
    cut short is the last one, and readers of .tlog files expect that.

    Times are the computer's clock at the start plus time that only goes forward: a clock that is set during the
    flight does not fold the log.

    Parameters
    ----------
    path : Path
    replace : bool
        Whether a file that is there may be replaced; it is kept as NAME.before until the recording is closed.

    Raises
    ------
    LinkError
        When the file is there and `replace` is not set.
    OutputError
        When it cannot be written.
    """

    def __init__(self, path: Path, *, replace: bool = False) -> None:
        self.path = path
        self.frames = 0
        self._lock = threading.Lock()
        self._clock_offset_ns = time.time_ns() - time.monotonic_ns()
        self._before = path.with_name(f"{path.name}.before") if replace and path.is_file() else None
        try:
            if self._before is not None:
                path.replace(self._before)
            self._stream = path.open("xb", buffering=0)
        except FileExistsError as error:
            raise LinkError(f"'{path}' is there already; give another name, or --force to replace it") from error
        except OSError as error:
            raise OutputError(f"cannot write '{path}': {error.strerror or error}") from error

    def write(self, frame: Frame) -> None:
        """Append one frame.

        Raises
        ------
        OutputError
            When the disk is full or gone.
        """
        with self._lock:
            if self._stream.closed:
                return
            now_us = (self._clock_offset_ns + time.monotonic_ns()) // 1000
            record = struct.pack(">Q", now_us) + frame.raw
            try:
                if self._stream.write(record) != len(record):
                    raise OutputError(f"cannot write all of a record to '{self.path}': is the disk full?")
            except OSError as error:
                raise OutputError(f"cannot write '{self.path}': {error.strerror or error}") from error
            self.frames += 1

    def close(self) -> None:
        """Close the file; nothing is written after that. Can be called twice."""
        with self._lock:
            self._stream.close()
            if self._before is not None:
                self._before.unlink(missing_ok=True)
                self._before = None

    def discard(self) -> None:
        """Close and delete it, because nothing came of it: a file that it replaced is there again."""
        with self._lock:
            self._stream.close()
            self.path.unlink(missing_ok=True)
            if self._before is not None:
                self._before.replace(self.path)
                self._before = None
