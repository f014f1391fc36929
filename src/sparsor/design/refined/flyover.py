"""What a route flies over: the cells under its legs, one pass after the other, and how long each takes."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray  # noqa: TC002

from sparsor.core.compiled import njit
from sparsor.design.legs import crossing_table

if TYPE_CHECKING:
    from sparsor.design.legs import LegTable


class Flyover(NamedTuple):
    """The cells under every leg, as compiled code reads them.

    Parameters
    ----------
    columns : int
        Of the grid.
    first, rows_off, columns_off, share : arrays
        See `crossing_table`.
    seconds : array of float64 (N, N)
        Time of flight of each leg.
    hold_s : float
        Dwell at a stop that follows itself; 0 where routes have none.
    home : int
        Cell of home.
    by_way : array of bool (N,)
        Stops whose way from or to home counts as flown over.
    """

    columns: int
    first: NDArray[np.int64]
    rows_off: NDArray[np.int64]
    columns_off: NDArray[np.int64]
    share: NDArray[np.float64]
    seconds: NDArray[np.float64]
    hold_s: float
    home: int
    by_way: NDArray[np.bool_]


def flyover(legs: LegTable, *, hold_s: float = 0.0, home: int | None = None) -> Flyover:
    """Return the cells under the legs of a table, for one dwell of `hold_s`.

    With the cell of home the straight ways from it to the first stop and back from the last count too; a way that is
    barred leads round what bars it, and does not.
    """
    by_way = np.zeros(legs.size, dtype=np.bool_) if home is None else legs.length[home] <= legs.longest
    seconds = np.ascontiguousarray(legs.seconds)
    return Flyover(legs.shape[1], *crossing_table(legs.shape), seconds, float(hold_s), home or 0, by_way)


@njit(cache=True, nogil=True)
def passes(over: Flyover, stops: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the cells that a route passes through, in order, and the seconds in each.

    A stop that is given twice in a row is dwelt at.
    """
    stops = _with_ways(over, stops)
    count = 1
    for k in range(stops.size - 1):
        offset = _offset(over, stops[k], stops[k + 1])
        count += over.first[offset + 1] - over.first[offset]
    cell, seconds = np.empty(count, dtype=np.int64), np.zeros(count)
    cell[0] = stops[0]
    last = 0
    for k in range(stops.size - 1):
        start, end = stops[k], stops[k + 1]
        if start == end:
            seconds[last] += over.hold_s
            continue
        row, column = start // over.columns, start % over.columns
        down = 1 if end // over.columns >= row else -1
        across = 1 if end % over.columns >= column else -1
        offset, time = _offset(over, start, end), over.seconds[start, end]
        for i in range(over.first[offset], over.first[offset + 1]):
            under = (row + down * over.rows_off[i]) * over.columns + column + across * over.columns_off[i]
            if under != cell[last]:
                last += 1
                cell[last] = under
            seconds[last] += over.share[i] * time
    return cell[: last + 1], seconds[: last + 1]


@njit(cache=True, nogil=True)
def _with_ways(over: Flyover, stops: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return a route with home before and behind it, where those ways count."""
    before = int(over.by_way[stops[0]] and stops[0] != over.home)
    behind = int(over.by_way[stops[-1]] and stops[-1] != over.home)
    if before + behind == 0:
        return stops
    way = np.full(stops.size + before + behind, over.home, dtype=np.int64)
    way[before : before + stops.size] = stops
    return way


@njit(cache=True, nogil=True)
def _offset(over: Flyover, start: int, end: int) -> int:
    down = abs(end // over.columns - start // over.columns)
    return int(down * over.columns + abs(end % over.columns - start % over.columns))
