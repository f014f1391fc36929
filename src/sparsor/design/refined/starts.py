"""Routes to begin the search from: lawnmowers, and tours of the cells that say most or of points placed by gradient."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.design.refined.costs import both_ways, used
from sparsor.design.refined.inducing import inducing_tour
from sparsor.design.route import shortest_path

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from sparsor.design.refined.costs import Costs
    from sparsor.design.refined.posterior import Belief

_MOST_LINES = 16
_INSETS = 8
_ROUNDING = 1e-12


def starts(prior: Belief, costs: Costs, shape: tuple[int, int], noise: float) -> list[NDArray[np.int64]]:
    """Return routes within the budget, each of another kind: lawnmowers, tours of ranked cells, of inducing points."""
    telling = most_telling(prior, noise)
    tours = (
        tour_within(pivots(prior, noise), costs),
        tour_within(telling, costs),
        inducing_tour(prior, costs, shape, noise, telling),
    )
    return [*_lawnmowers(prior, costs, shape), *(tour for tour in tours if tour is not None)]


def pivots(prior: Belief, noise: float) -> NDArray[np.int64]:
    """Return cells by the pivots of a QR decomposition of the components (Manohar et al. 2018)."""
    from scipy.linalg import qr

    rank = prior.spread.size
    scale = np.where(prior.allowed, 1 / np.sqrt(prior.residual + noise + _ROUNDING), 0.0)
    order = qr((prior.factor * scale[:, None]).T, mode="r", pivoting=True)[1][:rank]
    return np.asarray(order[prior.allowed[order]], dtype=np.int64)


def most_telling(prior: Belief, noise: float) -> NDArray[np.int64]:
    """Return cells in the order that lowers the expected error most with each one (greedy A-optimal design)."""
    covariance = np.diag(prior.spread)
    order: list[int] = []
    free = prior.allowed.copy()
    variance = prior.residual + noise + _ROUNDING
    for _ in range(min(prior.spread.size, int(free.sum()))):
        towards = prior.factor @ covariance
        gain = (np.square(towards) @ prior.size) / ((towards * prior.factor).sum(axis=1) + variance)
        cell = int(np.where(free, gain, -1.0).argmax())
        covariance -= np.outer(towards[cell], towards[cell]) / (towards[cell] @ prior.factor[cell] + variance[cell])
        free[cell] = False
        order.append(cell)
    return np.array(order, dtype=np.int64)


def tour_within(ranking: NDArray[np.int64], costs: Costs) -> NDArray[np.int64] | None:
    """Return the tour of as many of the first cells of a ranking as the budget allows; None when not of two."""
    fits, count, legs = None, 2, both_ways(costs)
    while count <= ranking.size:
        tour = shortest_path(ranking[:count], legs)
        if used(costs, tour) > costs.limit:
            break
        fits, count = tour, count + 1
    return fits


def _lawnmowers(prior: Belief, costs: Costs, shape: tuple[int, int]) -> Iterator[NDArray[np.int64]]:
    """Yield, of every number of lines, the widest lawnmower within the budget: along rows, and along columns."""
    cells = np.flatnonzero(prior.allowed)
    row, column = np.divmod(cells, shape[1])
    for across, along in ((row, column), (column, row)):
        for lines in range(1, _MOST_LINES + 1):
            for inset in np.linspace(0.5 / lines, 0.45, _INSETS) if lines > 1 else (0.25,):
                stops = _lawnmower(cells, across, along, lines, float(inset))
                if stops.size > 1 and used(costs, stops) <= costs.limit:
                    yield stops
                    break


def _lawnmower(
    cells: NDArray[np.int64], across: NDArray[np.int64], along: NDArray[np.int64], lines: int, inset: float
) -> NDArray[np.int64]:
    """Return parallel lines half a spacing from the sides and with ends inset by a share of their length."""
    height = np.ptp(across) + 1
    stops: list[int] = []
    for k in range(lines):
        line = across.min() + int((k + 0.5) * height / lines)
        on_line = np.flatnonzero(across == line)
        if not on_line.size:
            continue
        first, last = along[on_line].min(), along[on_line].max()
        margin = inset * (last - first)
        ends = (first + margin, last - margin) if k % 2 == 0 else (last - margin, first + margin)
        stops += [int(cells[on_line[np.abs(along[on_line] - end).argmin()]]) for end in ends]
    return np.array([stop for k, stop in enumerate(stops) if k == 0 or stop != stops[k - 1]], dtype=np.int64)
