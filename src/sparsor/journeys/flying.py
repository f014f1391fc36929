"""From a mission folder or a .plan to a recorded flight."""

from __future__ import annotations

import time
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from sparsor.errors import InputError, LeftBehindError, StoppedError
from sparsor.journeys.uploading import choose_plan
from sparsor.link.connection import Connection
from sparsor.link.flights.flying import Flight, FlightResult
from sparsor.link.flights.modes import flight_modes
from sparsor.link.flights.samples import SampleCounter
from sparsor.link.missions.upload import NEW_PLAN, UploadReport, upload_plan
from sparsor.link.ports.addresses import parse_address
from sparsor.link.tlog import TlogWriter
from sparsor.link.vehicles import find_vehicle
from sparsor.mission import read_plan

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from sparsor.link.flights.views import Event, View
    from sparsor.link.vehicles import FoundVehicle
    from sparsor.mission import MissionPlan


class Choice(Enum):
    """What to do after a Ctrl-C in flight."""

    RETURN = "r"
    LEAVE = "k"
    WATCH = "c"


class Watcher(Protocol):
    """Who is told of a flight, and asked."""

    def progress(self, task: str, done: int, total: int) -> None:
        """Hear how far the upload is (`Progress`)."""
        ...

    def found(self, vehicle: FoundVehicle) -> None:
        """Hear which vehicle was found, before anything is sent."""
        ...

    def confirm(self, report: UploadReport) -> bool:
        """Say whether to arm and start, now that the vehicle holds the plan."""
        ...

    def told(self, event: Event) -> None:
        """Hear what happens."""
        ...

    def seen(self, view: View) -> None:
        """See how the flight is, several times a second."""
        ...

    def interrupted(self) -> Choice:
        """Choose, after a Ctrl-C in flight."""
        ...


@dataclass(frozen=True)
class FlightOptions:
    """How to fly.

    Parameters
    ----------
    sortie, system_id : int or None
        Which plan of a folder that holds several, which of several vehicles.
    enable_fence : bool
        Make the vehicle keep to the plan's fence.
    force : bool
        Fly an armed vehicle too, and replace a recording that is there.
    timeout_s, ready_timeout_s, lost_timeout_s : float
        How long to wait for the vehicle, for its being ready to fly, and for a vehicle that fell silent in flight.
    """

    sortie: int | None = None
    system_id: int | None = None
    enable_fence: bool = False
    force: bool = False
    timeout_s: float = 10.0
    ready_timeout_s: float = 120.0
    lost_timeout_s: float = 60.0


@dataclass(frozen=True)
class FlightReport:
    """A flight that has ended.

    Parameters
    ----------
    upload : UploadReport
    result : FlightResult
    tlog : Path
    messages : int
        Frames in the .tlog.
    samples : dict of str to int
        Named values in it, by name.
    """

    upload: UploadReport
    result: FlightResult
    tlog: Path
    messages: int
    samples: dict[str, int]


def fly_mission(path: Path, url: str, output: Path | None, options: FlightOptions, watcher: Watcher) -> FlightReport:
    """Upload a plan, arm, start, watch and record until the vehicle has landed and is disarmed.

    Everything that passes on the link goes into the recording, from the first frame on.

    Parameters
    ----------
    path : Path
        A mission folder or a .plan.
    url : str
        Address of the link.
    output : Path or None
        The .tlog; None: NAME-YYYYmmdd-HHMMSS.tlog beside the plan.
    options : FlightOptions
    watcher : Watcher

    Raises
    ------
    InputError
        When the plan, the address, the file or the vehicle is not one that this can be done with; nothing was sent.
    LinkFailureError
        When the vehicle is silent. LeftBehindError: when the upload, the start or the link in flight failed; says what
        the vehicle does now. StoppedError: after a Ctrl-C.
    """
    chosen = choose_plan(path, options.sortie)
    plan, address = read_plan(chosen), parse_address(url)
    samples = SampleCounter()
    with (
        _recording(output or default_tlog(chosen), replace=options.force) as tlog,
        Connection(address, recording=tlog, timeout_s=options.timeout_s) as connection,
    ):
        connection.listen(samples)
        upload, result = _flown(plan, connection, samples, options, watcher)
    return FlightReport(upload, result, tlog.path, tlog.frames, dict(samples.counts))


def default_tlog(plan: Path) -> Path:
    """Return where a flight of a plan is recorded: beside it, by its name and the local time."""
    return plan.with_name(f"{plan.stem}-{time.strftime('%Y%m%d-%H%M%S')}.tlog")


@contextmanager
def _recording(path: Path, *, replace: bool) -> Iterator[TlogWriter]:
    """Yield a recording; where nothing came of the flight (`InputError`), what was there before is there again."""
    before = path.with_name(f"{path.name}.before")
    kept = replace and path.is_file()
    if kept:
        path.replace(before)
    tlog = TlogWriter(path)
    try:
        yield tlog
    except InputError:
        tlog.close()
        path.unlink()
        if kept:
            before.replace(path)
        raise
    finally:
        tlog.close()
    if kept:
        before.unlink()


def _flown(
    plan: MissionPlan, connection: Connection, samples: SampleCounter, options: FlightOptions, watcher: Watcher
) -> tuple[UploadReport, FlightResult]:
    vehicle = find_vehicle(connection, options.system_id, options.timeout_s)
    samples.system_id = vehicle.system_id
    watcher.found(vehicle)
    flight_modes(vehicle)  # refuses what cannot be started before anything is sent
    upload = upload_plan(
        plan,
        connection,
        vehicle,
        force=options.force,
        enable_fence=options.enable_fence,
        progress=watcher.progress,
    )
    _confirm(watcher, upload)
    with Flight(connection, vehicle, plan, samples, told=watcher.told, seen=watcher.seen) as flight:
        return upload, _watched(flight, options, watcher)


def _confirm(watcher: Watcher, upload: UploadReport) -> None:
    try:
        if watcher.confirm(upload):
            return
    except KeyboardInterrupt:
        raise StoppedError("interrupted before the start. The vehicle: it holds the new plan", NEW_PLAN) from None
    raise LeftBehindError("not started. The vehicle: it holds the new plan", NEW_PLAN)


def _watched(flight: Flight, options: FlightOptions, watcher: Watcher) -> FlightResult:
    """Start and follow a flight; a Ctrl-C in it asks what to do."""
    todo = Choice.WATCH
    while True:
        try:
            if todo is Choice.RETURN:
                todo = Choice.WATCH
                flight.return_home()
            elif not flight.under_way:
                flight.start(options.ready_timeout_s)
            return flight.watch(options.lost_timeout_s)
        except KeyboardInterrupt:
            todo = watcher.interrupted()
        if todo is Choice.LEAVE:
            raise StoppedError(
                "stopped watching. The vehicle flies on by itself; record it with 'sparsor record'",
                "flies on by itself",
            )
