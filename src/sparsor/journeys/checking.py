"""The checks of plans before anybody flies them: ours or anybody's."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from sparsor.errors import InputError, MissionError, TerrainError
from sparsor.journeys.flown import is_edited, plan_changes, sidecar_of
from sparsor.journeys.folder import SPECIFICATION_FILE
from sparsor.journeys.groundwork import HOME_DIFFERS_M, faults_over, terrain_under
from sparsor.journeys.uploading import choose_plan, profile_of
from sparsor.mission import Fault, check_faults, judged_faults, read_plan
from sparsor.mission.apart import TOLERANCE_M
from sparsor.mission.clearance import highest_way_home_m
from sparsor.mission.following import ground_at_home_m, usual_tolerance_m
from sparsor.mission.items import NAV_RETURN_TO_LAUNCH
from sparsor.mission.separation import nearest
from sparsor.mission.specification import read_specification
from sparsor.vehicle import CALM, load_vehicle

if TYPE_CHECKING:
    from sparsor.mission import MissionPlan
    from sparsor.mission.specification import MissionSpecification
    from sparsor.vehicle import Vehicle

CLEARANCE_M = 10.0
MOST_CLEARANCE_M = 20_000.0


@dataclass(frozen=True)
class Check:
    """What checking plans found.

    Parameters
    ----------
    plans : tuple of Path
        What was checked.
    faults, warnings : tuple of str
        Sentences: what a plan fails by, and what has to be known. No fault means that none was noticed; it says
        nothing of rules, obstacles or terrain.
    apart_m : float or None
        Of the plans of vehicles at once: in no round are their planned paths nearer, whenever each starts.
    """

    plans: tuple[Path, ...]
    faults: tuple[str, ...]
    warnings: tuple[str, ...]
    apart_m: float | None = None


def check_plans(
    path: Path, vehicle: str | None = None, *, terrain: Path | None = None, clearance_m: float | None = None
) -> Check:
    """Check a plan, or all plans of a mission folder.

    Parameters
    ----------
    path : Path
        A folder with plans, or a .plan, ours or QGroundControl's.
    vehicle : str, optional
        Name or file of the profile to check against; default: the one that a mission folder's plan was made for.
        Without either, nothing is known of endurance and of the vehicle's own limits.
    terrain : Path, optional
        Elevation model to check the legs against; default: the one that a mission folder's plan was made for.
    clearance_m : float, optional
        Least height above it; default: what the mission was planned with, else `CLEARANCE_M`.

    Raises
    ------
    InputError
        When there is no plan, or one of them, the profile or the elevation model cannot be read.
    """
    if clearance_m is not None and not 0 <= clearance_m <= MOST_CLEARANCE_M:
        raise MissionError(f"a clearance of {clearance_m:g} m; allowed are 0..{MOST_CLEARANCE_M:g}")
    plans = tuple(sorted(path.glob("*.plan"))) if path.is_dir() else (choose_plan(path),)
    if not plans:
        raise MissionError(f"'{path}' is a folder without a .plan; give one with plans, or a .plan")
    found = [
        (f"{one.name}: {fault.sentence}" if len(plans) > 1 else fault.sentence, fault.fails)
        for one in plans
        for fault in _faults(one, vehicle, terrain, clearance_m)
    ]
    apart_m, too_near = _apart(path, plans, vehicle) if path.is_dir() else (None, ())
    return Check(
        plans,
        (*(sentence for sentence, fails in found if fails), *too_near),
        tuple(sentence for sentence, fails in found if not fails),
        apart_m,
    )


def _apart(folder: Path, plans: tuple[Path, ...], vehicle: str | None) -> tuple[float | None, tuple[str, ...]]:
    """Return the least distance between the vehicles of a mission for several at once, and what is wrong with it."""
    try:
        spec = read_specification(folder / SPECIFICATION_FILE)
    except InputError:
        return None, ()
    own = [one for one in plans if one.stem.startswith(spec.name)]
    profile = (profile_of(own[0]) if vehicle is None else load_vehicle(vehicle)) if own else None
    if spec.flight.vehicles == 1 or len(own) < 2 or profile is None:
        return None, ()
    sidecar = sidecar_of(own[0])
    round_of = {} if sidecar is None else sidecar.rounds
    found = nearest([read_plan(one) for one in own], profile, [round_of.get(one.name, 1) for one in own])
    if found.distance_m == math.inf:
        return None, ()
    least_m, first, second = spec.flight.separation_m, own[found.first].name, own[found.second].name
    if found.distance_m >= least_m - TOLERANCE_M:
        return found.distance_m, ()
    whom = f"the vehicle of {second}, which stands at its home," if found.parked else second
    return found.distance_m, (
        f"{first} may come as near as {found.distance_m:.1f} m to {whom} when they are flown at once; the mission asks "
        f"for {least_m:g} m.",
    )


def _faults(path: Path, vehicle: str | None, terrain: Path | None, clearance_m: float | None) -> list[Fault]:
    plan = read_plan(path)
    profile = profile_of(path) if vehicle is None else load_vehicle(vehicle)
    edited, changes = _edited(path, plan)
    # What says that a planning study is none to fly was said when it was made; an edited one may be meant to fly.
    study = edited is False and vehicle is None
    spec = _specification(path)
    over = _over_terrain(plan, profile, spec, terrain, clearance_m)
    if profile is None:
        said = "Nothing is known of the vehicle: endurance is not checked; give --vehicle."
        found = [*judged_faults(plan, over_terrain=over is not None), Fault(said)]
    else:
        wind = CALM if spec is None else spec.flight.steady_wind
        found = list(check_faults(plan, profile, wind, study=study, over_terrain=over is not None))
    found += over or []
    found += [
        Fault(f"The pattern '{one.kind}' has no items in the file: only QGroundControl can work them out.", wrong=True)
        for one in plan.complex_items
        if not one.items
    ]
    found += [Fault(warning) for warning in plan.warnings]
    return found + [Fault(f"Edited since sparsor wrote it: {change}.") for change in changes]


def _edited(path: Path, plan: MissionPlan) -> tuple[bool | None, tuple[str, ...]]:
    """Return whether a plan was edited since it was written (None: not known), and how."""
    sidecar = sidecar_of(path)
    if sidecar is None:
        return None, ()
    edited = is_edited(path, sidecar)
    return edited, plan_changes(plan, sidecar) if edited else ()


def _specification(path: Path) -> MissionSpecification | None:
    """Return what a mission folder's plan was made from; None of anybody's plan."""
    try:
        spec = read_specification(path.with_name(SPECIFICATION_FILE))
    except InputError:
        return None
    return spec if path.stem.startswith(spec.name) else None


def _over_terrain(
    plan: MissionPlan,
    profile: Vehicle | None,
    spec: MissionSpecification | None,
    file: Path | None,
    clearance_m: float | None,
) -> list[Fault] | None:
    """Return what is wrong between a plan and the ground; None where no elevation model is known of."""
    planned = None if spec is None else spec.flight.terrain
    if file is None and planned is None:
        if clearance_m is not None:
            raise MissionError("--clearance is of a terrain: give --terrain DEM.tif")
        return None
    least_m = clearance_m
    if least_m is None and spec is not None and planned is not None:
        flight = spec.flight
        least_m = flight.altitude_m - (flight.terrain_tolerance_m or usual_tolerance_m(flight.altitude_m))
    if least_m is None:
        least_m = CLEARANCE_M
    try:
        terrain = terrain_under(file or planned or Path(), plan, profile)
        home = plan.home.place
        home_m = ground_at_home_m(terrain, home)
    except TerrainError as error:
        if file is not None:
            raise
        return [Fault(f"The legs are not checked against the ground: {error}.", wrong=True)]
    found = list(faults_over(plan, terrain, least_m, profile, home_m))
    home_amsl_m = plan.home.alt_amsl_m
    if plan.home.altitude_known and abs(home_amsl_m - home_m) > HOME_DIFFERS_M:
        found.append(
            Fault(
                f"Home is {home_amsl_m:g} m above sea level in the plan, and {home_m:.0f} m high in "
                f"'{terrain.path.name}'."
            )
        )
    if any(item.command == NAV_RETURN_TO_LAUNCH for item in plan.items):
        way_home_m = highest_way_home_m(plan.items, home, terrain, home_m)
        found.append(
            Fault(
                f"The way of its return to launch is not checked: the height is the vehicle's own. The ground rises to "
                f"{max(way_home_m, 0.0):.0f} m above home on the straight ways there."
            )
        )
    return found
