"""The steps of the LASSO's solution path: which atom joins or leaves next, and what that changes; compiled.

All is made part of the loop that calls it ("inline"): a call counts a reference to each array that it is handed,
with locked instructions, and there are some eighty steps to a path. That was a fifth of the time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sparsor.core.compiled import njit
from sparsor.design.basis import add_row, aligned, remove

if TYPE_CHECKING:
    from numpy.typing import NDArray

_PARALLEL = 1e-14  # an atom whose correlation falls as fast as the active ones' never meets them
_LARGEST = np.iinfo(np.int64).max


class Room(NamedTuple):
    """Arrays that following a path writes to, allocated once for many targets; what they hold does not matter.

    Those of K + n numbers have one for each atom, then one for each place of the factor's right part: of an
    active atom the code, negated, stands behind the correlations and its direction behind the slopes, so that
    one step changes both alike.

    Parameters
    ----------
    factor : array of float64 (n, K + n)
        See `basis`.
    fit : array of float64 (n,)
        z of ``L z = signs``.
    active, place : arrays of int64 (n,)
        The active atoms in order, and the place of each; the free places follow.
    correlation, slope : arrays of float64 (K + n,)
    sign : array of float64 (K + n,)
        Behind the atoms: of the active ones' codes; else 0.
    barrier : array of float64 (K + n,)
        0 for atoms that may join, else infinite.
    distance : array of float64 (K + n,)
        To where each atom joins or leaves.
    residual : array of float64 (M,)
    """

    factor: NDArray[np.float64]
    fit: NDArray[np.float64]
    active: NDArray[np.int64]
    place: NDArray[np.int64]
    correlation: NDArray[np.float64]
    slope: NDArray[np.float64]
    sign: NDArray[np.float64]
    barrier: NDArray[np.float64]
    distance: NDArray[np.float64]
    residual: NDArray[np.float64]


def make_room(atoms: int, rows: int) -> Room:
    """Return the arrays for `atoms` atoms of `rows` numbers."""
    n = min(atoms, rows)
    width = -(-(atoms + n) // 8) * 8  # so that every row of the factor starts on a cache line
    return Room(
        factor=aligned(n, width),
        fit=np.empty(n),
        active=np.empty(n, dtype=np.int64),
        place=np.empty(n, dtype=np.int64),
        correlation=aligned(width),
        slope=aligned(width),
        sign=aligned(width),
        barrier=aligned(width),
        distance=aligned(width),
        residual=np.empty(rows),
    )


@njit(inline="always", cache=True, nogil=True)
def begin(
    correlation: NDArray[np.float64],
    slope: NDArray[np.float64],
    sign: NDArray[np.float64],
    barrier: NDArray[np.float64],
    place: NDArray[np.int64],
    K: int,
) -> None:
    """Prepare for a path from the solution of zeros; the correlations of the K atoms are known."""
    for j in range(slope.size):
        slope[j] = 0.0
        sign[j] = 0.0
        barrier[j] = 0.0 if j < K else np.inf
        if j >= K:
            correlation[j] = 0.0
    for k in range(place.size):
        place[k] = k


@njit(inline="always", cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def join(
    factor: NDArray[np.float64],
    fit: NDArray[np.float64],
    correlation: NDArray[np.float64],
    slope: NDArray[np.float64],
    sign: NDArray[np.float64],
    count: int,
    atom: int,
    behind: int,
) -> None:
    """Turn the direction to a newly active atom, whose row of the factor is known.

    Parameters
    ----------
    factor, fit, correlation, slope, sign
        Of `Room`.
    count, atom : int
        Active atoms before, and the new one.
    behind : int
        K and the new atom's place.
    """
    left = 1.0 if correlation[atom] > 0 else -1.0
    sign[behind] = left
    for k in range(count):
        left -= factor[k, atom] * fit[k]
    fit[count] = left / factor[count, atom]
    add_row(factor, count, fit[count], slope)


@njit(inline="always", cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def leave(
    factor: NDArray[np.float64],
    fit: NDArray[np.float64],
    active: NDArray[np.int64],
    place: NDArray[np.int64],
    correlation: NDArray[np.float64],
    slope: NDArray[np.float64],
    sign: NDArray[np.float64],
    count: int,
    position: int,
    K: int,
) -> None:
    """Take out the active atom at `position` of `count`; the parameters before are of `Room`."""
    free = place[position]
    for k in range(position, count - 1):
        active[k], place[k] = active[k + 1], place[k + 1]
    place[count - 1] = free
    remove(factor, fit, active, count, position)
    add_row(factor, count - 1, -fit[count - 1], slope)
    for k in range(count - 1):
        factor[k, K + free] = 0.0
    correlation[K + free] = slope[K + free] = sign[K + free] = 0.0


@njit(inline="always", cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def next_event(
    correlation: NDArray[np.float64],
    slope: NDArray[np.float64],
    sign: NDArray[np.float64],
    barrier: NDArray[np.float64],
    distance: NDArray[np.float64],
    level: float,
    dropped: int,
) -> tuple[float, int]:
    """Return the step to where an atom joins or leaves, and its number; the level and -1 when none does.

    An inactive atom joins where its correlation meets the level, from above or below: after
    ``(level - c) / (1 - s)`` or ``(level + c) / (1 + s)``. The first is the smaller where ``level s < c``, so
    that one division does. An active one leaves where its code becomes zero; its number is K and its place.

    Parameters
    ----------
    correlation, slope, sign, barrier, distance
        Of `Room`.
    level : float
        The active atoms' absolute correlation.
    dropped : int
        The atom that the last step took out, or -1.
    """
    for j in range(distance.size):
        c, s = correlation[j], slope[j]
        side = 1.0 if level * s < c else -1.0
        leaving = s * sign[j] < 0.0
        gap = c if leaving else level - side * c
        closing = s if leaving else 1.0 - side * s
        wait = 0.0 if leaving else barrier[j]
        meets = abs(closing) > _PARALLEL
        met = gap / (closing if meets else 1.0)
        distance[j] = (met if met > 0.0 else 0.0) + (wait if meets else np.inf)
    if dropped >= 0:  # it lies on the boundary: it may come back on the other side only
        side = 1.0 if correlation[dropped] > 0.0 else -1.0
        away = 1.0 + side * slope[dropped]
        distance[dropped] = (level + abs(correlation[dropped])) / away if away > _PARALLEL else np.inf
    first = _smallest(distance.view(np.int64))
    if distance[first] < level:
        return distance[first], first
    return level, -1


@njit(inline="always", cache=True, nogil=True)
def _smallest(bits: NDArray[np.int64]) -> int:
    """Return the place of the smallest of numbers not below 0, given by their bits, which are in the same order.

    The smallest of whole numbers is found many at a time, that of floating-point ones is not.
    """
    none = bits.size
    least, place = _LARGEST, none
    for j in range(bits.size):
        least = min(least, bits[j])
    for j in range(bits.size):
        place = min(place, j if bits[j] == least else none)
    return place


@njit(inline="always", cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def advance(correlation: NDArray[np.float64], slope: NDArray[np.float64], step: float) -> None:
    """Go `step` along the path."""
    for j in range(slope.size):
        correlation[j] -= step * slope[j]
