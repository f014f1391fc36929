"""Short open paths over a set of cells: nearest neighbour, then 2-opt and Or-opt, compiled."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.compiled import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

_LEAST_GAIN = 1e-9  # as a share of the path: smaller gains are rounding and could go round in circles
_LONGEST_SEGMENT = 3


def shortest_path(cells: NDArray[np.int64], length: NDArray[np.float64], *, improve: bool = True) -> NDArray[np.int64]:
    """Return the cells in the order of a short open path over all of them.

    Parameters
    ----------
    cells : array of int64 (n,)
        The cells to visit, each once. The path is grown from the first one.
    length : array of float64 (N, N)
        Symmetric lengths between all cells of the grid.
    improve : bool
        Whether the nearest-neighbour path (the paper's) is then improved by 2-opt and Or-opt until no move
        makes it shorter. Ties go to the lower position, so the answer is always the same.

    Examples
    --------
    >>> place = np.array([0.0, 10.0, 1.0, 11.0])
    >>> shortest_path(np.arange(4), abs(place[:, None] - place)).tolist()
    [0, 2, 1, 3]
    """
    if cells.size < 2:
        return cells.copy()
    return _path_over(cells, length, improve)


@njit(cache=True, nogil=True)
def _path_over(cells: NDArray[np.int64], length: NDArray[np.float64], improve: bool) -> NDArray[np.int64]:
    table = np.empty((cells.size, cells.size))
    for i in range(cells.size):
        for j in range(cells.size):
            table[i, j] = length[cells[i], cells[j]]
    order = nearest_neighbour(table)
    if improve:
        improve_path(table, order)
    return cells[order]


@njit(cache=True, nogil=True)
def nearest_neighbour(table: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the greedy path from place 0: always on to the nearest place not yet visited."""
    n = table.shape[0]
    order = np.empty(n, dtype=np.int64)
    left = np.ones(n, dtype=np.bool_)
    here = 0
    for k in range(n):
        order[k] = here
        left[here] = False
        nearest = -1
        for place in range(n):
            if left[place] and (nearest < 0 or table[here, place] < table[here, nearest]):
                nearest = place
        here = nearest
    return order


@njit(cache=True, nogil=True)
def improve_path(table: NDArray[np.float64], order: NDArray[np.int64]) -> None:
    """Shorten an open path in place until neither 2-opt nor Or-opt finds a gain."""
    total = 0.0
    for k in range(order.size - 1):
        total += table[order[k], order[k + 1]]
    least = _LEAST_GAIN * total
    while _two_opt(table, order, least) or _or_opt(table, order, least):
        pass


@njit(cache=True, nogil=True)
def _two_opt(table: NDArray[np.float64], order: NDArray[np.int64], least: float) -> bool:
    """Reverse stretches of the path while that shortens it; the ends of an open path are free."""
    n = order.size
    improved = False
    for i in range(n - 1):
        for j in range(i + 1, n):
            gain = 0.0
            if i > 0:
                gain += table[order[i - 1], order[i]] - table[order[i - 1], order[j]]
            if j < n - 1:
                gain += table[order[j], order[j + 1]] - table[order[i], order[j + 1]]
            if gain > least:
                order[i : j + 1] = order[i : j + 1][::-1].copy()
                improved = True
    return improved


@njit(cache=True, nogil=True)
def _or_opt(table: NDArray[np.float64], order: NDArray[np.int64], least: float) -> bool:
    """Move stretches of up to three places elsewhere, either way round, while that shortens the path."""
    n = order.size
    improved = False
    for size in range(1, min(_LONGEST_SEGMENT, n - 1) + 1):
        for i in range(n - size + 1):
            if _move_segment(table, order, i, size, least):
                improved = True
    return improved


@njit(cache=True, nogil=True)
def _move_segment(table: NDArray[np.float64], order: NDArray[np.int64], i: int, size: int, least: float) -> bool:
    """Move the stretch of `size` places from position `i` to where it gains most; False when nowhere."""
    n = order.size
    first, last = order[i], order[i + size - 1]
    freed = 0.0
    if i > 0:
        freed += table[order[i - 1], first]
    if i + size < n:
        freed += table[last, order[i + size]]
    if i > 0 and i + size < n:
        freed -= table[order[i - 1], order[i + size]]
    rest = np.empty(n - size, dtype=np.int64)
    rest[:i] = order[:i]
    rest[i:] = order[i + size :]
    best, place, turned = least, -1, False
    for k in range(rest.size + 1):  # in front of rest[k]; k = rest.size is the far end
        before = rest[k - 1] if k > 0 else -1
        after = rest[k] if k < rest.size else -1
        joint = table[before, after] if before >= 0 and after >= 0 else 0.0
        for flip in (False, True):
            head, tail = (last, first) if flip else (first, last)
            added = -joint
            if before >= 0:
                added += table[before, head]
            if after >= 0:
                added += table[tail, after]
            if freed - added > best:
                best, place, turned = freed - added, k, flip
    if place < 0:
        return False
    segment = order[i : i + size].copy()
    if turned:
        segment = segment[::-1].copy()
    order[:place] = rest[:place]
    order[place : place + size] = segment
    order[place + size :] = rest[place:]
    return True
