"""The lawnmower: parallel lines there and back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import BudgetError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design import Budget, LegTable


def lawnmower(legs: LegTable, budget: Budget) -> NDArray[np.int64]:
    """Return the most lines along the rows that a budget allows, half a spacing away from every side.

    Parameters
    ----------
    legs : LegTable
        With all cells allowed.
    budget : Budget

    Returns
    -------
    array of int64 (2 k,)
        The ends of k lines in the order of flight.

    Raises
    ------
    BudgetError
        When not even one line fits.
    """
    best = None
    for lines in range(1, legs.shape[0] + 1):
        stops = lawnmower_of(legs.shape, lines)
        if budget.used(stops, legs) <= budget.limit:
            best = stops
    if best is None:
        raise BudgetError(f"no lawnmower within {budget.describe(budget.limit)}; allow a larger budget")
    return best


def lawnmower_of(shape: tuple[int, int], lines: int) -> NDArray[np.int64]:
    """Return the ends of a number of lines in the order of flight, (2 lines,).

    Examples
    --------
    >>> lawnmower_of((8, 8), 2).tolist()
    [18, 21, 53, 50]
    """
    rows, columns = shape
    row = ((np.arange(lines) + 0.5) * rows / lines).astype(np.int64)
    inset = min(int(rows / lines / 2), (columns - 1) // 2)
    ends = np.array([inset, columns - 1 - inset])
    return np.concatenate([at * columns + ends[:: 1 if k % 2 == 0 else -1] for k, at in enumerate(row)])
