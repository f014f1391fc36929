"""A Cholesky factor of the active atoms' Gram matrix, kept up to date while atoms join and leave; compiled.

With ``G_a = L L^T`` for the active atoms and ``G_a.`` their inner products with all atoms, what is kept is
``L^-1 [G_a. | I]``. Of it the path of solutions needs sums of rows only, an atom that joins adds a row, and one
that leaves takes a row away by plane rotations; L itself stands in the active atoms' columns
(Golub & Van Loan, *Matrix Computations*, 6.5).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.compiled import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

# An atom whose part outside the span of the active ones is below this share of its squared norm adds nothing.
_COLLINEAR = 1e-12
_LINE = 8  # numbers in a cache line


def aligned(*shape: int) -> NDArray[np.float64]:
    """Return an uninitialised array that starts on a cache line: vectors that straddle lines load half as fast."""
    size = math.prod(shape)
    memory = np.empty(size + _LINE)
    first = -(memory.ctypes.data // memory.itemsize) % _LINE
    return memory[first : first + size].reshape(shape)


# Rows are indexed, not cut out as views, and functions inlined: both count references, with locked instructions.


@njit(inline="always", cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def append(factor: NDArray[np.float64], gram: NDArray[np.float64], count: int, atom: int, place: int) -> bool:
    """Add the row of an atom that joins; False when it is collinear with the active ones.

    Parameters
    ----------
    factor : array of float64 (n, K + n)
        ``L^-1 [G_a. | I]``, `count` rows of it in use.
    gram : array of float64 (K, K)
        Inner products of the atoms; the row of `atom` is needed.
    count, atom : int
    place : int
        A column of the right part that is free: it becomes the atom's column of ``L^-1``.
    """
    K, width = gram.shape[0], factor.shape[1]
    norm = gram[atom, atom]
    rest = norm
    for k in range(count):
        rest -= factor[k, atom] * factor[k, atom]
    if not rest > _COLLINEAR * norm:
        return False
    for j in range(K):
        factor[count, j] = gram[atom, j]
    for j in range(K, width):
        factor[count, j] = 0.0
    factor[count, K + place] = 1.0
    k = 0
    while k + 4 <= count:  # four rows at a time: the new one is loaded and stored less often
        a, b, c, d = factor[k, atom], factor[k + 1, atom], factor[k + 2, atom], factor[k + 3, atom]
        for j in range(width):
            factor[count, j] -= a * factor[k, j] + b * factor[k + 1, j] + c * factor[k + 2, j] + d * factor[k + 3, j]
        k += 4
    while k < count:
        a = factor[k, atom]
        for j in range(width):
            factor[count, j] -= a * factor[k, j]
        k += 1
    height = 1.0 / np.sqrt(rest)
    for j in range(width):
        factor[count, j] *= height
    return True


@njit(inline="always", cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def remove(
    factor: NDArray[np.float64], fit: NDArray[np.float64], active: NDArray[np.int64], count: int, first: int
) -> None:
    """Restore the triangle after the atom at position `first` has left; the last of `count` rows is then free.

    Parameters
    ----------
    factor : array of float64 (n, K + n)
    fit : array of float64 (n,)
        z of ``L z = signs``; turned with the rows.
    active : array of int64 (n,)
        The atoms that stay, in order.
    count, first : int
    """
    for k in range(first, count - 1):
        a, b = factor[k, active[k]], factor[k + 1, active[k]]
        length = np.sqrt(a * a + b * b)
        cosine, sine = a / length, b / length
        for j in range(factor.shape[1]):
            a, b = factor[k, j], factor[k + 1, j]
            factor[k, j] = cosine * a + sine * b
            factor[k + 1, j] = cosine * b - sine * a
        a, b = fit[k], fit[k + 1]
        fit[k] = cosine * a + sine * b
        fit[k + 1] = cosine * b - sine * a


@njit(inline="always", cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def add_row(rows: NDArray[np.float64], m: int, weight: float, out: NDArray[np.float64]) -> None:
    """Add ``weight * rows[m]`` to `out`."""
    for j in range(out.size):
        out[j] += weight * rows[m, j]


@njit(inline="always", cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def combine(rows: NDArray[np.float64], weights: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """Write ``weights @ rows`` into the first places of `out`, seven rows at a time."""
    K = rows.shape[1]
    for j in range(K):
        out[j] = 0.0
    m = 0
    while m + 7 <= weights.size:
        a, b, c, d = weights[m], weights[m + 1], weights[m + 2], weights[m + 3]
        e, f, g = weights[m + 4], weights[m + 5], weights[m + 6]
        for j in range(K):
            out[j] += (
                a * rows[m, j]
                + b * rows[m + 1, j]
                + c * rows[m + 2, j]
                + d * rows[m + 3, j]
                + e * rows[m + 4, j]
                + f * rows[m + 5, j]
                + g * rows[m + 6, j]
            )
        m += 7
    while m < weights.size:
        for j in range(K):
            out[j] += weights[m] * rows[m, j]
        m += 1
