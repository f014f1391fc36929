"""From a mission folder or a .plan to a recorded flight."""

from __future__ import annotations

import time
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from sparsor.errors import InputError, LeftBehindError, StoppedError
from sparsor.journeys.uploading import choose_plan, profile_of
from sparsor.link.connection import Connection
from sparsor.link.flights.briefing import brief
from sparsor.link.flights.flying import FLIES_ON, Flight, FlightResult
from sparsor.link.flights.modes import flight_modes
from sparsor.link.flights.samples import SampleCounter
from sparsor.link.flights.views import Event
from sparsor.link.missions.upload import NEW_PLAN, UploadReport, upload_plan
from sparsor.link.ports.addresses import parse_address
from sparsor.link.tlog import TlogWriter
from sparsor.link.vehicles import find_vehicle
from sparsor.mission import read_plan

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from sparsor.link.flights.briefing import Briefing
    from sparsor.link.flights.views import View
    from sparsor.link.ports.addresses import Address
    from sparsor.link.vehicles import FoundVehicle
    from sparsor.mission import MissionPlan
    from sparsor.vehicle import Vehicle


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

    def confirm(self, report: UploadReport, briefing: Briefing, samples: SampleCounter) -> bool:
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
        Fly an armed vehicle too, and what `brief` would refuse; replace a recording that is there.
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
    plan : Path
        The .plan that was flown.
    upload : UploadReport
    result : FlightResult
    tlog : Path
    messages : int
        Frames in the .tlog.
    samples : dict of str to int
        Named values in it, by name.
    """

    plan: Path
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
    with _recorded(address, output or default_tlog(chosen), options) as (connection, tlog):
        connection.listen(samples)
        vehicle, upload = _uploaded(plan, profile_of(chosen), connection, samples, options, watcher)
        watcher.told(Event(f"recording to {tlog.path}"))
        with Flight(connection, vehicle, plan, samples, told=watcher.told, seen=watcher.seen) as flight:
            result = _watched(flight, options, watcher)
    return FlightReport(chosen, upload, result, tlog.path, tlog.frames, dict(samples.counts))


def default_tlog(plan: Path) -> Path:
    """Return where a flight of a plan is recorded: beside it, by its name and the local time."""
    return plan.with_name(f"{plan.stem}-{time.strftime('%Y%m%d-%H%M%S')}.tlog")


@contextmanager
def _recorded(address: Address, path: Path, options: FlightOptions) -> Iterator[tuple[Connection, TlogWriter]]:
    """Yield a link and its recording; that is discarded where the flight is refused or nobody is heard."""
    tlog = TlogWriter(path, replace=options.force)
    worth_keeping = False
    try:
        with Connection(address, recording=tlog, timeout_s=options.timeout_s) as connection:
            refused = False
            try:
                yield connection, tlog
            except InputError:
                refused = True
                raise
            except LeftBehindError as error:
                raise _with_recording(error, path, address.url) from error
            finally:
                worth_keeping = connection.frames_received > 0 and not refused
    finally:
        if worth_keeping:
            tlog.close()
        else:
            tlog.discard()


def _with_recording(error: LeftBehindError, path: Path, url: str) -> LeftBehindError:
    """Return an error that also says where the recording is, and how to record what the vehicle does from now on."""
    words = f"{error}. The recording until then: {path}"
    if error.vehicle_state == FLIES_ON:
        words += f"; to record on: sparsor record --connect {url} -o {path.with_name(f'{path.stem}-2.tlog')}"
    return type(error)(words, error.vehicle_state, str(path))


def _uploaded(
    plan: MissionPlan,
    profile: Vehicle | None,
    connection: Connection,
    samples: SampleCounter,
    options: FlightOptions,
    watcher: Watcher,
) -> tuple[FoundVehicle, UploadReport]:
    """Find the vehicle, send it the plan and have the start confirmed."""
    vehicle = find_vehicle(connection, options.system_id, options.timeout_s)
    samples.system_id = vehicle.system_id
    watcher.found(vehicle)
    # What cannot or must not be started is refused before anything is sent.
    flight_modes(vehicle)
    briefing = brief(plan, connection, vehicle, profile=profile, force=options.force)
    upload = upload_plan(
        plan,
        connection,
        vehicle,
        force=options.force,
        enable_fence=options.enable_fence,
        progress=watcher.progress,
    )
    _confirm(watcher, upload, briefing, samples)
    return vehicle, upload


def _confirm(watcher: Watcher, upload: UploadReport, briefing: Briefing, samples: SampleCounter) -> None:
    try:
        if watcher.confirm(upload, briefing, samples):
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
            raise StoppedError("stopped watching. The vehicle: flies on by itself", FLIES_ON)
