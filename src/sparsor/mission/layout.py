"""Where a flight goes: its ways from and to home, its heights, its climb out and its approach."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.errors import MissionError
from sparsor.mission.clearance import pattern_fault
from sparsor.mission.following import heights_along, steepness_of
from sparsor.mission.keepouts import TURNS_DEG, crosses, free_ends, ways_past
from sparsor.mission.sequences import Ascent, Visit, ends_of, room_of
from sparsor.vehicle import approach_up_m

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.geodesy.zones import Zones
    from sparsor.mission.following import Ground
    from sparsor.mission.sequences import Ends, Point
    from sparsor.vehicle import SteadyWind, Vehicle

MOST_TRIES = 8  # of a plane's climb out, which is the longer the higher it has to end
ENOUGH_M = 0.25  # heights are rounded up


@dataclass(frozen=True)
class Layout:
    """Where a flight goes.

    Parameters
    ----------
    visits : tuple of Visit
        All between take-off and landing, without the waypoint over home.
    ascent : Ascent
    ends : Ends or None
        Of what circles.
    path : tuple of (longitude, latitude)
        All that the fence goes round, home first.
    """

    visits: tuple[Visit, ...]
    ascent: Ascent
    ends: Ends | None
    path: tuple[Point, ...]


def lay_out(
    stops: Sequence[Visit],
    base: Point,
    *,
    vehicle: Vehicle,
    altitude_m: float,
    speed_m_s: float,
    wind: SteadyWind,
    zones: Zones | None = None,
    ground: Ground | None = None,
) -> Layout:
    """Return where a flight over stops goes.

    Parameters
    ----------
    stops : sequence of Visit
        One or more; over terrain their heights are found here.
    base : tuple of float
        Home.
    vehicle : Vehicle
    altitude_m : float
        Above home, or above the ground that is followed.
    speed_m_s : float
    wind : SteadyWind
    zones : Zones, optional
    ground : Ground, optional
        Heights are kept above it.

    Raises
    ------
    MissionError, TerrainError
        When there is no way, or the ground is in it.
    """
    if ground is not None:
        return _over_terrain(stops, base, vehicle, speed_m_s, wind, zones, ground)
    first, last = stops[0].place, stops[-1].place
    ends = None
    if vehicle.circles:
        ends = free_ends(base, first, last, vehicle=vehicle, altitude_m=altitude_m, wind=wind, zones=zones)
    outbound, homebound = ways_past(zones, base, first, last, ends, lifts=vehicle.lifts)
    visits = (*_passed(outbound, altitude_m), *stops, *_passed(homebound, altitude_m))
    ascent = Ascent(altitude_m, altitude_m, approach_up_m(altitude_m))
    return Layout(visits, ascent, ends, _path(base, visits, ends, vehicle))


def _over_terrain(
    stops: Sequence[Visit],
    base: Point,
    vehicle: Vehicle,
    speed_m_s: float,
    wind: SteadyWind,
    zones: Zones | None,
    ground: Ground,
) -> Layout:
    if not vehicle.circles:
        return _followed(stops, base, vehicle, speed_m_s, wind, zones, ground, None, 0.0)
    first, last, home_m = stops[0].place, stops[-1].place, ground.home_m(base)
    said = ""
    for turned_deg in TURNS_DEG:
        take_off_m = ground.height_m
        for _ in range(MOST_TRIES):
            ends = ends_of(base, first, last, vehicle=vehicle, altitude_m=take_off_m, wind=wind, turned_deg=turned_deg)
            if zones is not None and crosses(zones, base, ends, lifts=vehicle.lifts):
                break
            fault = pattern_fault(ends, base, vehicle, take_off_m, ground, home_m)
            if fault:
                said = said or fault
                break
            found = _followed(stops, base, vehicle, speed_m_s, wind, zones, ground, ends, take_off_m)
            if vehicle.lifts or found.ascent.take_off_m <= take_off_m + ENOUGH_M:
                return found
            take_off_m = found.ascent.take_off_m
    raise MissionError(
        f"no direction is free for a {vehicle.kind} to climb out of and come in to {base[0]:g} {base[1]:g}"
        f"{': ' + said if said else ''}; take off and land elsewhere (--home LON LAT)"
    )


def _followed(
    stops: Sequence[Visit],
    base: Point,
    vehicle: Vehicle,
    speed_m_s: float,
    wind: SteadyWind,
    zones: Zones | None,
    ground: Ground,
    ends: Ends | None,
    take_off_m: float,
) -> Layout:
    """Return the flight over the ground with its ends where they are given; a plane begins at `take_off_m`."""
    home_m = ground.home_m(base)
    outbound, homebound = ways_past(zones, base, stops[0].place, stops[-1].place, ends, lifts=vehicle.lifts)
    start = base if ends is None or vehicle.lifts else ends.climb_out
    finish = base if ends is None else ends.circle
    way = [start, *outbound, *(stop.place for stop in stops), *homebound, finish]
    past = "a point past a keep-out"
    names = [
        "home" if start == base else "the end of the climb out",
        *(past for _ in outbound),
        *(f"stop {number}" for number in range(1, len(stops) + 1)),
        *(past for _ in homebound),
        "home" if ends is None else "the circle before the landing",
    ]
    heights, further = heights_along(
        way,
        names,
        ground,
        steepness_of(vehicle, speed_m_s, wind),
        home_m=home_m,
        start_up_m=take_off_m,
        ceiling_m=vehicle.ceiling_m,
    )
    visits: list[Visit] = []
    first, after = 1 + len(outbound), 1 + len(outbound) + len(stops)
    for index, (place, up_m, leg) in enumerate(zip(way[1:], heights[1:], further, strict=True), start=1):
        visits += [Visit(lon, lat, height_m, stop=False) for lon, lat, height_m in leg]
        hold_s = stops[index - first].hold_s if first <= index < after else None
        visits.append(Visit(*place, up_m, hold_s or 0.0, stop=hold_s is not None))
    if ends is None:
        visits.pop()  # over home, which every flight ends with
    ascent = Ascent(heights[0], heights[-1], approach_up_m(take_off_m))
    return Layout(tuple(visits), ascent, ends, _path(base, visits, ends, vehicle))


def _passed(way: Sequence[Point], altitude_m: float) -> tuple[Visit, ...]:
    return tuple(Visit(lon, lat, altitude_m, stop=False) for lon, lat in way)


def _path(base: Point, visits: Sequence[Visit], ends: Ends | None, vehicle: Vehicle) -> tuple[Point, ...]:
    room = [] if ends is None else room_of(ends, vehicle)
    return (base, *(visit.place for visit in visits), base, *room)
