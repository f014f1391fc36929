"""Places and heights for vehicles that fly at once, so that no two are ever nearer than a stated distance.

Each vehicle has a height of its own, a separation above the one before, and a place of its own, where it climbs and
lands. What is left to decide is who is higher: who climbs past the height of another must not do so near its way.
Where they fly in rounds, each keeps its place and its height; those of different rounds are never in the air together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import permutations
from typing import TYPE_CHECKING

import numpy as np

from sparsor.geodesy.lengths import distance_m, wgs84
from sparsor.mission.separation import apart_m, nearest, swept
from sparsor.vehicle import approach_m

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from sparsor.mission.plan import Home, MissionPlan
    from sparsor.vehicle import Vehicle

    Build = Callable[[int, Home, float], MissionPlan | None]

Point = tuple[float, float]
SPACINGS = (2.0, 3.0, 5.0, 8.0)  # between places side by side, in separations
STEP_DEG = 15.0
DECIMALS = 7
TOLERANCE_M = 1e-6


@dataclass(frozen=True)
class Apart:
    """Flights of which those at once are apart at all times.

    Parameters
    ----------
    plans : tuple of MissionPlan
        In the order of the flights that were given.
    heights_m : tuple of float
    vehicles : tuple of int
        Which vehicle flies each of them, from 0.
    distance_m : float
        Which no two are nearer than, see `nearest`; infinite where there are no two.
    """

    plans: tuple[MissionPlan, ...]
    heights_m: tuple[float, ...]
    vehicles: tuple[int, ...]
    distance_m: float


@dataclass(frozen=True)
class _Places:
    """Where the flights begin and end, and which vehicle stands there."""

    homes: tuple[Home, ...]
    vehicles: tuple[int, ...]


def flights_apart(
    build: Build,
    ways: Sequence[tuple[Point, Point]],
    homes: Sequence[Home],
    *,
    vehicle: Vehicle,
    lowest_m: float,
    separation_m: float,
    rounds: Sequence[int] | None = None,
) -> Apart | None:
    """Return flights that are never nearer to each other than the separation, None where none were found.

    Parameters
    ----------
    build : callable
        Returns the plan of a flight by its number, home and height; None where it cannot be flown from there.
    ways : sequence of (first stop, last stop)
        Of each flight, longitudes and latitudes.
    homes : sequence of Home
        One for each flight, where that of each vehicle is known; or one alone, beside which places are looked for: in a
        line, in all directions.
    vehicle : Vehicle
    lowest_m, separation_m : float
        Height of the lowest vehicle, and the distance to keep, which is also that between two heights.
    rounds : sequence of int, optional
        In which round each flight is flown; default: all at once.
    """
    numbers = [0] * len(ways) if rounds is None else list(rounds)
    if len(homes) == len(ways):
        known = list(dict.fromkeys(homes))
        tried = iter([_Places(tuple(homes), tuple(known.index(home) for home in homes))])
    else:
        tried = _places(homes[0], ways, numbers, vehicle, lowest_m, separation_m)
    step_m = separation_m if vehicle.flies else 0.0
    for places in tried:
        found = _apart(build, places, numbers, vehicle, lowest_m, step_m, separation_m)
        if found is not None:
            return found
    return None


def _apart(
    build: Build,
    places: _Places,
    rounds: Sequence[int],
    vehicle: Vehicle,
    lowest_m: float,
    step_m: float,
    separation_m: float,
) -> Apart | None:
    count = max(places.vehicles) + 1

    def built(heights_m: Sequence[float]) -> list[MissionPlan] | None:
        each = zip(places.homes, places.vehicles, strict=True)
        plans = [build(number, home, heights_m[its]) for number, (home, its) in enumerate(each)]
        flown = [plan for plan in plans if plan is not None]
        return flown if len(flown) == len(plans) else None

    low, high = built([lowest_m] * count), built([lowest_m + step_m * (count - 1)] * count)
    if low is None or high is None:
        return None
    below = np.zeros((count, count), dtype=np.bool_)
    ways = [[swept(plan, vehicle) for plan in plans] for plans in (low, high)]
    for one, other in permutations(range(len(rounds)), 2):
        if rounds[one] == rounds[other]:
            near = apart_m(ways[1][one], ways[0][other]) < separation_m - TOLERANCE_M
            below[places.vehicles[one], places.vehicles[other]] |= near
    order = _lowest_first(below)
    if order is None:
        return None
    heights_m = [lowest_m + step_m * order.index(its) for its in range(count)]
    plans = built(heights_m)
    if plans is None:
        return None
    distance_m = nearest(plans, vehicle, rounds).distance_m
    if distance_m < separation_m - TOLERANCE_M:
        return None
    return Apart(tuple(plans), tuple(heights_m[its] for its in places.vehicles), places.vehicles, distance_m)


def _lowest_first(below: NDArray[np.bool_]) -> list[int] | None:
    """Return the vehicles from the lowest to the highest, None where each order lets one climb through another's way.

    Who would climb or sink through another's way if it were the higher of the two has to be the lower: then it does so
    below that way.

    Parameters
    ----------
    below : array of bool (n, n)
        Which has to be below which.
    """
    order: list[int] = []
    while len(order) < len(below):
        free = next((one for one in range(len(below)) if one not in order and not _waits(below, one, order)), None)
        if free is None:
            return None
        order.append(free)
    return order


def _waits(below: NDArray[np.bool_], one: int, order: Sequence[int]) -> bool:
    """Return whether another flight that is not in the order yet has to be below this one."""
    return any(below[other, one] for other in range(len(below)) if other != one and other not in order)


def _places(
    home: Home,
    ways: Sequence[tuple[Point, Point]],
    rounds: Sequence[int],
    vehicle: Vehicle,
    lowest_m: float,
    separation_m: float,
) -> Iterator[_Places]:
    """Yield places for the flights in a line from home, each way round, farther and farther apart.

    A flight that goes farther along the line than others of its round has a place farther along it, so that the ways
    from home do not cross.
    """
    wide_m = 4.0 * vehicle.turn_radius_m + approach_m(vehicle, lowest_m) if vehicle.circles else 0.0
    base = home.place
    middles = np.array([[(first[0] + last[0]) / 2, (first[1] + last[1]) / 2] for first, last in ways])
    azimuths_deg, lengths_m = _seen_from(base, middles)
    ahead_deg, _ = _seen_from(base, middles.mean(axis=0, keepdims=True))
    at_once = [np.flatnonzero(np.equal(rounds, number)) for number in sorted({*rounds})]
    rank = np.empty(len(ways), dtype=np.int64)
    for spacing in SPACINGS:
        for turned_deg in np.arange(0.0, 180.0, STEP_DEG):
            for side in (90.0, -90.0):
                line_deg = float(ahead_deg[0]) + side + float(turned_deg)
                along_m = lengths_m * np.cos(np.radians(azimuths_deg - line_deg))
                for flights in at_once:
                    rank[flights[np.argsort(along_m[flights], kind="stable")]] = np.arange(flights.size)
                step_m = spacing * separation_m + wide_m
                homes = tuple(_beside(home, line_deg, float(step) * step_m) for step in rank)
                yield _Places(homes, tuple(rank.tolist()))


def _seen_from(base: Point, places: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    lon, lat = np.full(len(places), base[0]), np.full(len(places), base[1])
    azimuth_deg, _, _ = wgs84().inv(lon, lat, *places.T)
    return np.asarray(azimuth_deg, dtype=np.float64), distance_m(lon, lat, *places.T)


def _beside(home: Home, azimuth_deg: float, length_m: float) -> Home:
    if length_m == 0:
        return home
    lon, lat, _ = wgs84().fwd(home.lon_deg, home.lat_deg, azimuth_deg, length_m)
    return replace(home, lon_deg=round(float(lon), DECIMALS), lat_deg=round(float(lat), DECIMALS))
