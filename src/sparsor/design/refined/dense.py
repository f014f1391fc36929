"""Small dense linear algebra, compiled.

BLAS and LAPACK hold the interpreter's lock when compiled code calls them. For a product of large matrices that is
worth it; these are too small or too slow for it, and run side by side.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.compiled import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def inner_products(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``a @ b.T``."""
    out = np.empty((a.shape[0], b.shape[0]))
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[i, k] * b[j, k]
            out[i, j] = total
    return out


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def solve(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``inv(a) @ b`` by Gaussian elimination with partial pivoting."""
    left, right = a.copy(), b.copy()
    n = left.shape[0]
    for k in range(n):
        pivot = k + np.abs(left[k:, k]).argmax()
        if pivot != k:
            for j in range(n):
                left[k, j], left[pivot, j] = left[pivot, j], left[k, j]
            for j in range(right.shape[1]):
                right[k, j], right[pivot, j] = right[pivot, j], right[k, j]
        for i in range(k + 1, n):
            factor = left[i, k] / left[k, k]
            for j in range(k + 1, n):
                left[i, j] -= factor * left[k, j]
            for j in range(right.shape[1]):
                right[i, j] -= factor * right[k, j]
    for k in range(n - 1, -1, -1):
        for i in range(k + 1, n):
            for j in range(right.shape[1]):
                right[k, j] -= left[k, i] * right[i, j]
        right[k] /= left[k, k]
    return right


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def inverse_root(a: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lower triangular R with ``R.T @ R`` the inverse of a symmetric positive definite matrix."""
    n = a.shape[0]
    root = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= root[i, k] * root[j, k]
            root[i, j] = np.sqrt(total) if i == j else total / root[j, j]
    back = np.zeros((n, n))  # the inverse of Cholesky's root, row by row
    for i in range(n):
        for k in range(i):
            factor = root[i, k]
            for j in range(k + 1):
                back[i, j] -= factor * back[k, j]
        for j in range(i):
            back[i, j] /= root[i, i]
        back[i, i] = 1 / root[i, i]
    return back


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def gram(root: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``root.T @ root`` of a lower triangular matrix."""
    n = root.shape[0]
    out = np.zeros((n, n))
    for k in range(n):
        for i in range(k + 1):
            for j in range(k + 1):
                out[i, j] += root[k, i] * root[k, j]
    return out
