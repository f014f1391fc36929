"""Covariances of maps up to their amplitude: of the training maps, and of the exponential kernel.

The level of a map is unknown, so only contrasts count: every covariance is centred over the cells that count and
scaled to a mean variance of 1 there. A decoder multiplies it by the square of the amplitude it estimates.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.prior.statistics import Kernel, fit_kernel, unit_shapes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.prior.model import Model

# Mean distance between a point of a unit square and another one: how far a reading is from its cell's mean.
_MEAN_DISTANCE_IN_CELL = 0.5214
_LEAST_RESIDUAL = 1e-6  # of the maps' variance: what single precision leaves


def kernel_covariance(shape: tuple[int, int], kernel: Kernel, allowed: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the kernel's covariance between all cells, (N, N), centred and scaled over the allowed cells."""
    return contrasts(_kernel_matrix(shape, kernel), allowed)


def unit_kernel(kernel: Kernel, shape: tuple[int, int], allowed: NDArray[np.bool_]) -> Kernel:
    """Return the kernel scaled as `kernel_covariance` is: maps drawn from it have a mean variance of 1."""
    matrix = _kernel_matrix(shape, kernel)
    scale = contrast_variance(matrix, allowed)
    return Kernel(kernel.variance / scale, kernel.length_cells, kernel.nugget / scale)


def training_covariance(model: Model, allowed: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the covariance of the training maps' shapes and their mirror images, (N, N), centred and scaled.

    What the factor's components leave of the validation maps is added as an exponential kernel fitted to it.
    """
    factor = model.covariance_factor
    leading = contrasts(with_symmetries(factor @ factor.T, model.shape), allowed)
    share, residual = _residual(model)
    if share <= _LEAST_RESIDUAL:
        return leading
    return (1 - share) * leading + share * kernel_covariance(model.shape, residual, allowed)


def contrasts(covariance: NDArray[np.float64], allowed: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return a covariance of differences from the map's mean, scaled to a mean variance of 1 (allowed cells)."""
    towards_mean = covariance[:, allowed].mean(axis=1)
    centred = covariance - towards_mean[:, None] - towards_mean + towards_mean[allowed].mean()
    return np.asarray(centred / contrast_variance(covariance, allowed))


def contrast_variance(covariance: NDArray[np.float64], allowed: NDArray[np.bool_]) -> float:
    """Return the mean variance around the map's own mean that a covariance stands for (allowed cells)."""
    inside = covariance[np.ix_(allowed, allowed)]
    return float(inside.diagonal().mean() - inside.mean())


def within_cell_variance(model: Model, allowed: NDArray[np.bool_]) -> float:
    """Return the variance of a reading at a point around its cell's mean, for maps of amplitude 1.

    From the kernel: half the mean squared difference between two points of one cell.
    """
    kernel = unit_kernel(model.kernel, model.shape, allowed)
    return float(-kernel.variance * np.expm1(-_MEAN_DISTANCE_IN_CELL / kernel.length_cells) + kernel.nugget)


def _kernel_matrix(shape: tuple[int, int], kernel: Kernel) -> NDArray[np.float64]:
    rows, columns = shape
    table = kernel.variance * np.exp(-np.hypot(*np.indices(shape)) / kernel.length_cells)
    table[0, 0] += kernel.nugget
    row, column = (np.abs(np.subtract.outer(np.arange(side), np.arange(side))) for side in (rows, columns))
    return np.asarray(table[row[:, None, :, None], column[None, :, None, :]].reshape(rows * columns, -1))


def with_symmetries(covariance: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.float64]:
    """Return the mean of a covariance over the grid's symmetries: mirror images and, if square, transposition."""
    block = covariance.reshape(*shape, *shape)
    total = block + block[::-1, :, ::-1, :]
    total = total + total[:, ::-1, :, ::-1]
    if shape[0] == shape[1]:
        total = total + total.transpose(1, 0, 3, 2)
    return np.asarray(total.reshape(covariance.shape))


def _residual(model: Model) -> tuple[float, Kernel]:
    """Return the share of the validation maps' variance outside the factor's span, and a kernel fitted to it."""
    basis = np.column_stack([np.ones(model.mean.size), model.covariance_factor])
    axes, spread, _ = np.linalg.svd(basis, full_matrices=False)
    axes = axes[:, spread > _LEAST_RESIDUAL * spread[0]]
    shapes = unit_shapes(model.validation, np.ones(model.mean.size, dtype=np.bool_))
    left = shapes - (shapes @ axes) @ axes.T
    share = float(np.square(left).mean())
    return (share, fit_kernel(left, model.shape)) if share > _LEAST_RESIDUAL else (0.0, model.kernel)
