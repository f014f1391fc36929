"""How much of a planned route a flight covered, and what is left of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.fieldmap.path import LONGEST_PAUSE_S
from sparsor.geodesy.lengths import distance_m

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.flightlog import Samples
    from sparsor.geodesy import Grid

ALIGNED: Final = 0.9
"""Cosine of the angle to a leg, either way along it, above which it is that leg that is flown."""
BESIDE_CELLS: Final = 0.25
"""Farther from a leg than this another one is flown, or none."""
LEAST_BESIDE_M: Final = 5.0
LEAST_HEIGHT_M: Final = 2.0
"""Above home, from which a vehicle is in the air."""


@dataclass(frozen=True, eq=False)
class Covered:
    """What was flown of a route.

    Parameters
    ----------
    length_m : float
        Of the route's legs, each part counted once.
    total_m : float
        Of the whole route.
    left : array of int64
        Cells of the route's parts that are left, joined in its order; empty where none is.
    """

    length_m: float
    total_m: float
    left: NDArray[np.int64]


def covered(grid: Grid, route: NDArray[np.int64], samples: Samples, flying: NDArray[np.bool_]) -> Covered:
    """Return what samples say was flown along a route.

    A sample counts for the leg nearest to it that runs as the vehicle went, and stands for the way halfway to its
    neighbours; gaps below a cell are closed. So the ways from and to home do not count, nor what is flown twice.

    Parameters
    ----------
    grid : Grid
    route : array of int64 (n,)
        Cells of the stops in flight order.
    samples : Samples
    flying : array of bool
        Which of them are of the mission: at its height and inside the grid.
    """
    cell_m = np.array([grid.box.east_m / grid.shape[1], grid.box.north_m / grid.shape[0]])
    corners = np.stack(np.divmod(route, grid.shape[1])[::-1], axis=1) * cell_m  # east, south
    lon, lat = grid.centres_deg(route)
    geodesic_m = distance_m(lon[:-1], lat[:-1], lon[1:], lat[1:])
    row, column = grid.position_of(samples.lon_deg[flying], samples.lat_deg[flying])
    places = np.column_stack((column, row)) * cell_m
    course, reach_m = _course(places, samples.time_s[flying], samples.boot[flying])
    start, way = corners[:-1], np.diff(corners, axis=0)
    length_m = np.hypot(*way.T)
    unit = way / np.maximum(length_m, 1e-9)[:, None]
    apart = places[:, None] - start
    along = np.einsum("nkc,kc->nk", apart, unit)
    beside = np.abs(apart[:, :, 0] * unit[:, 1] - apart[:, :, 1] * unit[:, 0])
    widest_m = max(BESIDE_CELLS * float(cell_m.max()), LEAST_BESIDE_M)
    standing = np.hypot(*course.T) == 0
    aligned = (np.abs(course @ unit.T) >= ALIGNED) | standing[:, None]
    near = (beside <= widest_m) & (along >= -widest_m) & (along <= length_m + widest_m)
    on = np.logical_and(near, aligned)
    nearest = np.where(on, beside, np.inf).argmin(axis=1) if length_m.size else np.zeros(len(places), dtype=np.intp)
    flown_m, left = 0.0, [np.zeros(0, dtype=np.int64)]
    for leg in range(length_m.size):
        mine = (nearest == leg) & on[:, leg]
        free = _gaps(along[mine, leg], reach_m[mine], float(length_m[leg]), float(cell_m.max()))
        open_m = sum(end - begin for begin, end in free)
        flown_m += float(geodesic_m[leg]) * (1 - open_m / float(length_m[leg])) if length_m[leg] else 0.0
        for ends in free:
            at = np.rint((start[leg] + np.outer(ends, unit[leg])) / cell_m).astype(np.int64)
            left.append(at[:, 1] * grid.shape[1] + at[:, 0])
    cells = np.concatenate(left)
    return Covered(flown_m, float(geodesic_m.sum()), cells[np.append(True, np.diff(cells) != 0)[: cells.size]])


def air_seconds(samples: Samples) -> float:
    """Return the time in the air, seconds; of a vehicle that stays on the ground, all of it."""
    up = np.isnan(samples.height_m) | (samples.height_m >= LEAST_HEIGHT_M)
    if not up.any():
        up[:] = True
    passed = np.diff(samples.time_s)
    together = (np.diff(samples.boot) == 0) & (passed > 0) & up[:-1] & up[1:]
    return float(passed[together].sum())


def _course(
    places: NDArray[np.float64], time_s: NDArray[np.float64], boot: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the direction of the way at each place, 0 where it stood, and half the way to its farther neighbour."""
    step = np.diff(places, axis=0)
    passed = np.diff(time_s)
    step[(np.diff(boot) != 0) | (passed > LONGEST_PAUSE_S) | (passed < 0)] = 0.0
    nothing = np.zeros((1, 2))
    before, after = np.concatenate((nothing, step)), np.concatenate((step, nothing))
    way = before + after if len(places) else nothing[:0]
    length = np.hypot(*way.T)[:, None]
    reach_m = np.maximum(np.hypot(*before.T), np.hypot(*after.T)) / 2
    return np.divide(way, length, out=np.zeros_like(way), where=length > 0), reach_m[: len(places)]


def _gaps(
    along: NDArray[np.float64], reach_m: NDArray[np.float64], length_m: float, least_m: float
) -> list[tuple[float, float]]:
    """Return the stretches of a leg, longer than `least_m`, that nothing reaches."""
    order = np.argsort(along - reach_m)
    low, high = (along - reach_m)[order], (along + reach_m)[order]
    reached = np.maximum.accumulate(np.concatenate(([0.0], high)))
    nextly = np.append(np.maximum(low, 0.0), length_m)
    return [
        (float(begin), float(min(end, length_m)))
        for begin, end in zip(reached, nextly, strict=True)
        if min(end, length_m) - begin > least_m
    ]
