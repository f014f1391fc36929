"""The LASSO's optimality (KKT) conditions: how far a solution is from them, and the repair; compiled."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.compiled import njit
from sparsor.design.basis import combine

if TYPE_CHECKING:
    from numpy.typing import NDArray

_MAX_SWEEPS = 1000


@njit(cache=True, nogil=True, fastmath={"contract"})
def violation(
    atoms: NDArray[np.float64],
    rows: NDArray[np.float64],
    target: NDArray[np.float64],
    lasso_weight: float,
    code: NDArray[np.float64],
    residual: NDArray[np.float64],
    correlation: NDArray[np.float64],
) -> float:
    """Return the largest violation of the optimality conditions of ``1/2 |A c - y|^2 + lambda |c|_1``.

    Parameters
    ----------
    atoms, rows : arrays of float64 (K, M) and (M, K)
        The atoms, one a row, and the same transposed.
    target : array of float64 (M,)
        y.
    lasso_weight : float
        lambda.
    code : array of float64 (K,)
        c.
    residual, correlation : arrays of float64 (M,) and (K,)
        Written: ``y - A c`` and its inner products with the atoms.
    """
    residual[:] = target
    for k in range(code.size):
        if code[k] != 0.0:
            for m in range(residual.size):
                residual[m] -= code[k] * atoms[k, m]
    combine(rows, residual, correlation)
    worst = 0.0
    for k in range(code.size):
        pull = abs(correlation[k])
        if pull > lasso_weight + worst:
            worst = pull - lasso_weight
        if code[k] != 0.0:
            worst = max(worst, abs(correlation[k] - np.sign(code[k]) * lasso_weight))
    return worst


@njit(cache=True, nogil=True)
def descend(
    atoms: NDArray[np.float64],
    rows: NDArray[np.float64],
    target: NDArray[np.float64],
    lasso_weight: float,
    code: NDArray[np.float64],
    tolerance: float,
) -> None:
    """Repair what rounding left of a path's end, by coordinate descent; rare (collinear atoms).

    Parameters
    ----------
    atoms, rows, target, lasso_weight, code
        As of `violation`; `code` is mended in place.
    tolerance : float
        Violation to stop at.
    """
    residual, correlation = np.empty(target.size), np.empty(code.size)
    scratch = np.empty(target.size)
    residual[:] = target
    norms = np.empty(code.size)
    for k in range(code.size):
        norms[k] = atoms[k] @ atoms[k]
        if code[k] != 0.0:
            residual -= code[k] * atoms[k]
    for sweep in range(_MAX_SWEEPS):
        for k in range(code.size):
            if norms[k] == 0.0:
                continue
            pull = atoms[k] @ residual + norms[k] * code[k]
            value = np.sign(pull) * max(abs(pull) - lasso_weight, 0.0) / norms[k]
            if value != code[k]:
                residual += (code[k] - value) * atoms[k]
                code[k] = value
        if sweep % 10 == 9 and violation(atoms, rows, target, lasso_weight, code, scratch, correlation) <= tolerance:
            return
