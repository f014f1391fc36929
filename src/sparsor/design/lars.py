"""The LASSO, solved exactly by least-angle regression, compiled.

Minimises ``1/2 |A c - y|^2 + lambda |c|_1`` (the paper's Eq. 3). The path of solutions is piecewise linear in
lambda; the homotopy starts where the solution is zero and follows it, atom by atom, down to the lambda asked
for (Osborne, Presnell & Turlach 2000; Efron, Hastie, Johnstone & Tibshirani 2004). The scale is that of
scikit-learn's ``sparse_encode``: the squared error is not divided by the number of rows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

# An atom whose part outside the span of the active ones is below this share of its squared norm adds nothing.
_COLLINEAR = 1e-12
# Largest violation of the optimality conditions, as a share of max |A^T y|, that is left to rounding.
# (An uncentred dictionary of 1024 atoms ends its path at about 1e-10.)
_OPTIMAL = 1e-9
_MAX_SWEEPS = 1000


def lasso(A: NDArray[np.float64], targets: NDArray[np.float64], lasso_weight: float) -> NDArray[np.float64]:
    """Return the LASSO codes of several right-hand sides.

    Parameters
    ----------
    A : array of float64 (M, K)
        Measured atoms, ``Phi Psi``.
    targets : array of float64 (n, M)
        One measurement vector a row.
    lasso_weight : float
        The l1 weight lambda, above 0.

    Returns
    -------
    array of float64 (n, K)

    Examples
    --------
    >>> lasso(np.eye(2), np.array([[3.0, 0.5]]), 1.0)  # soft thresholding
    array([[2., 0.]])
    """
    atoms = np.ascontiguousarray(A.T, dtype=np.float64)
    codes = np.zeros((targets.shape[0], atoms.shape[0]))
    gram = np.empty((atoms.shape[0], atoms.shape[0]))
    known = np.zeros(atoms.shape[0], dtype=np.bool_)
    for target, code in zip(np.ascontiguousarray(targets, dtype=np.float64), codes, strict=True):
        solve_lasso(atoms, target, lasso_weight, gram, known, code)
    return codes


@njit(cache=True, nogil=True)
def solve_lasso(
    atoms: NDArray[np.float64],
    target: NDArray[np.float64],
    lasso_weight: float,
    gram: NDArray[np.float64],
    known: NDArray[np.bool_],
    code: NDArray[np.float64],
) -> None:
    """Solve one LASSO into `code`.

    Parameters
    ----------
    atoms : array of float64 (K, M)
        Measured atoms, one a row.
    target : array of float64 (M,)
    lasso_weight : float
    gram, known : arrays (K, K) and (K,)
        Inner products of the atoms, row by row as they are first needed; share them between targets.
    code : array of float64 (K,)
        Zeros on entry, the solution on return.
    """
    correlation = atoms @ target
    scale = np.abs(correlation).max()
    if scale <= lasso_weight:
        return
    _follow_path(atoms, correlation, lasso_weight, gram, known, code)
    if _violation(atoms, target, lasso_weight, code) > _OPTIMAL * scale:
        _descend(atoms, target, lasso_weight, code, _OPTIMAL * scale)


@njit(cache=True, nogil=True)
def _follow_path(
    atoms: NDArray[np.float64],
    correlation: NDArray[np.float64],
    lasso_weight: float,
    gram: NDArray[np.float64],
    known: NDArray[np.bool_],
    code: NDArray[np.float64],
) -> None:
    """Follow the solution path from the largest correlation down to `lasso_weight`."""
    K, M = atoms.shape
    limit = min(K, M)
    active = np.empty(limit, dtype=np.int64)
    sign = np.empty(limit)
    triangle = np.empty((limit, limit))  # Cholesky factor of the active atoms' Gram matrix
    direction = np.empty(limit)
    slope = np.empty(K)
    out = np.zeros(K, dtype=np.uint8)  # 1: active, 2: collinear with the active atoms
    count = 0
    joining = int(np.argmax(np.abs(correlation)))
    dropped = -1
    level = abs(correlation[joining])
    for _ in range(20 * (limit + 1)):
        if joining >= 0:
            if count < limit and _append(gram, known, atoms, active, triangle, count, joining):
                active[count] = joining
                sign[count] = 1.0 if correlation[joining] > 0 else -1.0
                out[joining] = 1
                count += 1
            else:
                out[joining] = 2
        if count == 0:
            return
        _solve(triangle, sign, direction, count)
        slope[:] = 0.0
        for k in range(count):
            weight = direction[k]
            row = gram[active[k]]
            for j in range(K):
                slope[j] += weight * row[j]
        step, joining = _next_join(correlation, slope, level, out, dropped)
        dropping = -1
        for k in range(count):
            if direction[k] * sign[k] < 0.0:
                distance = -code[active[k]] / direction[k]
                if distance < step:
                    step, dropping, joining = distance, k, -1
        finished = step >= level - lasso_weight
        if finished:
            step = level - lasso_weight
        for k in range(count):
            code[active[k]] += step * direction[k]
        if finished:
            return
        for j in range(K):
            correlation[j] -= step * slope[j]
        level -= step
        dropped = -1
        if dropping >= 0:
            dropped = active[dropping]
            code[dropped] = 0.0
            out[dropped] = 0
            for k in range(dropping, count - 1):
                active[k] = active[k + 1]
                sign[k] = sign[k + 1]
            count -= 1
            for k in range(K):  # the span has shrunk: atoms set aside may count again
                if out[k] == 2:
                    out[k] = 0
            _factorise(gram, active, triangle, dropping, count)


@njit(cache=True, nogil=True)
def _next_join(
    correlation: NDArray[np.float64],
    slope: NDArray[np.float64],
    level: float,
    out: NDArray[np.uint8],
    dropped: int,
) -> tuple[float, int]:
    """Return the step to where an inactive atom is as correlated as the active ones, and that atom."""
    step = level
    joining = -1
    for j in range(correlation.size):
        if out[j] != 0:
            continue
        rising = 1.0 - slope[j]
        falling = 1.0 + slope[j]
        # An atom that has just left lies on the boundary: it may come back on the other side only.
        if rising > 1e-14 and not (j == dropped and correlation[j] > 0.0):
            distance = (level - correlation[j]) / rising
            if distance < step:
                step, joining = max(distance, 0.0), j
        if falling > 1e-14 and not (j == dropped and correlation[j] < 0.0):
            distance = (level + correlation[j]) / falling
            if distance < step:
                step, joining = max(distance, 0.0), j
    return step, joining


@njit(cache=True, nogil=True)
def _append(
    gram: NDArray[np.float64],
    known: NDArray[np.bool_],
    atoms: NDArray[np.float64],
    active: NDArray[np.int64],
    triangle: NDArray[np.float64],
    count: int,
    atom: int,
) -> bool:
    """Add an atom's row to the Cholesky factor; False when it is collinear with the active ones."""
    if not known[atom]:
        gram[atom] = atoms @ atoms[atom]
        known[atom] = True
    return _factor_row(gram, active, triangle, count, atom)


@njit(cache=True, nogil=True)
def _factor_row(
    gram: NDArray[np.float64], active: NDArray[np.int64], triangle: NDArray[np.float64], row: int, atom: int
) -> bool:
    norm = gram[atom, atom]
    rest = norm
    for k in range(row):
        value = gram[atom, active[k]]
        for i in range(k):
            value -= triangle[row, i] * triangle[k, i]
        value /= triangle[k, k]
        triangle[row, k] = value
        rest -= value * value
    if rest <= _COLLINEAR * norm:
        return False
    triangle[row, row] = np.sqrt(rest)
    return True


@njit(cache=True, nogil=True)
def _factorise(
    gram: NDArray[np.float64],
    active: NDArray[np.int64],
    triangle: NDArray[np.float64],
    first: int,
    count: int,
) -> None:
    """Factorise again from row `first` on, after an atom has left."""
    for row in range(first, count):
        _factor_row(gram, active, triangle, row, active[row])


@njit(cache=True, nogil=True)
def _solve(
    triangle: NDArray[np.float64], right: NDArray[np.float64], solution: NDArray[np.float64], count: int
) -> None:
    """Solve ``L L^T solution = right``."""
    for i in range(count):
        value = right[i]
        for k in range(i):
            value -= triangle[i, k] * solution[k]
        solution[i] = value / triangle[i, i]
    for i in range(count - 1, -1, -1):
        value = solution[i]
        for k in range(i + 1, count):
            value -= triangle[k, i] * solution[k]
        solution[i] = value / triangle[i, i]


@njit(cache=True, nogil=True)
def _violation(
    atoms: NDArray[np.float64], target: NDArray[np.float64], lasso_weight: float, code: NDArray[np.float64]
) -> float:
    """Return the largest violation of the optimality (KKT) conditions."""
    residual = target.copy()
    for k in range(code.size):
        if code[k] != 0.0:
            residual -= code[k] * atoms[k]
    correlation = atoms @ residual
    worst = 0.0
    for k in range(code.size):
        if code[k] > 0.0:
            gap = abs(correlation[k] - lasso_weight)
        elif code[k] < 0.0:
            gap = abs(correlation[k] + lasso_weight)
        else:
            gap = abs(correlation[k]) - lasso_weight
        worst = max(worst, gap)
    return worst


@njit(cache=True, nogil=True)
def _descend(
    atoms: NDArray[np.float64],
    target: NDArray[np.float64],
    lasso_weight: float,
    code: NDArray[np.float64],
    tolerance: float,
) -> None:
    """Repair what rounding left of the path's end, by coordinate descent; rare (collinear atoms)."""
    residual = target.copy()
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
        if sweep % 10 == 9 and _violation(atoms, target, lasso_weight, code) <= tolerance:
            return
