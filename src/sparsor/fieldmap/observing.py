"""Which air each reading is of: the cells that a slow sensor has breathed, and in which shares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.core.compiled import njit
from sparsor.fieldmap.kalman import response_shares
from sparsor.fieldmap.mission_part import OUTSIDE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.fieldmap.path import Path
    from sparsor.fieldmap.response import Air, AirModel
    from sparsor.geodesy.grid import Grid

MOST_FROM_OUTSIDE: Final = 0.5
"""A pass whose readings hold more air from outside the mission than this is not a measurement of it."""

_DIGITS = 6  # in cells: a place in the middle of a cell has no share of the others


@dataclass(frozen=True, eq=False)
class Passes:
    """Runs of samples inside one cell, one behind the other.

    Parameters
    ----------
    number : array of int64 (n,)
        The pass of each sample; -1 for samples that are not used.
    cell : array of int64 (p,)
        In which each pass was made.
    count : array of int64 (p,)
        Samples used of each.
    """

    number: NDArray[np.int64]
    cell: NDArray[np.int64]
    count: NDArray[np.int64]

    def mean(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean of the samples' values of each pass."""
        used = self.number >= 0
        return np.bincount(self.number[used], values[used], self.cell.size) / self.count


def passes_of(cell: NDArray[np.int64], start: NDArray[np.bool_], used: NDArray[np.bool_]) -> Passes:
    """Divide the used samples into passes; a sample that is not used does not end one.

    Parameters
    ----------
    cell : array of int64 (n,)
    start, used : array of bool (n,)
    """
    begins = start.copy()
    begins[1:] |= cell[1:] != cell[:-1]
    run = np.cumsum(begins) - 1
    kept, numbered = np.unique(run[used], return_inverse=True)
    number = np.full(cell.size, -1, dtype=np.int64)
    number[used] = numbered
    first = np.searchsorted(run, kept)
    return Passes(number, cell[first], np.bincount(numbered, minlength=kept.size).astype(np.int64))


@dataclass(frozen=True, eq=False)
class Places:
    """Samples between the middles of cells.

    Parameters
    ----------
    cells : array of int64 (n, 4)
        The cells whose middles lie around each; `OUTSIDE` where the air is not the mission's.
    shares : array of float64 (n, 4)
        Bilinear; a row sums to 1.
    """

    cells: NDArray[np.int64]
    shares: NDArray[np.float64]


def places_of(
    grid: Grid, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64], on_it: NDArray[np.bool_]
) -> Places:
    """Return where samples lie; those at the edge of the grid count as of the cells inside it.

    Parameters
    ----------
    grid : Grid
    lon_deg, lat_deg : array of float64 (n,)
    on_it : array of bool (n,)
        Whether the air is the mission's.
    """
    row, column = grid.position_of(lon_deg, lat_deg)
    row, column = np.clip(row, 0, grid.shape[0] - 1), np.clip(column, 0, grid.shape[1] - 1)
    top = np.minimum(row.astype(np.int64), grid.shape[0] - 2)
    left = np.minimum(column.astype(np.int64), grid.shape[1] - 2)
    down, right = np.round(row - top, _DIGITS), np.round(column - left, _DIGITS)
    first = top * grid.shape[1] + left
    cells = np.stack((first, first + 1, first + grid.shape[1], first + grid.shape[1] + 1), axis=1)
    shares = np.stack(((1 - down) * (1 - right), (1 - down) * right, down * (1 - right), down * right), axis=1)
    return Places(np.where(on_it[:, None], cells, OUTSIDE), shares)


@dataclass(frozen=True, eq=False)
class Observations:
    """What the passes say of the cells: ``value = weights @ cells + noise``.

    Parameters
    ----------
    weights : array of float64 (p, N)
        Shares of the cells' air in each; a row sums to 1.
    value, variance : array of float64 (p,)
    rows : array of int64 (p,)
        Numbers of the passes; those that hold too much other air are left out.
    """

    weights: NDArray[np.float64]
    value: NDArray[np.float64]
    variance: NDArray[np.float64]
    rows: NDArray[np.int64]


def observe(
    model: AirModel,
    air: Air,
    path: Path,
    reading: NDArray[np.float64],
    places: Places,
    passes: Passes,
    grid: Grid,
) -> Observations:
    """Return the passes' mean readings with the shares of the cells that their air came from.

    To undo the response first and hand on the air would hand on errors that neighbours share; the readings' own noise
    is independent, and the decoder undoes the response together with everything else. Air from outside the
    mission (another height, outside the grid, before the log) is taken off as `air` has it.

    Parameters
    ----------
    model : AirModel
    air : Air
    path : Path
    reading : array of float64 (n,)
    places : Places
    passes : Passes
    grid : Grid
    """
    weights, other, other_sd, share = _shares(
        path.duration_s,
        path.start,
        model.tau_s,
        places.cells,
        places.shares,
        passes.number,
        passes.cell.size,
        grid.size,
        air.value,
        np.sqrt(air.variance),
        air.reading,
        np.sqrt(air.reading_variance),
    )
    count = passes.count
    own = 1.0 - share / count
    rows = np.flatnonzero(own >= 1.0 - MOST_FROM_OUTSIDE)
    value = (passes.mean(reading) - other / count)[rows] / own[rows]
    variance = (model.noise_sd**2 / count + (other_sd / count) ** 2)[rows] / own[rows] ** 2
    shares = weights[rows] / weights[rows].sum(axis=1, keepdims=True)
    variance += interpolation_variance(grid, model) * np.square(shares).sum(axis=1)
    return Observations(shares, value, variance, rows)


def interpolation_variance(grid: Grid, model: AirModel) -> float:
    """Return the variance of the air at a place around what the cells about it say, linearly.

    Half-way between two points h apart it is ``spread^2 (rate h)^3 / 12`` for the Matern-3/2 kernel; this is its like
    over all places, east and north.
    """
    east, north = (model.rate * side for side in _cell_sides_m(grid))
    return min((east**3 + north**3) / 24.0, 1.0) * model.spread**2


def _cell_sides_m(grid: Grid) -> tuple[float, float]:
    return grid.box.east_m / grid.shape[1], grid.box.north_m / grid.shape[0]


@njit(cache=True, nogil=True)
def _shares(
    duration_s: NDArray[np.float64],
    start: NDArray[np.bool_],
    tau_s: float,
    near: NDArray[np.int64],
    near_share: NDArray[np.float64],
    number: NDArray[np.int64],
    passes: int,
    cells: int,
    air: NDArray[np.float64],
    air_sd: NDArray[np.float64],
    held: NDArray[np.float64],
    held_sd: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Add up over each pass what the sensor holds: shares of the cells, and what it holds of other air."""
    weights = np.zeros((passes, cells))
    other, other_sd, share = np.zeros(passes), np.zeros(passes), np.zeros(passes)
    inside = np.zeros(cells)
    out, out_sd, out_share = 0.0, 0.0, 0.0
    for i in range(number.size):
        if start[i] and tau_s > 0:
            inside[:] = 0.0
            out, out_sd, out_share = held[i], held_sd[i], 1.0
        else:
            kept, before, after = response_shares(duration_s[i], tau_s)
            inside *= kept
            out, out_sd, out_share = out * kept, out_sd * kept, out_share * kept
            for j, part in ((i - 1, before), (i, after)):
                if part == 0.0:
                    continue
                if near[j, 0] == OUTSIDE:
                    out += part * air[j]
                    out_sd += part * air_sd[j]
                    out_share += part
                else:
                    for corner in range(4):
                        inside[near[j, corner]] += part * near_share[j, corner]
        k = number[i]
        if k >= 0:
            weights[k] += inside
            other[k] += out
            other_sd[k] += out_sd
            share[k] += out_share
    return weights, other, other_sd, share
