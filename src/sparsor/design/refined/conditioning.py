"""What is left to know of maps that were measured already: the covariance given readings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cholesky, solve_triangular

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design.decoders.noise import Noise


def conditioned(
    covariance: NDArray[np.float64], level_variance: float, rows: NDArray[np.float64], noise: Noise
) -> NDArray[np.float64]:
    """Return the covariance of maps given readings of them, their level included, (N, N).

    Of a map ``a + f`` with ``a ~ N(0, level_variance)`` and ``f ~ N(0, covariance)``, read as ``rows (a + f) + e``
    (Rasmussen & Williams 2006, equation 2.24). What the readings leave of the level is in every entry.

    Parameters
    ----------
    covariance : array of float64 (N, N)
        Of differences from the map's mean.
    level_variance : float
    rows : array of float64 (m, N)
        Weights of the cells in each reading; each row sums to 1.
    noise : Noise
        Of the readings, m of them, in the unit of `covariance`.
    """
    before = covariance + level_variance
    towards = rows @ before
    root = cholesky(towards @ rows.T + noise.covariance, lower=True)
    explained = solve_triangular(root, towards, lower=True)
    after = before - explained.T @ explained
    return np.asarray((after + after.T) / 2)
