"""The expected error of a route: the trace of the posterior covariance, updated as cells come and go.

A map is ``a + F x`` with ``x ~ N(0, I)``, an unknown level a, and what the factor F leaves, which is independent from
cell to cell (Quinonero-Candela & Rasmussen 2005, section 6). Readings add up in the information matrix of x and a, so
the error of any set of cells costs no more than the rank of F allows, and a change of k cells is an update of rank k.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray  # noqa: TC002

from sparsor.core.compiled import njit
from sparsor.design.refined.dense import inner_products, inverse_root, solve

LEVEL_VARIANCE = 100.0  # of the map's own: as good as unknown
_LEAST_NOISE = 1e-6  # of the map's variance


class Belief(NamedTuple):
    """What is known of maps before the flight.

    Parameters
    ----------
    factor : array of float64 (N, r + 1)
        Components of the covariance, then a column of ones for the level, and one for the sensor's zero, where they
        are unknown; 0 outside the area.
    spread : array of float64 (r + 1,)
        Variance of each coefficient.
    size : array of float64 (r + 1,)
        Mean square of each column over the cells that count; 0 for the sensor's zero, which is no part of the map.
    residual : array of float64 (N,)
        Variance of a cell around what the factor says.
    allowed : array of bool (N,)
        Cells that may be flown.
    """

    factor: NDArray[np.float64]
    spread: NDArray[np.float64]
    size: NDArray[np.float64]
    residual: NDArray[np.float64]
    allowed: NDArray[np.bool_]


def belief(
    covariance: NDArray[np.float64],
    allowed: NDArray[np.bool_],
    *,
    mapped: NDArray[np.bool_] | None = None,
    rank: int = 96,
    least: float = 0.0,
    level_variance: float = LEVEL_VARIANCE,
    zero_variance: float = 0.0,
) -> Belief:
    """Return the leading components of a covariance as the search needs them.

    Parameters
    ----------
    covariance : array of float64 (N, N)
        Of differences from the map's mean; mean variance 1 over the cells that count.
    allowed : array of bool (N,)
        Cells that may be flown.
    mapped : array of bool (N,), optional
        Cells that count; default: those that may be flown.
    rank : int
        Most components.
    least : float
        Components of less variance, over all cells together, are left out.
    level_variance : float
        Of the level, which the covariance says nothing of; 0 where it does: then there is no column for it.
    zero_variance : float
        Of what the sensor shows too much, the same in all readings of a flight; 0 where its zero is that of the map's
        level.
    """
    cells = np.flatnonzero(allowed if mapped is None else mapped)
    values, vectors = np.linalg.eigh(covariance[np.ix_(cells, cells)])
    leading = values.argsort()[::-1][:rank]
    telling = values[leading] > max(_LEAST_NOISE * values.max(), least)
    telling[0] |= level_variance == 0  # something has to be left to tell
    leading = leading[telling]
    # The signs that LAPACK gives are its own; they do not change any result.
    inside = vectors[:, leading] * np.sqrt(np.maximum(values[leading], 0.0))
    left = np.maximum(covariance.diagonal()[cells] - np.square(inside).sum(axis=1), 0.0)
    shared = np.array([level_variance, zero_variance])
    factor = np.zeros((allowed.size, leading.size + np.count_nonzero(shared)))
    factor[cells, : leading.size] = inside
    factor[cells, leading.size :] = 1.0
    residual = np.zeros(allowed.size)
    residual[cells] = left + _LEAST_NOISE
    spread = np.append(np.ones(leading.size), shared[shared > 0])
    size = np.square(factor).sum(axis=0) / cells.size
    size[size.size - int(zero_variance > 0) :] = 0.0
    return Belief(factor, spread, size, residual, allowed)


@njit(cache=True, nogil=True)
def posterior_root(prior: Belief, rows: NDArray[np.float64], precision: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lower triangular R with ``R.T @ R`` the covariance of the coefficients after readings, (r+1, r+1).

    Parameters
    ----------
    prior : Belief
    rows : array of float64 (n, r + 1)
        Of the factor, as each reading mixes it.
    precision : array of float64 (n,)
    """
    scaled = np.empty((prior.spread.size, precision.size))
    for k in range(precision.size):
        scale = np.sqrt(precision[k])
        for j in range(prior.spread.size):
            scaled[j, k] = scale * rows[k, j]
    information = np.dot(scaled, scaled.T)
    for j in range(prior.spread.size):
        information[j, j] += 1 / prior.spread[j]
    return inverse_root(information)


@njit(cache=True, nogil=True)
def root_error(prior: Belief, root: NDArray[np.float64]) -> float:
    """Return the mean posterior variance over the cells that count, less what no reading explains."""
    total = 0.0
    for k in range(root.shape[0]):
        for i in range(k + 1):
            total += prior.size[i] * root[k, i] ** 2
    return total


@njit(cache=True, nogil=True)
def changed(
    prior: Belief, covariance: NDArray[np.float64], rows: NDArray[np.float64], difference: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Return what a change of readings does to the expected error, and the update that makes it.

    By the Woodbury identity the posterior covariance P becomes ``P - left.T @ inv(inner) @ left``.

    Parameters
    ----------
    prior : Belief
    covariance : array of float64 (r + 1, r + 1)
    rows : array of float64 (k, r + 1)
    difference : array of float64 (k,)
        Of their precision; below 0 where readings are taken away.
    """
    left = np.dot(rows, covariance)
    inner = inner_products(left, rows)
    for i in range(difference.size):
        inner[i, i] += 1 / difference[i]
    explained = solve(inner, inner_products(left * prior.size, left))
    return -float(np.trace(explained)), left, inner
