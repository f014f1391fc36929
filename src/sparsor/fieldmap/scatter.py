"""Passes through one cell put together, and what they tell of a cell that is not the same everywhere."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

FEWEST_REPEATS: Final = 5
"""Fewer passes through cells that had one already tell nothing of the scatter between them."""
_LEAST_VARIANCE = 1e-9  # of the largest


def between_passes(cell: NDArray[np.int64], value: NDArray[np.float64], variance: NDArray[np.float64]) -> float:
    """Return the variance between passes of one cell beyond their own; 0 where too few repeats tell it.

    The moment estimator of DerSimonian and Laird (1986) over all cells: another place in the cell, or another air.

    Parameters
    ----------
    cell : array of int64 (p,)
    value, variance : array of float64 (p,)
    """
    numbered, weight, mean = _grouped(cell, value, variance)
    if cell.size - mean.size < FEWEST_REPEATS:
        return 0.0
    sums = np.bincount(numbered, weight)

    def spread_of(variances: NDArray[np.float64]) -> float:
        """Return the weighted squares around the cells' means that passes of these variances would have."""
        return float((weight * variances).sum() - (np.bincount(numbered, weight**2 * variances) / sums).sum())

    squares = float((weight * np.square(value - mean[numbered])).sum())
    return max((squares - spread_of(variance)) / spread_of(np.ones_like(variance)), 0.0)


def by_cell(
    cell: NDArray[np.int64], values: NDArray[np.float64], variance: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the cells, ascending, with the mean of their passes weighted by variance, and its variance.

    Parameters
    ----------
    cell : array of int64 (p,)
    values : array of float64 (p, ...)
    variance : array of float64 (p,)
    """
    numbered, weight, _ = _grouped(cell, variance, variance)
    cells, sums = np.unique(cell), np.bincount(numbered, weight)
    flat = values.reshape(cell.size, -1)
    mean = np.zeros((cells.size, flat.shape[1]))
    np.add.at(mean, numbered, weight[:, None] * flat)
    mean /= sums[:, None]
    left = np.bincount(numbered, weight**2 * variance) / sums**2
    return cells, mean.reshape(cells.size, *values.shape[1:]), left


def _grouped(
    cell: NDArray[np.int64], value: NDArray[np.float64], variance: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the number of each pass's cell, the weight of each pass, and the weighted mean of each cell."""
    _, numbered = np.unique(cell, return_inverse=True)
    largest = float(variance.max(initial=0.0))
    # Readings without noise count alike.
    weight = 1.0 / np.maximum(variance / largest, _LEAST_VARIANCE) if largest > 0 else np.ones_like(variance)
    mean = np.bincount(numbered, weight * value) / np.bincount(numbered, weight)
    return numbered.astype(np.int64), weight, mean
