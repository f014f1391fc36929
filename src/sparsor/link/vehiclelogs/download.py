"""Fetching the vehicle's own logs into files."""

from __future__ import annotations

import time
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.core.files import file_written_in_pieces
from sparsor.core.progress import silent
from sparsor.errors import LinkError, OutputError
from sparsor.link.connection import Connection
from sparsor.link.vehiclelogs.client import LogEntry, open_logs
from sparsor.link.vehicles import FoundVehicle, find_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from sparsor.core.progress import Progress
    from sparsor.link.vehiclelogs.client import LogClient

SHOWN = 20


@dataclass(frozen=True)
class Fetched:
    """One log in a file.

    Parameters
    ----------
    file : Path
    log : int
        The vehicle's number for it.
    size : int
        Bytes.
    seconds : float
        How long it took.
    """

    file: Path
    log: int
    size: int
    seconds: float


@dataclass(frozen=True)
class Downloads:
    """What was fetched, and from whom.

    Parameters
    ----------
    vehicle : FoundVehicle
    logs : tuple of Fetched
    """

    vehicle: FoundVehicle
    logs: tuple[Fetched, ...]


def list_logs(
    url: str, *, system_id: int | None = None, timeout_s: float = 30.0
) -> tuple[FoundVehicle, tuple[LogEntry, ...]]:
    """Return the vehicle on a link and the logs that it has, oldest first.

    Parameters
    ----------
    url : str
        Address of the link.
    system_id : int or None
        Which vehicle; None for the only one there is.
    timeout_s : float
        How long to wait for the vehicle, and for anything new from it.

    Raises
    ------
    LinkError
        When the address cannot be used, or several vehicles are there.
    LinkFailureError
        When the vehicle is silent or refuses.
    """
    with _logs_of(url, system_id, timeout_s, warn=None) as (vehicle, client):
        return vehicle, client.entries()


def download(
    url: str,
    output: Path,
    *,
    number: int | None = None,
    every: bool = False,
    into_folder: bool = False,
    system_id: int | None = None,
    timeout_s: float = 30.0,
    replace: bool = False,
    warn: Callable[[str], None] | None = None,
    progress: Progress = silent,
) -> Downloads:
    """Fetch the vehicle's last log, one by its number, or all.

    Parameters
    ----------
    url : str
        Address of the link.
    output : Path
        A file, or a folder in which the log gets the name that it has on the vehicle.
    number : int or None
        Which log, by the vehicle's number; None for the last one.
    every : bool
        Fetch all of them; `output` is a folder then.
    into_folder : bool
        `output` is a folder, made when it is missing.
    system_id : int or None
        Which vehicle; None for the only one there is.
    timeout_s : float
        How long to wait for the vehicle, and for anything new from it.
    replace : bool
        Whether files that are there may be replaced.
    warn : callable, optional
        Told before it begins what may make it fail.
    progress : Progress

    Raises
    ------
    LinkError
        When the address cannot be used, several vehicles are there, there is no such log, or a file is there.
    LinkFailureError
        When the vehicle is silent, refuses or stops on the way.
    OutputError
        When a file cannot be written.
    """
    into_folder = into_folder or every
    if not into_folder and not output.is_dir():
        _check_free(output, replace=replace)
    with _logs_of(url, system_id, timeout_s, warn=warn) as (vehicle, client):
        entries = _chosen(client.entries(), number, every=every, vehicle=vehicle)
        if into_folder:
            _make(output)
        files = [output / entry.file_name(vehicle) if output.is_dir() else output for entry in entries]
        for file in files:
            _check_free(file, replace=replace)
        fetched = [_fetch(client, entry, file, progress) for entry, file in zip(entries, files, strict=True)]
    return Downloads(vehicle, tuple(fetched))


@contextmanager
def _logs_of(
    url: str, system_id: int | None, timeout_s: float, *, warn: Callable[[str], None] | None
) -> Iterator[tuple[FoundVehicle, LogClient]]:
    with Connection(url, timeout_s=timeout_s) as connection:
        vehicle = find_vehicle(connection, system_id, timeout_s)
        if vehicle.armed and warn is not None:
            warn(f"{vehicle.words}: ArduPilot sends no log while armed, and others send slowly what they have so far")
        with open_logs(connection, vehicle, timeout_s) as client:
            yield vehicle, client


def _fetch(client: LogClient, entry: LogEntry, file: Path, progress: Progress) -> Fetched:
    begun_s = time.monotonic()
    with file_written_in_pieces(file) as stream:
        size = client.fetch(entry, stream, progress)
    return Fetched(file, entry.number, size, time.monotonic() - begun_s)


def _chosen(
    entries: tuple[LogEntry, ...], number: int | None, *, every: bool, vehicle: FoundVehicle
) -> tuple[LogEntry, ...]:
    if not entries:
        raise LinkError(f"{vehicle.words} has no log; autopilots log from arming to disarming")
    if every:
        return entries
    if number is None:
        return entries[-1:]
    chosen = tuple(entry for entry in entries if entry.number == number)
    if not chosen:
        numbers = [str(entry.number) for entry in entries]
        listed = ", ".join(numbers) if len(numbers) <= SHOWN else f"{numbers[0]} to {numbers[-1]}"
        raise LinkError(f"{vehicle.words} has no log {number}; it has {listed}")
    return chosen


def _check_free(file: Path, *, replace: bool) -> None:
    if file.exists() and not replace:
        raise LinkError(f"'{file}' is there already; give another name, or --force to replace it")


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder '{folder}': {error.strerror or error}") from error
