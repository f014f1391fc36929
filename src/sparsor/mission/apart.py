"""Places and heights for vehicles that fly at once, so that no two are ever nearer than a stated distance.

Each vehicle has a height of its own, a separation above the one before, and a place of its own, where it climbs and
lands. What is left to decide is who is higher: who climbs past the height of another must not do so near its way.
Flights of different rounds are never in the air together; their vehicles stand in the same places.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.geodesy.lengths import distance_m, wgs84
from sparsor.mission.separation import Swept, apart_m, nearest, swept
from sparsor.vehicle import approach_m

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

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
    distance_m : float
        Which no two of one round are nearer than; infinite where there are no two.
    """

    plans: tuple[MissionPlan, ...]
    heights_m: tuple[float, ...]
    distance_m: float


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
        One for each flight; or one alone, beside which places are looked for: in a line, in all directions.
    vehicle : Vehicle
    lowest_m, separation_m : float
        Height of the lowest flight of each round, and the distance to keep, which is also that between two heights.
    rounds : sequence of int, optional
        In which round each flight is flown; default: all at once.
    """
    numbers = np.zeros(len(ways), dtype=np.int64) if rounds is None else np.asarray(rounds)
    at_once = [np.flatnonzero(numbers == number).tolist() for number in np.unique(numbers)]
    own = len(homes) == len(ways)
    tried = [tuple(homes)] if own else _places(homes[0], ways, at_once, vehicle, lowest_m, separation_m)
    step_m = separation_m if vehicle.flies else 0.0
    for places in tried:
        found: dict[int, tuple[MissionPlan, float]] = {}
        distance_m = math.inf
        for flights in at_once:
            apart = _apart(build, {one: places[one] for one in flights}, vehicle, lowest_m, step_m, separation_m)
            if apart is None:
                break
            found |= apart[0]
            distance_m = min(distance_m, apart[1])
        else:
            plans, heights_m = zip(*(found[number] for number in range(len(ways))), strict=True)
            return Apart(plans, heights_m, distance_m)
    return None


def _apart(
    build: Build, homes: Mapping[int, Home], vehicle: Vehicle, lowest_m: float, step_m: float, separation_m: float
) -> tuple[dict[int, tuple[MissionPlan, float]], float] | None:
    """Return plans and heights of flights at once, and how far apart they are; None where they are not."""
    highest_m = lowest_m + step_m * (len(homes) - 1)
    low, high = (
        [swept(plan, vehicle) for number, home in homes.items() if (plan := build(number, home, height_m))]
        for height_m in (lowest_m, highest_m)
    )
    order = _lowest_first(low, high, separation_m) if len(low) == len(high) == len(homes) else None
    if order is None:
        return None
    numbers = list(homes)
    heights_m = {numbers[place]: lowest_m + step_m * rank for rank, place in enumerate(order)}
    built = {number: build(number, home, heights_m[number]) for number, home in homes.items()}
    plans = {number: plan for number, plan in built.items() if plan is not None}
    if len(plans) < len(homes):
        return None
    distance_m = nearest(list(plans.values()), vehicle).distance_m
    if distance_m < separation_m - TOLERANCE_M:
        return None
    return {number: (plan, heights_m[number]) for number, plan in plans.items()}, distance_m


def _lowest_first(low: Sequence[Swept], high: Sequence[Swept], separation_m: float) -> list[int] | None:
    """Return the flights from the lowest to the highest, None where each order lets one climb through another's way.

    Who would climb or sink through another's way if it were the higher of the two has to be the lower: then it does so
    below that way.

    Parameters
    ----------
    low, high : sequences of Swept
        Each flight at the least and at the greatest height.
    separation_m : float
    """
    count = len(low)
    below = np.zeros((count, count), dtype=np.bool_)
    for one in range(count):
        for other in range(count):
            below[one, other] = one != other and apart_m(high[one], low[other]) < separation_m - TOLERANCE_M
    order: list[int] = []
    while len(order) < count:
        free = next((one for one in range(count) if one not in order and not _waits(below, one, order)), None)
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
    at_once: Sequence[list[int]],
    vehicle: Vehicle,
    lowest_m: float,
    separation_m: float,
) -> Iterator[tuple[Home, ...]]:
    """Yield places for the flights in a line from home, each way round, farther and farther apart.

    A flight that goes farther along the line than others of its round has a place farther along it, so that the ways
    from home do not cross.
    """
    wide_m = 4.0 * vehicle.turn_radius_m + approach_m(vehicle, lowest_m) if vehicle.circles else 0.0
    base = (home.lon_deg, home.lat_deg)
    middles = np.array([[(first[0] + last[0]) / 2, (first[1] + last[1]) / 2] for first, last in ways])
    azimuths_deg, lengths_m = _seen_from(base, middles)
    ahead_deg, _ = _seen_from(base, middles.mean(axis=0, keepdims=True))
    for spacing in SPACINGS:
        for turned_deg in np.arange(0.0, 180.0, STEP_DEG):
            for side in (90.0, -90.0):
                line_deg = float(ahead_deg[0]) + side + float(turned_deg)
                along_m = lengths_m * np.cos(np.radians(azimuths_deg - line_deg))
                rank = np.empty(len(ways), dtype=np.int64)
                for flights in at_once:
                    rank[np.array(flights)[np.argsort(along_m[flights], kind="stable")]] = np.arange(len(flights))
                yield tuple(_beside(home, line_deg, float(step) * (spacing * separation_m + wide_m)) for step in rank)


def _seen_from(base: Point, places: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    lon, lat = np.full(len(places), base[0]), np.full(len(places), base[1])
    azimuth_deg, _, _ = wgs84().inv(lon, lat, *places.T)
    return np.asarray(azimuth_deg, dtype=np.float64), distance_m(lon, lat, *places.T)


def _beside(home: Home, azimuth_deg: float, length_m: float) -> Home:
    if length_m == 0:
        return home
    lon, lat, _ = wgs84().fwd(home.lon_deg, home.lat_deg, azimuth_deg, length_m)
    return replace(home, lon_deg=round(float(lon), DECIMALS), lat_deg=round(float(lat), DECIMALS))
