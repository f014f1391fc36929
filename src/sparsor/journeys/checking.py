"""The checks of plans before anybody flies them: ours or anybody's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.errors import InputError, MissionError
from sparsor.journeys.flown import is_edited, plan_changes, sidecar_of
from sparsor.journeys.folder import SPECIFICATION_FILE
from sparsor.journeys.uploading import choose_plan, profile_of
from sparsor.mission import Fault, check_faults, judged_faults, read_plan
from sparsor.mission.apart import TOLERANCE_M
from sparsor.mission.separation import nearest
from sparsor.mission.specification import read_specification
from sparsor.vehicle import CALM, SteadyWind, load_vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from sparsor.mission import MissionPlan


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
        Of the plans of vehicles at once: their planned paths are never nearer, whenever each starts.
    """

    plans: tuple[Path, ...]
    faults: tuple[str, ...]
    warnings: tuple[str, ...]
    apart_m: float | None = None


def check_plans(path: Path, vehicle: str | None = None) -> Check:
    """Check a plan, or all plans of a mission folder.

    Parameters
    ----------
    path : Path
        A folder with plans, or a .plan, ours or QGroundControl's.
    vehicle : str, optional
        Name or file of the profile to check against; default: the one that a mission folder's plan was made for.
        Without either, nothing is known of endurance and of the vehicle's own limits.

    Raises
    ------
    InputError
        When there is no plan, or one of them or the profile cannot be read.
    """
    plans = tuple(sorted(path.glob("*.plan"))) if path.is_dir() else (choose_plan(path),)
    if not plans:
        raise MissionError(f"'{path}' is a folder without a .plan; give one with plans, or a .plan")
    found = [
        (f"{one.name}: {fault.sentence}" if len(plans) > 1 else fault.sentence, fault.fails)
        for one in plans
        for fault in _faults(one, vehicle)
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
    found = nearest([read_plan(one) for one in own], profile)
    apart_m, least_m = found.distance_m, spec.flight.separation_m
    if apart_m >= least_m - TOLERANCE_M:
        return apart_m, ()
    return apart_m, (
        f"{own[found.first].name} and {own[found.second].name} may come as near as {apart_m:.1f} m to each other when "
        f"they are flown at once; the mission asks for {least_m:g} m.",
    )


def _faults(path: Path, vehicle: str | None) -> list[Fault]:
    plan = read_plan(path)
    profile = profile_of(path) if vehicle is None else load_vehicle(vehicle)
    edited, changes = _edited(path, plan)
    # What says that a planning study is none to fly was said when it was made; an edited one may be meant to fly.
    study = edited is False and vehicle is None
    if profile is None:
        said = "Nothing is known of the vehicle: endurance is not checked; give --vehicle."
        found = [*judged_faults(plan), Fault(said)]
    else:
        found = list(check_faults(plan, profile, _wind(path), study=study))
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


def _wind(path: Path) -> SteadyWind:
    """Return the wind that a mission folder's plan was made for."""
    try:
        spec = read_specification(path.with_name(SPECIFICATION_FILE))
    except InputError:
        return CALM
    return spec.flight.steady_wind if path.stem.startswith(spec.name) else CALM
