"""What is kept out of, in a plan: exclusion fences, ways past, and a free place to climb out and come in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.errors import MissionError
from sparsor.mission.plan import Circle, Fence
from sparsor.mission.sequences import ends_of

if TYPE_CHECKING:
    from sparsor.geodesy.zones import Points, Zones
    from sparsor.mission.sequences import Ends, Point
    from sparsor.vehicle import SteadyWind, Vehicle

# Tried in this order, from the wished direction outwards.
TURNS_DEG = (0.0, *(side * step for step in range(15, 181, 15) for side in (1.0, -1.0)))


def exclusions(zones: Zones | None) -> tuple[Fence, ...]:
    """Return the polygons of what is kept out of as exclusion fences."""
    polygons = () if zones is None else zones.polygons
    return tuple(Fence(tuple(lon for lon, _ in one), tuple(lat for _, lat in one), inclusion=False) for one in polygons)


def exclusion_circles(zones: Zones | None) -> tuple[Circle, ...]:
    """Return its circles."""
    circles = () if zones is None else zones.circles
    return tuple(Circle(lon, lat, radius_m, inclusion=False) for lon, lat, radius_m in circles)


def ways_past(
    zones: Zones | None, home: Point, first: Point, last: Point, ends: Ends | None, *, lifts: bool
) -> tuple[Points, Points]:
    """Return the points between home and the first stop and between the last one and home.

    Of a plane the first way begins where it has climbed out; that of what circles ends at its circle.

    Raises
    ------
    MissionError
        When a stop or home lies in a keep-out, or there is no way.
    """
    if zones is None:
        return [], []
    start = home if ends is None or lifts else ends.climb_out
    out = zones.way(start, first)
    back = zones.way(last, home if ends is None else ends.circle)
    if out is None or back is None:
        raise MissionError(
            f"there is no way between home, {home[0]:g} {home[1]:g}, and the route that keeps out of "
            f"{', '.join(zones.names)}: take off elsewhere (--home LON LAT), or lessen --keep-out-margin"
        )
    return out, back


def free_ends(
    home: Point,
    first: Point,
    last: Point,
    *,
    vehicle: Vehicle,
    altitude_m: float,
    wind: SteadyWind,
    zones: Zones | None,
) -> Ends:
    """Return where a plane or a VTOL climbs out and comes in, turned as little as it takes to keep out.

    Raises
    ------
    MissionError
        When there is no free direction.
    """
    for turned_deg in TURNS_DEG:
        ends = ends_of(home, first, last, vehicle=vehicle, altitude_m=altitude_m, wind=wind, turned_deg=turned_deg)
        if zones is None or not crosses(zones, home, ends, lifts=vehicle.lifts):
            return ends
    raise MissionError(
        f"no direction is free for a {vehicle.kind} to come in to {home[0]:g} {home[1]:g} beside what is kept out of: "
        "take off and land elsewhere (--home LON LAT)"
    )


def crosses(zones: Zones, home: Point, ends: Ends, *, lifts: bool) -> bool:
    """Return whether the climb out or the last approach cross what is kept out of."""
    legs = [(ends.touch, home), (ends.circle, home), (ends.circle, ends.touch)]
    if not lifts:
        legs.append((home, ends.climb_out))
    starts, finishes = zip(*legs, strict=True)
    lon0, lat0 = zip(*starts, strict=True)
    lon1, lat1 = zip(*finishes, strict=True)
    return bool(zones.crossed(lon0, lat0, lon1, lat1).any())
