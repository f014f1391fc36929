"""What a plan holds: items, home, fences, rally points. One type for plans that we make and that we read."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from sparsor.errors import MissionError
from sparsor.mission.items import FLOWN_TO, LANDINGS, NAV_LOITER_TIME, WAYPOINTS
from sparsor.vehicle import AUTOPILOTS

if TYPE_CHECKING:
    from sparsor.mission.items import MissionItem
    from sparsor.vehicle import Autopilot

STAYS_DOWN = frozenset({10, 11})  # MAV_TYPE of rovers and boats
# MAV_AUTOPILOT to how people write it; other firmware is named by its number.
TITLES = {facts.firmware_type: facts.title for facts in AUTOPILOTS.values()}


@dataclass(frozen=True)
class Home:
    """Where the vehicle takes off and lands.

    Parameters
    ----------
    lon_deg, lat_deg : float
        Degrees; -180..180 and -90..90.
    alt_amsl_m : float
        Above mean sea level, metres; written as 0 when it is not known.
    altitude_known : bool
        Whether `alt_amsl_m` is one. A .plan cannot say: a height of 0 reads as unknown.

    Raises
    ------
    MissionError
        When a value is not a number or not on Earth.
    """

    lon_deg: float
    lat_deg: float
    alt_amsl_m: float = 0.0
    altitude_known: bool = False

    def __post_init__(self) -> None:
        _check_point("home", self.lon_deg, self.lat_deg)
        if not -1000 <= self.alt_amsl_m <= 10_000:
            raise MissionError(f"home lies {self.alt_amsl_m:g} m above sea level; allowed are -1000..10000 m")

    @property
    def place(self) -> tuple[float, float]:
        """Longitude and latitude, degrees."""
        return self.lon_deg, self.lat_deg


@dataclass(frozen=True)
class Fence:
    """A polygon that the vehicle stays inside of (or, for an exclusion, outside of).

    Parameters
    ----------
    lon_deg, lat_deg : tuple of float (n,)
        Corners in order, not repeated at the end; at least three.
    inclusion : bool
        True: stay inside.
    """

    lon_deg: tuple[float, ...]
    lat_deg: tuple[float, ...]
    inclusion: bool = True

    def __post_init__(self) -> None:
        if len(self.lon_deg) != len(self.lat_deg):
            raise MissionError(f"a fence has {len(self.lon_deg)} longitudes and {len(self.lat_deg)} latitudes")
        if len(self.lon_deg) < 3:
            raise MissionError(f"a fence polygon has {len(self.lon_deg)} corners; it needs 3 at least")
        for lon, lat in zip(self.lon_deg, self.lat_deg, strict=True):
            _check_point("a fence corner", lon, lat)


@dataclass(frozen=True)
class Circle:
    """A circular fence, as QGroundControl draws them; ours are keep-outs."""

    lon_deg: float
    lat_deg: float
    radius_m: float
    inclusion: bool

    def __post_init__(self) -> None:
        _check_point("the centre of a fence circle", self.lon_deg, self.lat_deg)
        if not 0 < self.radius_m < 1e7:
            raise MissionError(f"a fence circle has a radius of {self.radius_m:g} m; it has to be above 0")


@dataclass(frozen=True)
class RallyPoint:
    """Where the vehicle may go instead of home; altitude above home, metres."""

    lon_deg: float
    lat_deg: float
    altitude_m: float

    def __post_init__(self) -> None:
        _check_point("a rally point", self.lon_deg, self.lat_deg)
        if not math.isfinite(self.altitude_m):
            raise MissionError(f"a rally point has the altitude {self.altitude_m:g}; give metres above home")


@dataclass(frozen=True)
class ComplexItem:
    """A pattern of QGroundControl (survey, corridor, ...).

    Parameters
    ----------
    kind : str
        Its ``complexItemType``.
    items : int
        Flight items that the file holds for it, and that are in the plan's items; 0 when only QGroundControl
        can work them out.
    """

    kind: str
    items: int


@dataclass(frozen=True)
class MissionPlan:
    """A whole plan.

    Parameters
    ----------
    items : tuple of MissionItem
        In flight order, without home.
    home : Home
    fences, circles, rally_points : tuple
        Geofence and rally points.
    firmware_type, vehicle_type : int
        MAV_AUTOPILOT and MAV_TYPE.
    cruise_m_s, hover_m_s : float
        What a ground station expects of a plane and of a multirotor, for its own estimates.
    complex_items : tuple of ComplexItem
        Patterns found in a plan that was read.
    passing : tuple of int
        Indices of the waypoints that only lead past a keep-out or over terrain and are no stops, as far as that is
        known; no part of equality, a .plan does not say.
    warnings : tuple of str
        Sentences about this plan, from making or from reading it; no part of equality.
    """

    items: tuple[MissionItem, ...]
    home: Home
    fences: tuple[Fence, ...]
    rally_points: tuple[RallyPoint, ...]
    firmware_type: int
    vehicle_type: int
    cruise_m_s: float
    hover_m_s: float
    circles: tuple[Circle, ...] = ()
    complex_items: tuple[ComplexItem, ...] = ()
    passing: tuple[int, ...] = field(default=(), compare=False)
    warnings: tuple[str, ...] = field(default=(), compare=False)

    @property
    def autopilot(self) -> Autopilot | None:
        """Facts about the autopilot, None for firmware that we know nothing of."""
        return next((facts for facts in AUTOPILOTS.values() if facts.firmware_type == self.firmware_type), None)

    @property
    def autopilot_title(self) -> str:
        """The autopilot's name as people write it."""
        return TITLES.get(self.firmware_type, f"firmware type {self.firmware_type}")

    @property
    def stops(self) -> tuple[MissionItem, ...]:
        """Waypoints and timed circles of the survey: all but the waypoint over the landing place, or back at home."""
        stops = [
            index
            for index, item in enumerate(self.items)
            if item.command in WAYPOINTS | {NAV_LOITER_TIME} and not self._only_arrives(index)
        ]
        if len(stops) > 1 or (stops and stops[-1] + 1 < len(self.items)):
            last = self.items[stops[-1]].params[4:6]
            after = self.items[stops[-1] + 1] if stops[-1] + 1 < len(self.items) else None
            landed = after is not None and after.command in LANDINGS and last == after.params[4:6]
            parked = (
                after is None and self.vehicle_type in STAYS_DOWN and last == (self.home.lat_deg, self.home.lon_deg)
            )
            if landed or parked:
                stops.pop()
        return tuple(self.items[index] for index in stops if index not in self.passing)

    def _only_arrives(self, index: int) -> bool:
        """Whether a waypoint arrives where the next item waits: between the two something is switched on."""
        item = self.items[index]
        if item.hold_s > 0 or index in self.passing:
            return False
        after = next((one for one in self.items[index + 1 :] if one.command in FLOWN_TO), None)
        waits = after is not None and after.command in WAYPOINTS | {NAV_LOITER_TIME} and after.hold_s > 0
        return waits and after is not None and after.params[4:6] == item.params[4:6]


def flown_way(plan: MissionPlan) -> list[tuple[float, float, float]]:
    """Return longitude, latitude and height above home of the survey and the ways to and from it, in order.

    Of a plan of ours: all waypoints, which are above home.
    """
    at_height = WAYPOINTS | {NAV_LOITER_TIME}
    return [(item.lon_deg, item.lat_deg, item.altitude_m) for item in plan.items if item.command in at_height]


def transits(plan: MissionPlan) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Return the longitudes and latitudes of the ways from home to the first stop and from the last one home.

    By way of the points that lead past keep-outs; without the climb out and the approach of a plane.
    """
    home, stops = plan.home.place, plan.stops
    first, last = ((stop.lon_deg, stop.lat_deg) for stop in (stops[0], stops[-1]))
    begin, end = (
        next(index for index, item in enumerate(plan.items) if item is stop) for stop in (stops[0], stops[-1])
    )
    passed = [(index, (plan.items[index].lon_deg, plan.items[index].lat_deg)) for index in plan.passing]
    out = [place for index, place in passed if index < begin]
    back = [place for index, place in passed if index > end]
    return [home, *out, first], [last, *back, home]


def _check_point(what: str, lon_deg: float, lat_deg: float) -> None:
    # Written so that NaN fails too.
    if not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180):
        raise MissionError(
            f"{what} lies at longitude {lon_deg:g}, latitude {lat_deg:g}; allowed are -180..180 and -90..90 degrees"
        )
