"""From a mission folder or a .plan to the vehicle."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from sparsor.core.progress import silent
from sparsor.errors import InputError, LinkError, MissionError, StoppedError
from sparsor.journeys.folder import SPECIFICATION_FILE
from sparsor.link.connection import Connection
from sparsor.link.flights.briefing import brief
from sparsor.link.flights.flying import Flight
from sparsor.link.flights.modes import flight_modes
from sparsor.link.flights.samples import SampleCounter
from sparsor.link.missions.upload import UploadReport, upload_plan
from sparsor.link.ports.addresses import parse_address
from sparsor.link.vehicles import find_vehicle
from sparsor.mission import read_plan
from sparsor.mission.specification import read_specification
from sparsor.vehicle import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from sparsor.core.progress import Progress
    from sparsor.link.flights.briefing import Briefing
    from sparsor.link.flights.views import Event
    from sparsor.link.vehicles import FoundVehicle
    from sparsor.vehicle import Vehicle


def upload_mission(
    path: Path,
    url: str,
    *,
    sortie: int | None = None,
    system_id: int | None = None,
    dry_run: bool = False,
    force: bool = False,
    enable_fence: bool = False,
    start: Callable[[UploadReport, Briefing, SampleCounter], bool] | None = None,
    timeout_s: float = 10.0,
    ready_timeout_s: float = 120.0,
    progress: Progress = silent,
    found: Callable[[FoundVehicle], None] = lambda _: None,
    told: Callable[[Event], None] = lambda _: None,
) -> UploadReport:
    """Send a plan to a vehicle and verify that it holds it; perhaps start it.

    Parameters
    ----------
    path : Path
        A mission folder or a .plan, ours or QGroundControl's.
    url : str
        Address of the link.
    sortie : int or None
        Which plan of a folder that holds several.
    system_id : int or None
        Which vehicle, where there are several.
    dry_run, force, enable_fence : bool
        As `upload_plan`; `force` also starts what `brief` would refuse.
    start : callable or None
        Asked after the upload whether to arm and start; None: no. Gets the report, the briefing and the samples heard.
    timeout_s, ready_timeout_s : float
        How long to wait for the vehicle, and for its being ready to fly.
    progress : Progress
    found : callable
        Told which vehicle was found, before anything is sent.
    told : callable
        Gets what happens while the mission is started.

    Raises
    ------
    InputError
        When the plan, the address or the vehicle is not one that this can be done with; nothing was sent.
    LinkFailureError
        When the vehicle is silent, the transfer fails or the mission does not start. StoppedError after a Ctrl-C.
    """
    if start is not None and dry_run:
        raise LinkError("a dry run sends nothing, so nothing can be started: leave out --start or --dry-run")
    chosen = choose_plan(path, sortie)
    plan = read_plan(chosen)
    with Connection(parse_address(url), timeout_s=timeout_s) as connection:
        samples = SampleCounter()
        connection.listen(samples)
        vehicle = find_vehicle(connection, system_id, timeout_s)
        samples.system_id = vehicle.system_id
        found(vehicle)
        if start is not None:  # what cannot or must not be started is refused before anything is sent
            flight_modes(vehicle)
            briefing = brief(plan, connection, vehicle, profile=profile_of(chosen), force=force)
        report = upload_plan(
            plan, connection, vehicle, dry_run=dry_run, force=force, enable_fence=enable_fence, progress=progress
        )
        if start is None:
            return report
        try:
            if not start(report, briefing, samples):
                return replace(report, started=False)
            with Flight(connection, vehicle, plan, samples, told=told) as flight:
                flight.start(ready_timeout_s)
        except KeyboardInterrupt:
            raise StoppedError(
                "interrupted. The vehicle: it holds the new plan, and flies it if it has taken off",
                "new plan, perhaps under way",
            ) from None
        return replace(report, started=True)


def profile_of(plan: Path) -> Vehicle | None:
    """Return the vehicle that a plan of a mission folder was made for; None for anybody's plan."""
    try:
        spec = read_specification(plan.with_name(SPECIFICATION_FILE))
        return load_vehicle(spec.flight.vehicle) if plan.stem.startswith(spec.name) else None
    except InputError:
        return None


def choose_plan(path: Path, sortie: int | None = None) -> Path:
    """Return the .plan that is meant by a folder or a file.

    Raises
    ------
    MissionError
        When there is none, or several and none was chosen.
    """
    if not path.exists():
        raise MissionError(f"there is no '{path}'; give a mission folder or a .plan")
    if not path.is_dir():
        if path.suffix in (".npz", ".toml", ".waypoints", ".kml"):
            raise MissionError(f"'{path}' is not a plan; give the mission folder '{path.parent}' or the .plan in it")
        return path
    plans = sorted(path.glob("*.plan"))
    if not plans:
        raise MissionError(f"'{path}' is a folder without a .plan; make one with 'sparsor plan'")
    if sortie is None:
        if len(plans) > 1:
            names = ", ".join(plan.name for plan in plans)
            raise MissionError(f"'{path}' holds {len(plans)} plans: {names}. Choose one with --sortie N")
        return plans[0]
    chosen = [plan for plan in plans if re.search(rf"-0*{sortie}$", plan.stem)]
    if len(chosen) != 1:
        names = ", ".join(plan.name for plan in plans)
        raise MissionError(f"'{path}' has no sortie {sortie}; it holds {names}")
    return chosen[0]
