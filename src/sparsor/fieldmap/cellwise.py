"""The passes of a flight put together cell by cell: the drift taken off, the scatter between the passes added."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.design.decoders.measurements import Measurements
from sparsor.fieldmap.drift import NO_DRIFT, Drift, drift_at, drift_sd_at, estimate_drift, slope_variance
from sparsor.fieldmap.scatter import between_passes, by_cell

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.fieldmap.observing import Observations, Passes
    from sparsor.fieldmap.response import Air, AirModel
    from sparsor.flightlog.sampling import Samples
    from sparsor.geodesy.grid import Grid


@dataclass(frozen=True, eq=False)
class InCells:
    """What the passes give together; names as in `Measured`."""

    measurements: Measurements
    cells: NDArray[np.int64]
    value: NDArray[np.float64]
    sd: NDArray[np.float64]
    drift: Drift
    scatter_sd: float


def in_cells(
    near: Samples,
    grid: Grid,
    model: AirModel,
    air: Air,
    passes: Passes,
    observations: Observations,
    drift_sd_per_h: float,
) -> InCells:
    """Take the drift off the passes, add the scatter between them, and put those of a cell together.

    Parameters
    ----------
    near : Samples
        From shortly before the mission to its end.
    grid : Grid
    model, air : AirModel, Air
        The sensor's response, and the air at the samples by it.
    passes : Passes
    observations : Observations
        The passes that tell something, as rows of weights.
    drift_sd_per_h : float
        To allow for where none can be told.
    """
    clock_s = _one_clock(near)
    pass_s = passes.mean(clock_s) if clock_s is not None else np.zeros(passes.cell.size)
    begin_s = float(pass_s.min())
    drift = NO_DRIFT
    if clock_s is not None:
        seen = observations.rows
        drift = estimate_drift(observations, pass_s[seen], passes.cell[seen], grid, model)
    off, off_sd = drift_at(drift, pass_s, begin_s), drift_sd_at(drift, drift_sd_per_h, pass_s, begin_s)
    value, variance = _pass_air(model, air, passes, observations)
    scatter = between_passes(passes.cell, value - off, variance)
    cells, cell_value, cell_variance = by_cell(passes.cell, value - off, variance + off_sd**2 + scatter)
    rows = observations.rows
    # Where in the cell a pass was is in the weights: only what the field's slope does not explain is noise.
    unexplained = max(scatter - slope_variance(model) * _displacement_m2(near, grid, passes), 0.0)
    _, of_cell, row_variance = by_cell(
        passes.cell[rows],
        np.column_stack((observations.value - off[rows], off_sd[rows], observations.weights)),
        observations.variance + unexplained,
    )
    return InCells(
        Measurements(of_cell[:, 2:], of_cell[:, 0], row_variance, of_cell[:, 1]),
        cells,
        cell_value,
        np.sqrt(cell_variance),
        drift,
        float(np.sqrt(scatter)),
    )


def _displacement_m2(near: Samples, grid: Grid, passes: Passes) -> float:
    """Return how far the passes of one cell lie apart in it: mean square east and north, from their middle."""
    row, column = grid.position_of(near.lon_deg, near.lat_deg)
    north_m = passes.mean(row) * (grid.box.north_m / grid.shape[0])
    east_m = passes.mean(column) * (grid.box.east_m / grid.shape[1])
    alike = np.ones(passes.cell.size)
    return between_passes(passes.cell, north_m, 0 * alike) + between_passes(passes.cell, east_m, 0 * alike)


def _pass_air(
    model: AirModel, air: Air, passes: Passes, observations: Observations
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean air of each pass and its variance; the readings' own mean where the sensor answers at once."""
    if model.tau_s == 0:
        return observations.value, observations.variance
    used = np.flatnonzero(passes.number >= 0)
    number = passes.number[used]
    first = used[np.searchsorted(number, np.arange(passes.cell.size))]
    last = used[np.searchsorted(number, np.arange(passes.cell.size), side="right") - 1]
    sums = np.concatenate(([0.0], np.cumsum(air.value)))
    return (sums[last + 1] - sums[first]) / (last - first + 1), air.mean_variance(first, last)


def _one_clock(samples: Samples) -> NDArray[np.float64] | None:
    """Return times that go on from boot to boot, or None where nothing tells how long a boot was after another."""
    if np.isfinite(samples.unix_s).all():
        return samples.unix_s
    return samples.time_s if np.unique(samples.boot).size == 1 else None
