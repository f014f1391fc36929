"""Whether a route crosses itself where 2-opt would undo it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.core.compiled import njit

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_LEAST_GAIN = 1e-9  # as a share of the legs: smaller gains are rounding


@njit(cache=True, nogil=True)
def crosses(stops: NDArray[np.int64], length: NDArray[np.float64], columns: int, first: int, last: int) -> bool:
    """Return whether a leg between the positions `first` and `last` of a path meets another one needlessly.

    Two legs that meet are reconnected by 2-opt; where that is not shorter, as in a table of costs that is not
    geometry, they may.

    Parameters
    ----------
    stops : array of int64 (n,)
    length : array of float64 (N, N)
        Costs of the legs.
    columns : int
        Of the grid.
    first, last : int
        Legs outside this stretch are taken to be clear of one another.
    """
    for i in range(first, last):
        for j in range(stops.size - 1):
            if first <= j < i + 2 or abs(j - i) < 2:
                continue
            a, b = min(i, j), max(i, j)
            if not _meet(stops[a], stops[a + 1], stops[b], stops[b + 1], columns):
                continue
            before, after = _reconnected(stops, length, a, b)
            if before - after > _LEAST_GAIN * before:
                return True
    return False


@njit(cache=True, nogil=True)
def _reconnected(stops: NDArray[np.int64], length: NDArray[np.float64], a: int, b: int) -> tuple[float, float]:
    """Return what the legs from position a to b + 1 cost, and what they do with the stretch between turned round."""
    before = length[stops[a], stops[a + 1]] + length[stops[b], stops[b + 1]]
    after = length[stops[a], stops[b]] + length[stops[a + 1], stops[b + 1]]
    for k in range(a + 1, b):  # the same both ways, but for wind
        before += length[stops[k], stops[k + 1]]
        after += length[stops[k + 1], stops[k]]
    return before, after


@njit(cache=True, nogil=True)
def _meet(a: int, b: int, c: int, d: int, columns: int) -> bool:
    """Return whether the straight legs a to b and c to d share a point."""
    ay, ax, by, bx = a // columns, a % columns, b // columns, b % columns
    cy, cx, dy, dx = c // columns, c % columns, d // columns, d % columns
    if max(ax, bx) < min(cx, dx) or max(cx, dx) < min(ax, bx) or max(ay, by) < min(cy, dy) or max(cy, dy) < min(ay, by):
        return False
    side_c = _side(ax, ay, bx, by, cx, cy)
    side_d = _side(ax, ay, bx, by, dx, dy)
    side_a = _side(cx, cy, dx, dy, ax, ay)
    side_b = _side(cx, cy, dx, dy, bx, by)
    return side_c * side_d <= 0 and side_a * side_b <= 0


@njit(cache=True, nogil=True)
def _side(ax: int, ay: int, bx: int, by: int, px: int, py: int) -> int:
    """Return on which side of the line a to b a point lies: -1, 0 or 1."""
    area = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
    return 1 if area > 0 else (-1 if area < 0 else 0)
