"""Flight logs of every kind; what kind a file is, its contents say."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from sparsor.core.progress import silent
from sparsor.errors import LogError
from sparsor.flightlog.assembly import assemble
from sparsor.flightlog.joining import join
from sparsor.flightlog.log import Damage, FlightLog
from sparsor.flightlog.opening import LogFile

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable

    from sparsor.core.progress import Progress
    from sparsor.flightlog.recording import Recording

KINDS: Final = "a .tlog, an ArduPilot .BIN, a PX4 .ulg or a CSV table, as they are or packed with gzip or xz"
_LOOK: Final = 1 << 16


def read_logs(
    paths: Iterable[str | os.PathLike[str]], *, sensor: str | None = None, progress: Progress = silent
) -> FlightLog:
    """Return the logs of one mission (several sorties, interrupted flights, two recorders) as one.

    Parameters
    ----------
    paths : iterable of path
        At least one.
    sensor : str, optional
        As in `read_log`.
    progress : Progress

    Raises
    ------
    LogError
        As `read_log`; when no path is given.
    """
    logs = [read_log(path, sensor=sensor, progress=progress) for path in paths]
    if not logs:
        raise LogError(f"no log was given; give {KINDS}")
    return join(logs)


def read_log(path: str | os.PathLike[str], *, sensor: str | None = None, progress: Progress = silent) -> FlightLog:
    """Return what one log file holds; damaged parts of it are left out and counted.

    Parameters
    ----------
    path : path
        A .tlog, .BIN, .ulg or CSV file, as it is or packed with gzip or xz.
    sensor : str, optional
        MSG.FIELD of a .BIN message to read beside the named values.
    progress : Progress
        Told the bytes read.

    Raises
    ------
    LogError
        When there is no such file, it is empty, or not a flight log.
    """
    try:
        file = LogFile(Path(path), progress)
        recording = _recording(file, sensor)
    except ValueError as error:  # LogError among them; or a name with a zero byte in it
        if isinstance(error, LogError):
            raise
        raise LogError(f"{str(path)!r} is not a file name ({error}); give {KINDS}") from error
    if file.cut_short:
        recording.damage += Damage(places=1)
    return assemble(file.path.name, recording)


def _recording(file: LogFile, sensor: str | None) -> Recording:
    from sparsor.flightlog.binlog import read_bin
    from sparsor.flightlog.table import read_table
    from sparsor.flightlog.tlog import read_tlog
    from sparsor.flightlog.ulog import read_ulog

    if file.path.is_dir():
        raise LogError(f"'{file.path}' is a folder; give {KINDS}")
    kind = _kind_of(file)
    try:
        if kind == "tlog":
            return read_tlog(file.blocks())
        if kind == "BIN":
            return read_bin(file.blocks(), sensor)
        return read_ulog(file.contents()) if kind == "ulg" else read_table(file.blocks())
    except LogError as error:
        if str(file.path) in str(error):
            raise
        raise LogError(f"cannot read '{file.path}': {error}") from error


def _kind_of(file: LogFile) -> str:
    """Return the kind of a file by what its beginning reads as; damage at its start does not hide it."""
    from sparsor.core.mavlink_scan import TlogScanner
    from sparsor.flightlog.dataflash import Dataflash
    from sparsor.flightlog.table import is_table
    from sparsor.flightlog.ulog import MAGIC

    head = file.head(_LOOK)
    if not head:
        raise LogError(f"'{file.path}' is empty (0 bytes); give {KINDS}")
    if head.startswith(MAGIC):
        return "ulg"
    scanner = TlogScanner(())
    scanner.feed(head, ended=True)
    if scanner.frames and scanner.skipped < len(head) // 2:  # half of it has right checksums: no need to look further
        return "tlog"
    messages = Dataflash([head], lambda _: None)
    # Chance makes a frame of 8 bytes once in millions of bytes of something else, and messages need their FMT first.
    if scanner.frames and scanner.frames >= messages.count:
        return "tlog"
    if messages.formats:
        return "BIN"
    if is_table(head[:4096]):
        return "CSV"
    raise LogError(f"'{file.path}' is not a flight log that is known here; give {KINDS}")
