"""Heights above the ground kept along a flight, by as few further waypoints as that takes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import TerrainError
from sparsor.geodesy.lengths import line_deg
from sparsor.vehicle import CALM, SteadyWind, Vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.geodesy.terrain import Terrain

Point = tuple[float, float]
# Finer than an autopilot holds its height, more than is lost when it stores centimetres.
ROUND_UP_M = 0.1
SPARE_M = 0.02
# The keep-outs' too: what circles comes to its next leg from beside it.
REACH_TURNS = 2.0
TOLERANCE_SHARE, LEAST_TOLERANCE_M = 0.1, 2.0
FLAT = 1e-9
DECIMALS = 7  # as autopilots store positions
PLACE_M = 0.02  # and what is lost in that


def usual_tolerance_m(height_m: float) -> float:
    """Return how much nearer to the ground than the height wanted is allowed, where nothing was said of it.

    A tenth of the height, two metres at least: what an autopilot holds its height to.
    """
    return max(TOLERANCE_SHARE * height_m, LEAST_TOLERANCE_M)


@dataclass(frozen=True)
class Ground:
    """The ground that a flight follows.

    Parameters
    ----------
    terrain : Terrain
    height_m : float
        Wanted above it.
    tolerance_m : float
        How much lower, or higher, a leg may be.
    """

    terrain: Terrain
    height_m: float
    tolerance_m: float

    def __post_init__(self) -> None:
        if not 0 < self.tolerance_m < self.height_m:
            raise TerrainError(
                f"a terrain tolerance of {self.tolerance_m:g} m for a flight {self.height_m:g} m above the ground; it "
                "has to be above 0 and below the height"
            )

    @property
    def least_m(self) -> float:
        """The least height above the ground."""
        return self.height_m - self.tolerance_m

    def home_m(self, home: Point) -> float:
        """Return the height of the ground at home, which all heights of a plan are above.

        Raises
        ------
        TerrainError
            When it is not known.
        """
        return ground_at_home_m(self.terrain, home)


def ground_at_home_m(terrain: Terrain, home: Point) -> float:
    """Return the height of the ground at home.

    Raises
    ------
    TerrainError
        When it is not known.
    """
    found = float(terrain.ground_m(*home))
    if math.isnan(found):
        raise TerrainError(
            f"'{terrain.path}' does not know the ground at home, {home[0]:g} {home[1]:g}: give an elevation model that "
            "does, or take off elsewhere (--home LON LAT)"
        )
    return found


@dataclass(frozen=True)
class Steepness:
    """The slopes that a vehicle flies at its speed, and how far beside its legs it may come.

    Parameters
    ----------
    up, down : float
        Metres a metre; infinite for what slows down on a steep leg and keeps to it (multirotors).
    reach_m : float
    """

    up: float
    down: float
    reach_m: float


def steepness_of(vehicle: Vehicle, speed_m_s: float, wind: SteadyWind = CALM) -> Steepness:
    """Return the slopes of a vehicle; of what circles with the wind behind it, where they are least."""
    if not vehicle.circles:
        return Steepness(math.inf, math.inf, 0.0)
    over_ground_m_s = speed_m_s + wind.speed_m_s
    return Steepness(
        vehicle.climb_m_s / over_ground_m_s,
        vehicle.descent_m_s / over_ground_m_s,
        REACH_TURNS * vehicle.turn_radius_m,
    )


def heights_along(
    way: Sequence[Point],
    names: Sequence[str],
    ground: Ground,
    steepness: Steepness,
    *,
    home_m: float,
    start_up_m: float = 0.0,
    ceiling_m: float = math.inf,
) -> tuple[list[float], list[list[tuple[float, float, float]]]]:
    """Return the heights of a way's points above home, and the further points that each of its legs needs.

    The least function is taken that is the height wanted over the ground, half of the tolerance above the lowest
    allowed over the highest ground near, and nowhere steeper than the vehicle flies: it is raised for that, never
    lowered. Along each leg few points on it are kept, so that the straight lines between them leave it by no more than
    the tolerance, and come nowhere nearer to the ground.

    Parameters
    ----------
    way : sequence of (longitude, latitude)
        In flight order.
    names : sequence of str
        Of the points, for errors.
    ground : Ground
    steepness : Steepness
    home_m : float
        Height of the ground at home.
    start_up_m : float
        Height above home that the first point is reached at, at least.
    ceiling_m : float
        Above the ground; a flight that is not raised beyond it for another reason than `ground.height_m`.

    Raises
    ------
    TerrainError
        When the ground under a leg is not known, or the vehicle cannot climb over it below the ceiling.
    """
    terrain = ground.terrain
    legs = [line_deg(start, end, terrain.step_m / 2) for start, end in pairwise(way)]
    lon, lat = (np.concatenate([leg[part] for leg in legs]) for part in (1, 2))
    counts = np.array([leg[0].size for leg in legs])
    ends = np.cumsum(counts)
    leg_of = np.repeat(np.arange(counts.size), counts)
    before_m = np.concatenate([[0.0], np.cumsum([leg[0][-1] for leg in legs])[:-1]])
    along = np.concatenate([leg[0] for leg in legs]) + before_m[leg_of]
    # Of two neighbours here each is within half a step of all between them, and has half a step more round it than
    # `clearance` looks at there.
    near = terrain.highest_m(lon, lat, steepness.reach_m + terrain.step_m + PLACE_M)
    below = terrain.ground_m(lon, lat)
    unknown = np.flatnonzero(~np.isfinite(near) | np.isnan(below))
    if unknown.size:
        first = int(unknown[0])
        raise TerrainError(
            f"'{terrain.path}' does not know the ground under the leg {_named(names, leg_of[first])}, at "
            f"{lon[first]:.5f} {lat[first]:.5f}: give an elevation model without that gap, or keep out of it "
            "(--keep-out)"
        )
    low = near + ground.least_m - home_m
    # Half of the tolerance is left on slopes too, where the highest ground near is above that below.
    goal = np.maximum(below + ground.height_m - home_m, low + ground.tolerance_m / 2)
    goal[0] = max(goal[0], start_up_m)
    goal = np.maximum(_flyable(along, goal, steepness), low)  # for what is lost in rounding
    over = goal - (near - home_m)
    most_m = max(ceiling_m, ground.height_m + ground.tolerance_m)
    if over.max() > most_m + FLAT:
        worst = int(np.argmax(over))
        raise TerrainError(
            f"the leg {_named(names, leg_of[worst])} would meet the ground: to pass over it at slopes that the "
            f"vehicle flies ({steepness.up:.0%} up, {steepness.down:.0%} down) it would be {over[worst]:.0f} m above "
            f"it at {lon[worst]:.5f} {lat[worst]:.5f}, beyond the ceiling of {most_m:g} m: give a slower --speed, a "
            "higher ceiling_m in the vehicle profile, or keep out of the slope (--keep-out)"
        )
    heights, further = [_written(goal[0])], []
    for begin, end in pairwise([0, *ends.tolist()]):
        leg = slice(begin, end)
        kept = few_joins(along[leg], goal[leg], low[leg], goal[leg] + ground.tolerance_m)
        inner = begin + np.array(kept[1:-1], dtype=np.int64)
        further.append(
            [(round(float(lon[at]), DECIMALS), round(float(lat[at]), DECIMALS), _written(goal[at])) for at in inner]
        )
        heights.append(_written(goal[end - 1]))
    return heights, further


def few_joins(
    along: NDArray[np.float64], goal: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> list[int]:
    """Return a few places, first and last among them, whose straight joins over `goal` stay between two bounds.

    From each place the farthest one that can be joined to it.

    Examples
    --------
    >>> hill = np.array([0.0, 0.0, 9.0, 0.0, 0.0])
    >>> few_joins(np.arange(5.0), hill, hill - 1, hill + 1)
    [0, 1, 2, 3, 4]
    >>> few_joins(np.arange(5.0), hill, hill - 1, hill + 9)
    [0, 2, 4]
    """
    last = along.size - 1
    kept = [0]
    while kept[-1] < last:
        at = kept[-1]
        ahead = along[at + 1 :] - along[at]
        if ahead[-1] <= 0:  # a leg of no length
            return [0, last]
        slope = (goal[at + 1 :] - goal[at]) / ahead
        floor = np.maximum.accumulate((low[at + 1 :] - goal[at]) / ahead)
        roof = np.minimum.accumulate((high[at + 1 :] - goal[at]) / ahead)
        joins = np.flatnonzero((slope >= floor) & (slope <= roof))
        kept.append(at + 1 + int(joins[-1]))
    return kept


def _flyable(along: NDArray[np.float64], goal: NDArray[np.float64], steepness: Steepness) -> NDArray[np.float64]:
    """Return the least function above another that is nowhere steeper than a vehicle flies."""
    if math.isinf(steepness.up):
        # Two legs meet in one place, at one height.
        return goal
    raised = np.maximum.accumulate(goal + steepness.down * along) - steepness.down * along
    back = raised[::-1] + steepness.up * -along[::-1]
    return np.asarray((np.maximum.accumulate(back) + steepness.up * along[::-1])[::-1])


def _written(height_m: float) -> float:
    return round(math.ceil((height_m + SPARE_M) / ROUND_UP_M) * ROUND_UP_M, 1)


def _named(names: Sequence[str], leg: int) -> str:
    return f"from {names[leg]} to {names[leg + 1]}"
