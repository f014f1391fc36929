"""Decoded maps between the centres of cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.prior.statistics import Kernel


def fine_centres(side: int, factor: int) -> NDArray[np.float64]:
    """Return the centres of `factor` parts of each of `side` cells; cell centres are 0, 1, 2, ...

    Examples
    --------
    >>> fine_centres(2, 2).tolist()
    [-0.25, 0.25, 0.75, 1.25]
    """
    return np.asarray((np.arange(side * factor) + 0.5) / factor - 0.5)


def kernel_sum(
    kernel: Kernel, sources: NDArray[np.float64], shape: tuple[int, int], factor: int
) -> NDArray[np.float64]:
    """Return the sum of the kernel, less its nugget, around each cell times `sources`, (N,), on a finer grid.

    Returns
    -------
    array of float64 (N * factor**2,)
        Row-major, north first, of ``rows * factor`` rows.
    """
    used = np.flatnonzero(sources)
    row, column = np.divmod(used, shape[1])
    across = np.square(fine_centres(shape[1], factor)[:, None] - column)
    lines = [
        np.exp(-np.sqrt(np.square(at - row) + across) / kernel.length_cells) @ sources[used]
        for at in fine_centres(shape[0], factor)
    ]
    return np.asarray(kernel.variance * np.concatenate(lines))


def upsampled(values: NDArray[np.float64], shape: tuple[int, int], factor: int) -> NDArray[np.float64]:
    """Return values of cells (N,) interpolated bilinearly on a finer grid, (N * factor**2,).

    Beyond the outermost centres the last slope goes on.
    """
    grid = values.reshape(shape)
    down, across = (_interpolation(side, factor) for side in shape)
    return np.asarray((down @ grid @ across.T).ravel())


def _interpolation(side: int, factor: int) -> NDArray[np.float64]:
    if side == 1:
        return np.ones((factor, 1))
    at = fine_centres(side, factor)
    low = np.clip(np.floor(at).astype(np.int64), 0, side - 2)
    matrix = np.zeros((at.size, side))
    place = np.arange(at.size)
    matrix[place, low] = 1 - (at - low)
    matrix[place, low + 1] = at - low
    return matrix
