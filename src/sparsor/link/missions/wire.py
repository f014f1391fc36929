"""A plan as the items that go over the link: home, mission, fence and rally points as MISSION_ITEM_INT.

The layout is that of QGroundControl and of MAVSDK's importer (measured in docs/mission-items.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sparsor.mission.items import FLOWN_TO, FRAME_GLOBAL, FRAME_MISSION, FRAME_RELATIVE, NAV_TAKEOFF, NAV_WAYPOINT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.mission import MissionItem, MissionPlan
    from sparsor.vehicle import Autopilot

# MAV_MISSION_TYPE.
MISSION: Final = 0
FENCE: Final = 1
RALLY: Final = 2
KINDS: Final = {MISSION: "mission", FENCE: "fence", RALLY: "rally points"}
# MAV_CMD_NAV_FENCE_* and MAV_CMD_NAV_RALLY_POINT; parameter 1 is the number of corners or the radius, metres.
POLYGON_INCLUSION: Final = 5001
POLYGON_EXCLUSION: Final = 5002
CIRCLE_INCLUSION: Final = 5003
CIRCLE_EXCLUSION: Final = 5004
RALLY_POINT: Final = 5100
TAKES_NO_HEADING: Final = frozenset({NAV_WAYPOINT, NAV_TAKEOFF})


@dataclass(frozen=True)
class WireItem:
    """One MISSION_ITEM_INT.

    Parameters
    ----------
    command, frame : int
        MAV_CMD and MAV_FRAME.
    params : tuple of float (4,)
        Parameters 1 to 4.
    x, y : int
        Latitude and longitude in 1e-7 degrees; parameters 5 and 6 as they are in frame 2.
    z : float
        Altitude, metres; or parameter 7.
    autocontinue : bool
    """

    command: int
    frame: int
    params: tuple[float, float, float, float]
    x: int
    y: int
    z: float
    autocontinue: bool = True

    @property
    def flown_to(self) -> bool:
        """Whether it has a position that the vehicle flies to."""
        return self.command in FLOWN_TO


def wire_items(plan: MissionPlan, autopilot: Autopilot) -> dict[int, tuple[WireItem, ...]]:
    """Return MAV_MISSION_TYPE to the items of a plan, in order; home first where the autopilot keeps it there."""
    mission = [_mission_item(item, autopilot) for item in plan.items]
    if autopilot.home_is_item_0:
        home = plan.home
        x, y = _e7(home.lat_deg), _e7(home.lon_deg)
        mission.insert(0, WireItem(NAV_WAYPOINT, FRAME_GLOBAL, (0.0, 0.0, 0.0, 0.0), x, y, home.alt_amsl_m))
    return {MISSION: tuple(mission), FENCE: _fence_items(plan), RALLY: _rally_items(plan)}


def _mission_item(item: MissionItem, autopilot: Autopilot) -> WireItem:
    given = item.params
    # ArduPilot refuses NaN but in a heading; PX4 reads it as "not given".
    keeps = {0, 1, 2, 3} if autopilot.name == "px4" else {3} if item.command in TAKES_NO_HEADING else set()
    params = [0.0 if math.isnan(value) and place not in keeps else value for place, value in enumerate(given[:4])]
    to_whole = round if item.frame == FRAME_MISSION else _e7
    x, y = (0 if math.isnan(value) else to_whole(value) for value in given[4:6])
    z = 0.0 if math.isnan(given[6]) else given[6]
    return WireItem(item.command, item.frame, (params[0], params[1], params[2], params[3]), x, y, z, item.autocontinue)


def _fence_items(plan: MissionPlan) -> tuple[WireItem, ...]:
    found: list[WireItem] = []
    for fence in plan.fences:
        command = POLYGON_INCLUSION if fence.inclusion else POLYGON_EXCLUSION
        corners = zip(fence.lon_deg, fence.lat_deg, strict=True)
        found += [_point(command, len(fence.lon_deg), lon, lat) for lon, lat in corners]
    for circle in plan.circles:
        command = CIRCLE_INCLUSION if circle.inclusion else CIRCLE_EXCLUSION
        found.append(_point(command, circle.radius_m, circle.lon_deg, circle.lat_deg))
    return tuple(found)


def _rally_items(plan: MissionPlan) -> tuple[WireItem, ...]:
    return tuple(
        WireItem(RALLY_POINT, FRAME_RELATIVE, (0.0,) * 4, _e7(point.lat_deg), _e7(point.lon_deg), point.altitude_m)
        for point in plan.rally_points
    )


def _point(command: int, first: float, lon_deg: float, lat_deg: float) -> WireItem:
    return WireItem(command, FRAME_GLOBAL, (float(first), 0.0, 0.0, 0.0), _e7(lat_deg), _e7(lon_deg), 0.0)


def _e7(degrees: float) -> int:
    return round(degrees * 1e7)


def counts(items: dict[int, tuple[WireItem, ...]]) -> Sequence[int]:
    """Return how many items of each kind there are: mission (with home), fence, rally points."""
    return [len(items[kind]) for kind in KINDS]
