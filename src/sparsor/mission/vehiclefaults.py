"""What is wrong between a plan and the vehicle that is to fly it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.errors import VehicleError
from sparsor.mission.fault import Fault
from sparsor.mission.faults import judged_faults
from sparsor.mission.items import DO_CHANGE_SPEED, FLOWN_TO, FRAME_RELATIVE
from sparsor.mission.timing import time_plan
from sparsor.vehicle import CALM, SteadyWind, Vehicle, check_wind, usable_seconds

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sparsor.mission.plan import MissionPlan

# MAV_TYPE that fly alike; 0 is a plan that does not say.
ALIKE = (frozenset({2, 3, 4, 13, 14, 15}), frozenset({1}), frozenset(range(19, 26)), frozenset({10}), frozenset({11}))
DO_JUMP = 177
ROUNDING_S = 1.0  # positions are rounded to a centimetre, holds to what the autopilot stores


def check_faults(
    plan: MissionPlan, vehicle: Vehicle, wind: SteadyWind = CALM, *, study: bool = False, over_terrain: bool = False
) -> tuple[Fault, ...]:
    """Return all that is noticed about a plan: by itself, and on the vehicle that is to fly it.

    Parameters
    ----------
    plan : MissionPlan
    vehicle : Vehicle
    wind : SteadyWind
    study : bool
        Whether it is known to be a planning study: what says that it cannot be flown by endurance is then a warning.
    over_terrain : bool
        Whether its heights are checked against the ground, so that those above home say nothing.
    """
    return (
        *judged_faults(plan, over_terrain=over_terrain),
        *vehicle_faults(plan, vehicle, wind, study=study, over_terrain=over_terrain),
    )


def vehicle_faults(
    plan: MissionPlan, vehicle: Vehicle, wind: SteadyWind = CALM, *, study: bool = False, over_terrain: bool = False
) -> tuple[Fault, ...]:
    """Return what is noticed about a plan on a vehicle; parameters as `check_faults`."""
    return (
        *_kind(plan, vehicle),
        *(() if over_terrain else _heights(plan, vehicle)),
        *_counts(plan, vehicle),
        *_time(plan, vehicle, wind, study),
    )


def _kind(plan: MissionPlan, vehicle: Vehicle) -> Iterator[Fault]:
    alike = next((kinds for kinds in ALIKE if vehicle.mav_type in kinds), frozenset())
    if plan.vehicle_type and plan.vehicle_type not in alike:
        yield Fault(
            f"The plan is for another kind of vehicle (MAV_TYPE {plan.vehicle_type}) than the {vehicle.kind} "
            f"'{vehicle.name}' ({vehicle.mav_type}).",
            wrong=True,
        )


def _heights(plan: MissionPlan, vehicle: Vehicle) -> Iterator[Fault]:
    heights = [item.altitude_m for item in plan.items if item.command in FLOWN_TO and item.frame == FRAME_RELATIVE]
    highest_m = max(heights, default=0.0)
    if vehicle.flies and highest_m > vehicle.ceiling_m:
        yield Fault(
            f"The flight goes up to {highest_m:g} m above home, beyond the ceiling of {vehicle.ceiling_m:g} m in the "
            "vehicle profile."
        )


def _counts(plan: MissionPlan, vehicle: Vehicle) -> Iterator[Fault]:
    home = int(plan.autopilot is not None and plan.autopilot.home_is_item_0)
    counts = (
        ("mission items", len(plan.items) + home, vehicle.max_items),
        (
            "fence points",
            sum(len(fence.lon_deg) for fence in plan.fences) + len(plan.circles),
            vehicle.max_fence_points,
        ),
        ("rally points", len(plan.rally_points), vehicle.max_rally_points),
    )
    for what, count, most in counts:
        if most is not None and count > most:
            yield Fault(
                f"{count} {what} are more than the {most} that the profile of the {vehicle.name} has.", wrong=True
            )


def _time(plan: MissionPlan, vehicle: Vehicle, wind: SteadyWind, study: bool) -> Iterator[Fault]:
    asked = [item.params[1] for item in plan.items if item.command == DO_CHANGE_SPEED and item.params[1] > 0]
    try:
        check_wind(vehicle, wind, min(asked, default=vehicle.cruise_m_s))
    except VehicleError as error:
        sentence = str(error)
        yield Fault(sentence[0].upper() + sentence[1:] + ".", wrong=True)
        return
    if any(item.command == DO_JUMP for item in plan.items):
        yield Fault("The plan jumps (DO_JUMP): its time in the air is not known.")
        return
    used_s, usable_s = time_plan(plan, vehicle, wind).used_s, usable_seconds(vehicle)
    if used_s > usable_s + ROUNDING_S:
        yield Fault(
            f"The flight takes {used_s / 60:.0f} min of the endurance of the {vehicle.name}, which has "
            f"{usable_s / 60:.0f} min less its reserve.",
            wrong=not study,
        )
