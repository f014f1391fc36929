"""Stops placed by gradient, as the inducing points of a sparse Gaussian process are.

After SGP-Tools (Jakkala & Akella 2023, "Efficient sensor placement from regression with sparse Gaussian processes"):
points move freely over the grid to where they lower the error of the whole map most, and a tour then joins them. Here
the error is the posterior variance under the maps' own covariance, which between cell centres is interpolated.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.design.refined.costs import both_ways, used
from sparsor.design.route import shortest_path

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design.refined.costs import Costs
    from sparsor.design.refined.posterior import Belief

_STEPS = 60  # of the descent: it is a start for the search, not the end
_TRIES = 6  # numbers of points
_FEWER, _MORE = 0.85, 1.15
_ROUNDING = 1e-12


def inducing_tour(
    prior: Belief, costs: Costs, shape: tuple[int, int], noise: float, begin: NDArray[np.int64]
) -> NDArray[np.int64] | None:
    """Return the tour of as many points placed by gradient as the budget allows; None when not of two.

    Parameters
    ----------
    prior : Belief
    costs : Costs
    shape : tuple of int
    noise : float
        Variance of a reading.
    begin : array of int64 (n,)
        Cells to begin from, the most telling first; about as many as fit.
    """
    fits: NDArray[np.int64] | None = None
    legs = both_ways(costs)
    count = min(begin.size, max(2, _within(begin, costs)))
    for _ in range(_TRIES):
        cells = placed(prior, shape, noise, begin[:count])
        tour = shortest_path(cells, legs) if cells.size > 1 else cells
        if tour.size > 1 and used(costs, tour) <= costs.limit:
            if fits is None or tour.size > fits.size:
                fits = tour
            larger = min(begin.size, int(np.ceil(_MORE * count)))
            if larger == count:
                break
            count = larger
        elif fits is not None or count <= 2:
            break
        else:
            count = max(2, int(_FEWER * count))
    return fits


def placed(prior: Belief, shape: tuple[int, int], noise: float, begin: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the cells nearest to points that began at some cells and went down the gradient, each once.

    Parameters
    ----------
    prior : Belief
    shape : tuple of int
    noise : float
    begin : array of int64 (n,)
    """
    from scipy.optimize import minimize

    factor = prior.factor.reshape(*shape, -1)
    precision = 1 / (prior.residual[prior.allowed].mean() + noise + _ROUNDING)
    start = np.stack(np.divmod(begin, shape[1]), axis=1).astype(np.float64)
    bounds = [(0.0, side - 1.0) for _ in begin for side in shape]

    def error(flat: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        rows, down, across = _between(factor, flat.reshape(-1, 2))
        information = np.diag(1 / prior.spread) + precision * rows.T @ rows
        covariance = np.linalg.inv(information)
        pull = -2 * precision * rows @ (covariance * prior.size @ covariance)
        slope = np.stack([(pull * down).sum(axis=1), (pull * across).sum(axis=1)], axis=1)
        return float(covariance.diagonal() @ prior.size), slope.ravel()

    found = minimize(error, start.ravel(), jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": _STEPS})
    places = found.x.reshape(-1, 2)
    cells = np.flatnonzero(prior.allowed)
    row, column = np.divmod(cells, shape[1])
    away = np.square(places[:, :1] - row) + np.square(places[:, 1:] - column)
    return np.unique(cells[away.argmin(axis=1)]).astype(np.int64)


def _between(
    factor: NDArray[np.float64], places: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the factor at places between cell centres (n, r), bilinear, and its slopes down and across."""
    last = np.array(factor.shape[:2]) - 2
    corner = np.clip(np.floor(places).astype(np.intp), 0, np.maximum(last, 0))
    part = places - corner
    row, column = corner.T
    below, right = np.minimum(row + 1, factor.shape[0] - 1), np.minimum(column + 1, factor.shape[1] - 1)
    here, over = factor[row, column], factor[row, right]
    under, far = factor[below, column], factor[below, right]
    v, u = part[:, :1], part[:, 1:]
    value = (1 - v) * ((1 - u) * here + u * over) + v * ((1 - u) * under + u * far)
    down = (1 - u) * (under - here) + u * (far - over)
    across = (1 - v) * (over - here) + v * (far - under)
    return value, down, across


def _within(ranking: NDArray[np.int64], costs: Costs) -> int:
    """Return about how many of the first cells of a ranking a tour within the budget joins."""
    low, high, legs = 2, ranking.size, both_ways(costs)
    while low < high:
        middle = (low + high + 1) // 2
        if used(costs, shortest_path(ranking[:middle], legs)) <= costs.limit:
            low = middle
        else:
            high = middle - 1
    return low
