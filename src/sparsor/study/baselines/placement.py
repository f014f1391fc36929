"""Cells placed without a thought of the way between them, and the shortest tour of as many as a budget allows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.design.refined.costs import costs
from sparsor.design.refined.starts import tour_within
from sparsor.design.route import shortest_path
from sparsor.errors import BudgetError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design import Budget, LegTable

_ENERGY_LEFT = 1e-9  # of the maps, outside the modes: what single precision would leave


def random_tour(legs: LegTable, budget: Budget, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return the tour, nearest neighbour and 2-opt, of as many random cells as fit.

    Parameters
    ----------
    legs : LegTable
    budget : Budget
    rng : numpy.random.Generator

    Raises
    ------
    BudgetError
        When not even two of them fit.
    """
    return _toured(rng.permutation(np.flatnonzero(legs.allowed)), legs, budget)


def qr_pivot_tour(maps: NDArray[np.float64], legs: LegTable, budget: Budget) -> NDArray[np.int64]:
    """Return the tour of as many of the QR pivots of the maps' modes as fit.

    As many modes are taken as cells can be visited: r cells tell r modes, and pivots for many more are led by modes
    that nobody could tell.

    Parameters
    ----------
    maps : array of float64 (n, N)
        Training maps.
    legs : LegTable
    budget : Budget

    Raises
    ------
    BudgetError
        When not even two of them fit.
    """
    basis = modes(maps)
    low, high = 2, basis.shape[1]
    while low < high:
        middle = (low + high + 1) // 2
        tour = shortest_path(_allowed_pivots(basis, middle, legs)[:middle], legs.length)
        low, high = (middle, high) if budget.used(tour, legs) <= budget.limit else (low, middle - 1)
    return _toured(_allowed_pivots(basis, low, legs), legs, budget)


def modes(maps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the orthonormal modes of maps less their mean, (N, r), the strongest first."""
    _, spread, axes = np.linalg.svd(maps - maps.mean(axis=0), full_matrices=False)
    energy = np.cumsum(np.square(spread))
    return np.ascontiguousarray(axes[: int(np.searchsorted(energy, (1 - _ENERGY_LEFT) * energy[-1])) + 1].T)


def qr_pivots(basis: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return all cells in the order in which a pivoted QR decomposition takes them (Manohar et al. 2018).

    Each pivot is the cell whose row of the basis is longest once what the cells before it say is taken off. When all
    modes are told, the rest follows in the order of what a second look says: the basis with those cells left out.

    Parameters
    ----------
    basis : array of float64 (N, r)

    Returns
    -------
    array of int64 (N,)
    """
    from scipy.linalg import qr

    left, order = np.arange(len(basis)), []
    while left.size:
        count = min(basis.shape[1], left.size)
        pivot = qr(basis[left].T, mode="r", pivoting=True)[1][:count]
        order.append(left[pivot])
        left = np.delete(left, pivot)
    return np.concatenate(order).astype(np.int64)


def _allowed_pivots(basis: NDArray[np.float64], count: int, legs: LegTable) -> NDArray[np.int64]:
    order = qr_pivots(basis[:, :count])
    return order[legs.allowed[order]]


def _toured(ranking: NDArray[np.int64], legs: LegTable, budget: Budget) -> NDArray[np.int64]:
    tour = tour_within(ranking, costs(budget, legs))
    if tour is None:
        raise BudgetError(f"no two of the cells placed lie within {budget.describe(budget.limit)}: allow a larger one")
    return tour
