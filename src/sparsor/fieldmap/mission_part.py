"""Which samples of a log belong to the mission: at its height, and inside its grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.errors import LogError
from sparsor.geodesy.lengths import distance_m
from sparsor.geodesy.plane import LocalPlane

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.flightlog.sampling import Samples
    from sparsor.geodesy.grid import Grid

BAND: Final = 0.2
"""Half the height of the band around the mission's height, as a share of that height."""
LEAST_BAND_M: Final = 2.0
WAY_BAND_M: Final = 10.0
"""The same round a way whose height above the ground nobody knows."""
SIDE_BY_SIDE_M: Final = 20.0
"""As far beyond the nearest part of a way another one is as good: positions are no better, and legs cross."""
OUTSIDE = -1
_MODE_WIDTH_M = 4.0
_AIRBORNE = 0.5  # above this share of the usual height nothing takes off or lands


@dataclass(frozen=True, eq=False)
class MissionPart:
    """Where samples lie, and which were taken on the mission.

    Parameters
    ----------
    in_flight : array of bool (n,)
        At the mission's height.
    cell : array of int64 (n,)
        `OUTSIDE` for those outside the grid.
    warnings : tuple of str
    """

    in_flight: NDArray[np.bool_]
    cell: NDArray[np.int64]
    warnings: tuple[str, ...]


def mission_part(
    samples: Samples,
    grid: Grid,
    altitude_m: float | None = None,
    way: NDArray[np.float64] | None = None,
    *,
    heights_m: Sequence[float] = (),
) -> MissionPart:
    """Tell the mission from the way to it, take-off and landing.

    Samples of unknown height count as of the mission's. A vehicle that stays on the ground is on its mission
    all the time.

    Parameters
    ----------
    samples : Samples
    grid : Grid
    altitude_m : float, optional
        The mission's height above home. Without it, or where nothing was flown at it, all above half of the height
        that was flown most counts. Where only altitudes above the sea are known, nobody knows how high home is: what
        was flown most is taken for the mission's height.
    way : array of float64 (k, 3), optional
        Longitude, latitude and height above home of what was to be flown, in order, where it is not at one height: over
        terrain, say; a row of NaN parts what is above different homes. The mission's height is then that of the nearest
        place on it, and `altitude_m` the height above the ground.
    heights_m : sequence of float
        Heights of several vehicles at once, each as good as the other; where only altitudes above the sea are known all
        above half of what was flown most counts.

    Raises
    ------
    LogError
        When no sample lies inside the grid; says how far away the nearest is.
    """
    cell = grid.cell_at(samples.lon_deg, samples.lat_deg)
    inside = cell != OUTSIDE
    if not inside.any():
        raise LogError(_elsewhere(samples, grid))
    from_home = bool(np.isfinite(samples.height_m).any())
    height_m = samples.height_m if from_home else _above_ground_m(samples.alt_m)
    unknown = np.isnan(height_m)
    if unknown.all():
        return MissionPart(np.ones(cell.size, dtype=np.bool_), cell, ())
    if way is not None:
        return _along_the_way(
            samples, height_m if from_home else samples.alt_m, cell, altitude_m, way, from_home=from_home
        )
    usual_m = _mode(height_m[~unknown])
    airborne = unknown | (height_m >= _AIRBORNE * usual_m) | (usual_m < LEAST_BAND_M)
    if altitude_m is None:
        return MissionPart(airborne, cell, ())
    if len(heights_m) > 1:
        if not from_home:
            return MissionPart(airborne, cell, ())
        bands = [np.abs(height_m - one_m) <= max(BAND * one_m, LEAST_BAND_M) for one_m in heights_m]
        in_band = unknown | np.any(bands, axis=0)
    else:
        half_m = max(BAND * altitude_m, LEAST_BAND_M)
        in_band = unknown | (np.abs(height_m - (altitude_m if from_home else usual_m)) <= half_m)
    if 2 * (in_band & inside).sum() >= (airborne & inside).sum():
        return MissionPart(in_band, cell, ())
    warning = (
        f"the mission was planned at {altitude_m:g} m above home, but most of it was flown at about {usual_m:.0f} m: "
        "all samples above half of that height were taken"
    )
    return MissionPart(airborne, cell, (warning,))


def _along_the_way(
    samples: Samples,
    height_m: NDArray[np.float64],
    cell: NDArray[np.int64],
    altitude_m: float | None,
    way: NDArray[np.float64],
    *,
    from_home: bool,
) -> MissionPart:
    unknown = np.isnan(height_m)
    above_m = _above_the_way(way, samples, height_m, from_home=from_home)
    if not from_home:  # above the sea: most of the log is the mission
        above_m = above_m - np.nanmedian(above_m)
    half_m = max(BAND * altitude_m, LEAST_BAND_M) if altitude_m is not None else WAY_BAND_M
    in_band = unknown | (np.abs(above_m) <= half_m)
    low_m = half_m / BAND * _AIRBORNE
    airborne = unknown | (above_m >= -low_m)
    inside = cell != OUTSIDE
    if 2 * (in_band & inside).sum() >= (airborne & inside).sum():
        return MissionPart(in_band, cell, ())
    warning = (
        f"most of the flight was not within {half_m:g} m of the heights that the mission was planned at: all samples "
        f"above {low_m:g} m below them were taken"
    )
    return MissionPart(airborne, cell, (warning,))


def _above_the_way(
    way: NDArray[np.float64], samples: Samples, height_m: NDArray[np.float64], *, from_home: bool
) -> NDArray[np.float64]:
    """Return how far above the way samples are; where parts of it lie side by side, above that nearest in height."""
    gaps = np.isnan(way[:, 0])
    parts = [part[~np.isnan(part[:, 0])] for part in np.split(way, np.flatnonzero(gaps))]
    on = [_nearest_on(part, samples.lon_deg, samples.lat_deg) for part in parts if np.isfinite(part[:, 0]).any()]
    above_m = height_m - np.array([height for height, _ in on])
    away_m = np.array([away for _, away in on])
    beside = away_m <= away_m.min(axis=0) + (SIDE_BY_SIDE_M if from_home else 0.0)
    best = np.where(beside, np.abs(np.nan_to_num(above_m, nan=0.0)), np.inf).argmin(axis=0)
    return np.asarray(np.take_along_axis(above_m, best[None], axis=0)[0], dtype=np.float64)


def heights_on(
    way: NDArray[np.float64], lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the height of the nearest place on a way, straight between its points.

    Parameters
    ----------
    way : array of float64 (k, 3)
        Longitude, latitude, height; one point or more.
    lon_deg, lat_deg : arrays of float64 (n,)

    Examples
    --------
    >>> way = np.array([[51.50, 25.3, 40.0], [51.51, 25.3, 60.0]])
    >>> heights_on(way, np.array([51.49, 51.505]), np.array([25.3, 25.301])).round(6).tolist()
    [40.0, 50.0]
    """
    return _nearest_on(way, lon_deg, lat_deg)[0]


def _nearest_on(
    way: NDArray[np.float64], lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the height of the nearest place on a way, and how far away it is, metres."""
    plane = LocalPlane(float(way[0, 0]), float(way[0, 1]))
    turns, at = plane.metres(way[:, 0], way[:, 1]), plane.metres(lon_deg, lat_deg)
    nearest = np.hypot(*(at - turns[0]).T)
    height = np.full(at.shape[0], way[0, 2])
    pairs = zip(turns[:-1], turns[1:], way[:-1, 2], way[1:, 2], strict=True) if len(way) > 1 else ()
    for start, end, from_m, to_m in pairs:
        step = end - start
        length2 = float(step @ step)
        share = np.clip((at - start) @ step / length2, 0.0, 1.0) if length2 > 0 else np.zeros(at.shape[0])
        away = np.hypot(*(at - start - share[:, None] * step).T)
        nearer = away < nearest
        nearest[nearer] = away[nearer]
        height[nearer] = (from_m + share * (to_m - from_m))[nearer]
    return height, nearest


def missed_stops(stops: NDArray[np.int64], visited: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the planned cells in which nothing was measured, in flight order."""
    return stops[~np.isin(stops, visited)]


def _above_ground_m(alt_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return heights above the lowest place, where only altitudes above the sea are known."""
    known = alt_m[np.isfinite(alt_m)]
    return alt_m - (known.min() if known.size else 0.0)


def _mode(height_m: NDArray[np.float64]) -> float:
    """Return the height around which most samples above the ground lie."""
    ordered = np.sort(height_m)
    above = ordered[ordered > LEAST_BAND_M]
    if above.size == 0:
        return float(ordered[-1])
    inside = np.searchsorted(above, above + _MODE_WIDTH_M, side="right") - np.arange(above.size)
    first = int(np.argmax(inside))
    return float(np.median(above[first : first + inside[first]]))


def _elsewhere(samples: Samples, grid: Grid) -> str:
    if samples.lon_deg.size == 0:
        return "the log holds no sample with a position; record the vehicle's position and the sensor together"
    lon, lat = grid.centres_deg(grid.size // 2 + grid.shape[1] // 2)
    metres = distance_m(samples.lon_deg, samples.lat_deg, lon, lat)
    near = int(np.argmin(metres))
    return (
        f"none of the {samples.lon_deg.size} samples lies in the mission's box {grid.box.as_tuple()}: the nearest is "
        f"at {samples.lon_deg[near]:.5f} {samples.lat_deg[near]:.5f}, {metres[near] / 1000:.1f} km from its middle; "
        "give the mission that was flown"
    )
