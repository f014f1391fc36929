"""Greedy informative path planning: always on to the cell that tells a Gaussian process most for the way there.

As Marchant & Ramos (2014) and Hollinger & Sukhatme (2014) plan, with the information gain of one reading,
``1/2 log(1 + variance / noise)``, over the length of the leg; the gains along a route sum to
``1/2 log det(I + K / noise)``. The kernel is the one whose route and predictions serve the validation maps best.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from sparsor.core.metrics import squared_error
from sparsor.errors import BudgetError, DesignError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from sparsor.design import Budget, LegTable

DECAYS = (2.0, 4.0, 8.0, 16.0, 32.0)
# The noise that the gain is planned with sets how far a step is: with little, the cell next door tells enough.
NOISES = (1e-3, 1e-2, 1e-1, 1.0)
_PREDICTING = (1e-3, 1e-2, 1e-1)
_ROOT3 = float(np.sqrt(3.0))
# Of the grid's sides: the centre, a corner's middle, half-way along a side.
_BEGINNINGS = ((0.5, 0.5), (0.15, 0.15), (0.15, 0.5), (0.5, 0.15))

KERNELS: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    "exponential": lambda d: np.exp(-d),
    "matern32": lambda d: (1 + _ROOT3 * d) * np.exp(-_ROOT3 * d),
    "gaussian": lambda d: np.exp(-0.5 * np.square(d)),
}


@dataclass(frozen=True)
class GaussianProcess:
    """A stationary Gaussian process of variance 1 with an unknown level.

    Parameters
    ----------
    kernel : str
        A name in `KERNELS`.
    decay : float
        Its length, cell units.
    noise : float
        Variance of a reading that routes are planned with.
    """

    kernel: str
    decay: float
    noise: float

    def covariance(self, shape: tuple[int, int]) -> NDArray[np.float64]:
        """Return the covariance between all cells, (N, N)."""
        row, column = np.divmod(np.arange(shape[0] * shape[1]), shape[1])
        return KERNELS[self.kernel](np.hypot(row[:, None] - row, column[:, None] - column) / self.decay)

    @staticmethod
    def predict(
        covariance: NDArray[np.float64], cells: NDArray[np.int64], values: NDArray[np.float64], noise: float
    ) -> NDArray[np.float64]:
        """Return the maps (n, N) measured as `values` (n, m) in some cells, with a noise: kriging, level unknown."""
        inner = covariance[np.ix_(cells, cells)] + noise * np.eye(cells.size)
        solved = cho_solve(cho_factor(inner, lower=True), np.column_stack([values.T, np.ones(cells.size)]))
        ones = solved[:, -1]
        level = solved[:, :-1].sum(axis=0) / ones.sum()
        return np.asarray((level + covariance[:, cells] @ (solved[:, :-1] - np.outer(ones, level))).T)


def greedy_route(
    covariance: NDArray[np.float64], noise: float, legs: LegTable, budget: Budget, start: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the route of the steepest gains, and the gain of each of its readings.

    Parameters
    ----------
    covariance : array of float64 (N, N)
        Of the process.
    noise : float
        Variance of a reading, above 0.
    legs : LegTable
    budget : Budget
        Of distance.
    start : int

    Returns
    -------
    stops : array of int64 (n,)
        Each cell once.
    gains : array of float64 (n,)
        Nats.

    Raises
    ------
    BudgetError
        When no other cell is within the budget.
    """
    if budget.measure != "distance":
        raise DesignError(f"a greedy route is bounded by distance, not by {budget.measure}")
    variance, known = covariance.diagonal().copy(), np.empty((0, legs.size))
    stops, gains, left = [start], [], budget.limit
    free = legs.allowed.copy()
    while True:
        here = stops[-1]
        gain = 0.5 * np.log1p(np.maximum(variance, 0.0) / noise)
        gains.append(float(gain[here]))
        row = (covariance[here] - known[:, here] @ known) / np.sqrt(max(variance[here], 0.0) + noise)
        known = np.vstack([known, row])
        variance = variance - np.square(row)
        free[here] = False
        within = free & (legs.length[here] <= left)
        if not within.any():
            break
        gain = 0.5 * np.log1p(np.maximum(variance, 0.0) / noise)
        rate = np.where(within, gain / np.maximum(legs.length[here], np.finfo(float).tiny), -1.0)
        step = int(rate.argmax())
        left -= float(legs.length[here, step])
        stops.append(step)
    if len(stops) < 2:
        raise BudgetError(f"no cell lies within {budget.describe(budget.limit)} of the start: allow a larger budget")
    return np.array(stops, dtype=np.int64), np.array(gains)


def tuned_ipp(
    validation: NDArray[np.float64], legs: LegTable, budget: Budget
) -> tuple[NDArray[np.int64], GaussianProcess]:
    """Return the greedy route of the kernel, and from the start, that lowers the validation maps' error most.

    Parameters
    ----------
    validation : array of float64 (n, N)
    legs : LegTable
    budget : Budget
        Of distance.
    """
    rows, columns = legs.shape
    begin = [int(down * rows) * columns + int(across * columns) for down, across in _BEGINNINGS]
    processes = [GaussianProcess(*one) for one in product(KERNELS, DECAYS, NOISES)]
    tried = [_tried(one, begin[0], validation, legs, budget) for one in processes]
    process = processes[int(np.argmin([error for error, _ in tried]))]
    from_all = [_tried(process, start, validation, legs, budget) for start in begin]
    return min(from_all, key=lambda one: one[0])[1], process


def _tried(
    process: GaussianProcess, start: int, validation: NDArray[np.float64], legs: LegTable, budget: Budget
) -> tuple[float, NDArray[np.int64]]:
    covariance = process.covariance(legs.shape)
    stops, _ = greedy_route(covariance, process.noise, legs, budget, start)
    values = validation[:, stops]
    predicted = (process.predict(covariance, stops, values, noise) for noise in _PREDICTING)
    return min(float(squared_error(validation, one).mean()) for one in predicted), stops
