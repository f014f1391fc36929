"""What is wrong with a plan, ours or anybody's, as far as the plan alone shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.mission.fault import Fault
from sparsor.mission.fencefaults import fence_faults
from sparsor.mission.items import (
    ARDUPILOT_ONLY,
    DO_CHANGE_SPEED,
    DO_LAND_START,
    FLOWN_TO,
    FRAME_MISSION,
    FRAME_RELATIVE,
    FRAME_TERRAIN,
    LANDINGS,
    NAV_LAND,
    NAV_RETURN_TO_LAUNCH,
    POSITION_OPTIONAL,
    TAKE_OFFS,
    WAYPOINTS,
)
from sparsor.mission.plan import STAYS_DOWN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sparsor.mission.plan import MissionPlan

FLIES = frozenset({1, 2, 3, 4, 13, 14, 15, *range(19, 26)})  # MAV_TYPE of what takes off
PLANE = 1
COMMON_CEILING_M = 120.0


def plan_faults(plan: MissionPlan) -> tuple[str, ...]:
    """Return a sentence for each fault noticed; none means that none was noticed, not that there is none."""
    return tuple(fault.sentence for fault in judged_faults(plan))


def judged_faults(plan: MissionPlan, *, over_terrain: bool = False) -> tuple[Fault, ...]:
    """Return each fault noticed; of a plan whose heights are checked against the ground none of those above home."""
    heights = () if over_terrain else _heights(plan)
    return (*_order(plan), *_positions(plan), *heights, *_limits(plan), *_frames(plan), *fence_faults(plan))


def _order(plan: MissionPlan) -> Iterator[Fault]:
    flown = [item for item in plan.items if item.command in FLOWN_TO]
    if not flown:
        yield Fault("There is no item with a position: nothing is flown.", serious=True)
        return
    flies = plan.vehicle_type in FLIES
    if flies and flown[0].command not in TAKE_OFFS:
        yield Fault(
            "The first item with a position is not a take-off: a vehicle on the ground will not fly this.", wrong=True
        )
    late = [place for place, item in enumerate(flown[1:], start=2) if item.command in TAKE_OFFS]
    if late and not any(item.command in LANDINGS for item in flown[: late[0] - 1]):
        yield Fault("A take-off comes after other items with a position, without a landing before it.", wrong=True)
    if plan.vehicle_type in STAYS_DOWN and any(item.command in TAKE_OFFS | LANDINGS for item in flown):
        yield Fault("The plan takes off or lands, which a rover or a boat does not.", wrong=True)
    last = plan.items[-1].command
    if last == NAV_RETURN_TO_LAUNCH:
        yield Fault(
            "The plan ends with a return to launch: a straight line home from the last waypoint, through "
            "whatever is there."
        )
    elif flies and not any(item.command in LANDINGS | {NAV_RETURN_TO_LAUNCH} for item in plan.items):
        yield Fault("The plan neither lands nor returns.", wrong=True)
    elif flies and flown[-1].command not in LANDINGS:
        yield Fault("The plan goes on after its landing.")
    if plan.vehicle_type == PLANE:
        yield from _of_a_plane(plan)


def _of_a_plane(plan: MissionPlan) -> Iterator[Fault]:
    if any(item.command in WAYPOINTS and item.hold_s > 0 for item in plan.items):
        yield Fault("Waypoints hold, which a plane does not: it flies through them.")
    if any(item.command == NAV_LAND for item in plan.items) and not any(
        item.command == DO_LAND_START for item in plan.items
    ):
        yield Fault("The landing has no DO_LAND_START before it: a failsafe will not use it.")


def _positions(plan: MissionPlan) -> Iterator[Fault]:
    for place, item in enumerate(plan.items, start=1):
        if item.command not in FLOWN_TO:
            continue
        if not item.has_position:
            px4 = plan.autopilot is not None and plan.autopilot.name == "px4"  # ArduPilot reads 0/0 as "here"
            yield Fault(f"Item {place} (command {item.command}) has no position: readers write 0/0 for it.", px4)
        elif item.lat_deg == 0 and item.lon_deg == 0:
            yield Fault(
                f"Item {place} (command {item.command}) lies at 0/0, which ArduPilot reads as 'here'.",
                serious=item.command not in POSITION_OPTIONAL,
            )


def _heights(plan: MissionPlan) -> Iterator[Fault]:
    for place, item in enumerate(plan.items, start=1):
        flies = plan.vehicle_type not in STAYS_DOWN
        if flies and item.command in WAYPOINTS and item.frame == FRAME_RELATIVE and item.altitude_m <= 0:
            yield Fault(f"Item {place} is a waypoint {item.altitude_m:g} m above home.")
    heights = [item.altitude_m for item in plan.items if item.command in WAYPOINTS and item.frame == FRAME_RELATIVE]
    if heights and max(heights) > COMMON_CEILING_M:
        yield Fault(
            f"The highest waypoint is {max(heights):g} m above home; {COMMON_CEILING_M:g} m is a common ceiling."
        )


def _limits(plan: MissionPlan) -> Iterator[Fault]:
    facts = plan.autopilot
    if facts is None:
        return
    counts = (
        ("mission items", len(plan.items) + int(facts.home_is_item_0), facts.max_items),
        ("fence points", sum(len(fence.lon_deg) for fence in plan.fences) + len(plan.circles), facts.max_fence_points),
        ("rally points", len(plan.rally_points), facts.max_rally_points),
    )
    for what, count, most in counts:
        if count > most:
            yield Fault(f"{count} {what} are more than the {most} that {facts.title} stores.", serious=True)
    fractions = sum(item.command in WAYPOINTS and item.hold_s % 1 != 0 for item in plan.items)
    if facts.whole_second_holds and fractions:
        yield Fault(f"{fractions} waypoints hold for a fraction of a second, which {facts.title} drops.")


def _frames(plan: MissionPlan) -> Iterator[Fault]:
    if plan.autopilot is None or plan.autopilot.name != "px4":
        return
    for place, item in enumerate(plan.items, start=1):
        without_position = item.command in (NAV_RETURN_TO_LAUNCH, DO_CHANGE_SPEED)
        if without_position and item.frame != FRAME_MISSION:
            yield Fault(
                f"Item {place} (command {item.command}) is in frame {item.frame}; PX4 takes only frame 2.", True
            )
        elif item.command in ARDUPILOT_ONLY:
            yield Fault(f"Item {place} (command {item.command}) is one that PX4 refuses in a mission.", True)
        elif item.frame == FRAME_TERRAIN:
            yield Fault(f"Item {place} (command {item.command}) is above terrain (frame 10), which PX4 refuses.", True)
