"""How near to each other vehicles may come that fly several plans at once, whenever each of them starts.

Nothing is supposed of timing: every vehicle may be anywhere on its way at any time. So two vehicles are as near as
their ways are, climbs, descents and circles included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from sparsor.geodesy.lengths import distance_m
from sparsor.geodesy.plane import LocalPlane
from sparsor.mission.items import (
    FLOWN_TO,
    FRAME_RELATIVE,
    LANDINGS,
    LOITERS,
    NAV_LOITER_TO_ALT,
    NAV_RETURN_TO_LAUNCH,
    POSITION_OPTIONAL,
    TAKE_OFFS,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.mission.items import MissionItem
    from sparsor.mission.plan import MissionPlan
    from sparsor.vehicle import Vehicle

Point = tuple[float, float]
DO_JUMP = 177
EARTH_M = 6_371_000.0
ANY_HEIGHT = (-math.inf, math.inf)


@dataclass(frozen=True)
class Swept:
    """Where a vehicle may be, as upright slabs: lines on the map, the heights over each, and how far beside it.

    Parameters
    ----------
    ends_deg : array of float64 (m, 2, 2)
        Longitude and latitude of both ends of each line.
    low_m, high_m : arrays of float64 (m,)
        Heights above home; infinite where a plan does not say.
    beside_m : array of float64 (m,)
        Room for circles and wide turns.
    """

    ends_deg: NDArray[np.float64]
    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]
    beside_m: NDArray[np.float64]


class Nearest(NamedTuple):
    """The least distance between any two of several plans, and which two: metres, places from 0.

    Where `parked`, the second one's vehicle stands at its home meanwhile.
    """

    distance_m: float
    first: int
    second: int
    parked: bool = False


def nearest(plans: Sequence[MissionPlan], vehicle: Vehicle, rounds: Sequence[int] | None = None) -> Nearest:
    """Return a lower bound of the distance between any two vehicles that fly plans at once, at any time.

    Parameters
    ----------
    plans : sequence of MissionPlan
        Where the height of a home above the sea is not known, all homes count as level.
    vehicle : Vehicle
        That flies each of them: what circles may be two turn radii beside a leg.
    rounds : sequence of int, optional
        In which round each is flown; default: all at once. In a round that a vehicle does not fly it stands at home.
    """
    numbers = [0] * len(plans) if rounds is None else list(rounds)
    known = all(plan.home.altitude_known for plan in plans)
    raised = [plan.home.alt_amsl_m if known else 0.0 for plan in plans]
    homes = [plan.home.place for plan in plans]
    ways = [swept(plan, vehicle) for plan in plans]

    def between(one: int, other: int, *, parked: bool = False) -> Nearest:
        way = _standing(homes[other]) if parked else ways[other]
        return Nearest(apart_m(ways[one], way, raised_m=raised[other] - raised[one]), one, other, parked)

    found = [Nearest(math.inf, 0, 0)]
    for number in sorted({*numbers}):
        flown = [one for one, its in enumerate(numbers) if its == number]
        there = {homes[one] for one in flown}
        standing = [homes.index(home) for home in dict.fromkeys(homes) if home not in there]
        found += [between(one, other) for one, other in combinations(flown, 2)]
        found += [between(one, other, parked=True) for one in flown for other in standing]
    return min(found)


def _standing(home: Point) -> Swept:
    """Return where a vehicle is that stays at home."""
    on_the_ground = np.zeros(1)
    return Swept(np.array([[home, home]], dtype=np.float64), on_the_ground, on_the_ground, on_the_ground)


def apart_m(one: Swept, other: Swept, *, raised_m: float = 0.0) -> float:
    """Return a lower bound of the distance between two vehicles anywhere on their ways, metres.

    Parameters
    ----------
    one, other : Swept
    raised_m : float
        Height of the other's home above the one's.
    """
    beside = _on_the_map_m(one, other)
    low, high = other.low_m + raised_m, other.high_m + raised_m
    over = np.maximum(low[None, :] - one.high_m[:, None], one.low_m[:, None] - high[None, :])
    return float(np.hypot(beside, np.maximum(over, 0.0)).min())


def swept(plan: MissionPlan, vehicle: Vehicle) -> Swept:
    """Return where a vehicle may be that flies a plan; jumps may lead from where they are to every other item."""
    walk = _Walk(plan, vehicle)
    for item in plan.items:
        walk.fly(item)
    ends, heights, beside = zip(*walk.slabs, strict=True)
    low, high = np.array(heights, dtype=np.float64).T
    return Swept(np.array(ends, dtype=np.float64), low, high, np.array(beside, dtype=np.float64))


class _Walk:
    """A vehicle on its way through a plan: where it is, how high, and what it has swept."""

    def __init__(self, plan: MissionPlan, vehicle: Vehicle) -> None:
        self._plan, self._vehicle = plan, vehicle
        self._home: Point = plan.home.place
        self._at, self._up = self._home, (0.0, 0.0)
        self._wide_m = 2.0 * vehicle.turn_radius_m if vehicle.circles else 0.0
        self.slabs: list[tuple[tuple[Point, Point], tuple[float, float], float]] = []
        self._sweep(self._home, (0.0, 0.0))

    def fly(self, item: MissionItem) -> None:
        """Let an item pass."""
        if item.command == NAV_RETURN_TO_LAUNCH:
            self._up = ANY_HEIGHT  # the vehicle's own
            self._sweep(self._home, ANY_HEIGHT)
        elif item.command == DO_JUMP:
            for other in self._plan.items:
                if other.has_position:
                    self.slabs.append(((self._at, (other.lon_deg, other.lat_deg)), ANY_HEIGHT, self._wide_m))
        elif item.command in FLOWN_TO:
            self._reach(item)

    def _reach(self, item: MissionItem) -> None:
        nowhere = item.command in POSITION_OPTIONAL and item.params[4:6] == (0.0, 0.0) != self._home
        place = (item.lon_deg, item.lat_deg) if item.has_position and not nowhere else self._at
        height = self._height(item)
        both = (min(self._up[0], height[0]), max(self._up[1], height[1]))
        if item.command in TAKE_OFFS and self._vehicle.lifts:
            self._sweep(self._at, both)
            self._sweep(place, both)
        elif item.command in LANDINGS and self._vehicle.kind == "quad":
            self._sweep(place, self._up)
            self._sweep(place, both)
        else:
            radius_m = self._circle_m(item)
            self._sweep(place, both)
            if radius_m:
                self.slabs.append(((place, place), both, self._wide_m + 2.0 * radius_m))
        self._up = height

    def _height(self, item: MissionItem) -> tuple[float, float]:
        if item.command in LANDINGS:
            return (0.0, 0.0) if item.frame == FRAME_RELATIVE else ANY_HEIGHT
        if item.frame != FRAME_RELATIVE or math.isnan(item.altitude_m):
            return ANY_HEIGHT
        return item.altitude_m, item.altitude_m

    def _circle_m(self, item: MissionItem) -> float:
        if item.command not in LOITERS:
            return 0.0
        written_m = item.params[1 if item.command == NAV_LOITER_TO_ALT else 2]
        return max(0.0 if math.isnan(written_m) else abs(written_m), self._vehicle.turn_radius_m)

    def _sweep(self, to: Point, heights_m: tuple[float, float]) -> None:
        self.slabs.append(((self._at, to), heights_m, self._wide_m))
        self._at = to


def _on_the_map_m(one: Swept, other: Swept) -> NDArray[np.float64]:
    """Return lower bounds of the distances between lines on the map, (m, k).

    Taken in the plane, less what a line may bulge as a geodesic, and by the least scale of all latitudes.
    """
    everything = np.concatenate([one.ends_deg.reshape(-1, 2), other.ends_deg.reshape(-1, 2)])
    lat = everything[:, 1]
    plane = LocalPlane(float(everything[0, 0]), float((lat.min() + lat.max()) / 2.0))
    points = plane.metres(everything[:, 0], everything[:, 1])
    steepest = math.tan(math.radians(min(float(np.abs(lat).max()), 89.0)))
    extent = float(np.hypot(*np.ptp(points, axis=0))) / EARTH_M
    scales = [LocalPlane(0.0, float(edge)).scale / plane.scale for edge in (lat.min(), lat.max())]
    shrunk = max(min(float(np.min(scales)), 1.0) - extent**2 * (1.0 + steepest**2) / 8.0, 0.0)

    def lines(way: Swept) -> tuple[NDArray[np.object_], NDArray[np.float64]]:
        ends = plane.metres(way.ends_deg[..., 0], way.ends_deg[..., 1])
        long_m = distance_m(*way.ends_deg[:, 0].T, *way.ends_deg[:, 1].T)
        bulge_m = 1.1 * long_m**2 * steepest / (8.0 * EARTH_M)
        return np.asarray(shapely.linestrings(ends), dtype=np.object_), way.beside_m + bulge_m

    (here, here_m), (there, there_m) = lines(one), lines(other)
    planar = np.asarray(shapely.distance(here[:, None], there[None, :]), dtype=np.float64)
    return np.asarray(np.maximum(planar * shrunk - here_m[:, None] - there_m[None, :], 0.0), dtype=np.float64)
