"""What is wrong between a plan's flight and its fences.

Tested in the longitude-latitude plane, where both autopilots test polygons; circles by metres round their middle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from shapely import LineString, Point, Polygon

from sparsor.geodesy.plane import LocalPlane
from sparsor.mission.fault import Fault
from sparsor.mission.items import NAV_RETURN_TO_LAUNCH, POSITION_OPTIONAL

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from sparsor.mission.plan import Circle, Fence, MissionPlan

Place = tuple[str, float, float]
Flown = Point | LineString


@dataclass(frozen=True)
class _Zone:
    """One fence: its name, the points of a place or a leg in its plane, and whether it lets them be."""

    name: str
    inclusion: bool
    in_plane: Callable[[tuple[Place, ...]], list[tuple[float, float]]]
    allows: Callable[[Flown], bool]


def fence_faults(plan: MissionPlan) -> Iterator[Fault]:
    """Yield what is on the wrong side of a fence: home, items, the legs between them, rally points."""
    if not plan.fences and not plan.circles:
        yield Fault("There is no fence.")
    way = tuple(_way(plan))
    rally = tuple((f"Rally point {n}", one.lon_deg, one.lat_deg) for n, one in enumerate(plan.rally_points, start=1))
    for number, fence in enumerate(plan.fences, start=1):
        area = Polygon(list(zip(_near(fence.lon_deg, fence.lon_deg[0]), fence.lat_deg, strict=True)))
        if not area.is_valid:
            yield Fault(f"Fence polygon {number} crosses itself.", serious=True)
            continue
        yield from _crossed(_polygon_zone(f"fence polygon {number}", fence, area), way, rally)
    for number, circle in enumerate(plan.circles, start=1):
        yield from _crossed(_circle_zone(f"fence circle {number}", circle), way, rally)


def _way(plan: MissionPlan) -> Iterator[Place]:
    """Yield the places of a flight in order, home first; a return to launch goes there again."""
    home = plan.home.place
    yield ("Home", *home)
    for place, item in enumerate(plan.items, start=1):
        here = item.command in POSITION_OPTIONAL and item.params[4:6] == (0.0, 0.0)
        if item.command == NAV_RETURN_TO_LAUNCH:
            yield (f"Item {place}", *home)
        elif item.has_position and not here:
            yield (f"Item {place}", item.lon_deg, item.lat_deg)


def _crossed(zone: _Zone, way: tuple[Place, ...], rally: tuple[Place, ...]) -> Iterator[Fault]:
    side = "outside" if zone.inclusion else "inside"
    wrong = set()
    for place in (*way, *rally):
        if not zone.allows(Point(zone.in_plane((place,))[0])):
            wrong.add(place)
            yield Fault(f"{place[0]} lies {side} {zone.name}.", serious=True)
    for start, end in pairwise(way):
        leg = zone.in_plane((start, end))
        # A leg from a place that is wrong already says nothing new.
        if not wrong & {start, end} and leg[0] != leg[1] and not zone.allows(LineString(leg)):
            over = "leaves" if zone.inclusion else "crosses"
            yield Fault(f"The leg from {_in_words(start)} to {_in_words(end)} {over} {zone.name}.", serious=True)


def _in_words(place: Place) -> str:
    return place[0][0].lower() + place[0][1:]


def _polygon_zone(name: str, fence: Fence, area: Polygon) -> _Zone:
    def in_plane(places: tuple[Place, ...]) -> list[tuple[float, float]]:
        lon = _near([place[1] for place in places], fence.lon_deg[0])
        return list(zip(lon, [place[2] for place in places], strict=True))

    def allows(flown: Flown) -> bool:
        if fence.inclusion:
            return bool(area.contains(flown))
        return not area.intersects(flown) or bool(area.touches(flown))

    return _Zone(name, fence.inclusion, in_plane, allows)


def _circle_zone(name: str, circle: Circle) -> _Zone:
    plane, middle = LocalPlane(circle.lon_deg, circle.lat_deg), Point(0.0, 0.0)

    def in_plane(places: tuple[Place, ...]) -> list[tuple[float, float]]:
        points = plane.metres([place[1] for place in places], [place[2] for place in places])
        return [(float(east), float(north)) for east, north in points]

    def allows(flown: Flown) -> bool:
        if circle.inclusion:
            return all(math.dist(point, (0.0, 0.0)) <= circle.radius_m for point in flown.coords)
        return flown.distance(middle) >= circle.radius_m

    return _Zone(name, circle.inclusion, in_plane, allows)


def _near(lon_deg: list[float] | tuple[float, ...], reference_deg: float) -> list[float]:
    """Return longitudes within half a turn of another."""
    return [reference_deg + (lon - reference_deg + 180.0) % 360.0 - 180.0 for lon in lon_deg]
