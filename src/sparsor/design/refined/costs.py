"""What a route uses of its budget, as compiled code reads it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray  # noqa: TC002

from sparsor.core.compiled import njit

if TYPE_CHECKING:
    from sparsor.design.budget import Budget
    from sparsor.design.legs import LegTable


class Costs(NamedTuple):
    """A budget and what draws on it.

    Parameters
    ----------
    legs : array of float64 (N, N)
        Metres, cell widths or seconds, from row to column. On the diagonal: one dwell.
    ends : array of float64 (N,)
        The way between home and each cell.
    closing : float
        1 when the way from the last stop to the first counts, 0 otherwise.
    per_stop, fixed, limit : float
    symmetric : bool
        Whether every leg costs the same both ways: with wind it does not.
    """

    legs: NDArray[np.float64]
    ends: NDArray[np.float64]
    closing: float
    per_stop: float
    fixed: float
    limit: float
    symmetric: bool


def costs(budget: Budget, legs: LegTable, dwell_s: float = 0.0) -> Costs:
    """Return a budget for the legs of a table and dwells of `dwell_s`, braking included.

    To a budget of distance a dwell counts as the way that would have been flown meanwhile: what is short in the air is
    energy, and that goes by time.
    """
    distance = budget.measure == "distance"
    table = (legs.length if distance else legs.seconds).copy()
    np.fill_diagonal(table, dwell_s * (legs.length.sum() / legs.seconds.sum() if distance else 1.0))
    ends = np.zeros(legs.size) if distance or budget.home is None else np.ascontiguousarray(budget.home)
    closing = float(not distance and budget.home is None)
    symmetric = bool(np.array_equal(table, table.T))
    return Costs(table, ends, closing, float(budget.per_stop), float(budget.fixed), float(budget.limit), symmetric)


def both_ways(costs: Costs) -> NDArray[np.float64]:
    """Return what each leg costs on average there and back: tours are sought as if there were no wind."""
    return costs.legs if costs.symmetric else (costs.legs + costs.legs.T) / 2


@njit(cache=True, nogil=True)
def used(costs: Costs, stops: NDArray[np.int64]) -> float:
    """Return what a route uses, as `Budget.used` does."""
    first, last = stops[0], stops[-1]
    total = costs.fixed + costs.ends[first] + costs.ends[last] + costs.closing * costs.legs[last, first]
    for k in range(stops.size - 1):
        total += costs.legs[stops[k], stops[k + 1]]
    return float(total + costs.per_stop * stops.size)


def shortest_pair(costs: Costs, allowed: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the route of two cells that uses least."""
    cells = np.flatnonzero(allowed)
    total = costs.legs[np.ix_(cells, cells)] + costs.ends[cells, None] + costs.ends[cells]
    total += costs.closing * total.T
    np.fill_diagonal(total, np.inf)
    return cells[np.array(np.unravel_index(total.argmin(), total.shape))].astype(np.int64)
