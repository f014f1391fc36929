"""The LASSO, solved exactly by least-angle regression, compiled.

Minimises ``1/2 |A c - y|^2 + lambda |c|_1`` (the paper's Eq. 3). The path of solutions is piecewise linear in
lambda; the homotopy starts where the solution is zero and follows it, atom by atom, down to the lambda asked
for (Osborne, Presnell & Turlach 2000; Efron, Hastie, Johnstone & Tibshirani 2004). The scale is that of
scikit-learn's ``sparse_encode``: the squared error is not divided by the number of rows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sparsor.core.compiled import njit
from sparsor.design.basis import aligned, append, combine
from sparsor.design.homotopy import Room, advance, begin, join, leave, make_room, next_event
from sparsor.design.optimality import descend, violation

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Largest violation of the optimality conditions, as a share of max |A^T y|, that is left to rounding.
# (An uncentred dictionary of 1024 atoms ends its path at about 1e-10.)
_OPTIMAL = 1e-9
# Beyond this share the codes of the last active set are solved for once more.
_ROUNDED = 1e-13


class Atoms(NamedTuple):
    """The measured atoms of one candidate, and what its targets share.

    Parameters
    ----------
    columns, rows : arrays of float64 (K, M) and (M, K)
        ``Phi Psi``: one atom a row, and the same transposed.
    gram : array of float64 (K, K)
        Inner products of the atoms; a row is filled in when its atom first joins.
    known : array of bool (K,)
        Which rows are.
    """

    columns: NDArray[np.float64]
    rows: NDArray[np.float64]
    gram: NDArray[np.float64]
    known: NDArray[np.bool_]


def make_atoms(atoms: int, rows: int) -> Atoms:
    """Return room for `atoms` measured atoms of `rows` numbers."""
    return Atoms(aligned(atoms, rows), aligned(rows, atoms), aligned(atoms, atoms), np.zeros(atoms, dtype=np.bool_))


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
    M, K = A.shape
    atoms, room = make_atoms(K, M), make_room(K, M)
    atoms.rows[:], atoms.columns[:] = A, A.T
    codes = np.empty((targets.shape[0], K))
    for target, code in zip(np.ascontiguousarray(targets, dtype=np.float64), codes, strict=True):
        solve_lasso(atoms, target, lasso_weight, room, code)
    return codes


@njit(cache=True, nogil=True)
def solve_lasso(
    atoms: Atoms, target: NDArray[np.float64], lasso_weight: float, room: Room, code: NDArray[np.float64]
) -> None:
    """Solve one LASSO into `code`.

    Parameters
    ----------
    atoms : Atoms
    target : array of float64 (M,)
    lasso_weight : float
    room : Room
        Of `make_room`.
    code : array of float64 (K,)
        The solution on return.
    """
    K = code.size
    code[:] = 0.0
    combine(atoms.rows, target, room.correlation)
    first = 0
    for j in range(K):
        if abs(room.correlation[j]) > abs(room.correlation[first]):
            first = j
    scale = abs(room.correlation[first])
    if scale <= lasso_weight:
        return
    count = _follow_path(atoms, lasso_weight, room, first)
    for k in range(count):
        code[room.active[k]] = -room.correlation[K + room.place[k]]
    gap = violation(atoms.columns, atoms.rows, target, lasso_weight, code, room.residual, room.correlation)
    if gap > _ROUNDED * scale:
        _refine(room, lasso_weight, count, code)
        gap = violation(atoms.columns, atoms.rows, target, lasso_weight, code, room.residual, room.correlation)
    if gap > _OPTIMAL * scale:
        descend(atoms.columns, atoms.rows, target, lasso_weight, code, _OPTIMAL * scale)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _follow_path(atoms: Atoms, lasso_weight: float, room: Room, first: int) -> int:
    """Follow the path from the largest correlation, of `first`, down to lambda; return the number of active atoms."""
    factor, fit, active, place, sign = room.factor, room.fit, room.active, room.place, room.sign
    correlation, slope, barrier, distance = room.correlation, room.slope, room.barrier, room.distance
    K, limit = atoms.known.size, active.size
    begin(correlation, slope, sign, barrier, place, K)
    count = aside = 0
    joining, dropped, level = first, -1, abs(correlation[first])
    for _ in range(20 * (limit + 1)):
        if joining >= 0:
            barrier[joining] = np.inf
            if count < limit and _grow(atoms, factor, count, joining, place[count]):
                join(factor, fit, correlation, slope, sign, count, joining, K + place[count])
                active[count] = joining
                count += 1
            else:  # collinear with the active atoms
                aside += 1
        if count == 0:
            return 0
        step, event = next_event(correlation, slope, sign, barrier, distance, level, dropped)
        if step >= level - lasso_weight:
            advance(correlation, slope, level - lasso_weight)
            return count
        advance(correlation, slope, step)
        level -= step
        joining, dropped = event, -1
        if event >= K:
            position = 0
            while place[position] != event - K:
                position += 1
            joining, dropped = -1, active[position]
            leave(factor, fit, active, place, correlation, slope, sign, count, position, K)
            count -= 1
            barrier[dropped] = 0.0
            if aside > 0:  # the span has shrunk: atoms set aside may count again
                barrier[:K] = 0.0
                for k in range(count):
                    barrier[active[k]] = np.inf
                aside = 0
    return count


@njit(inline="always", cache=True, nogil=True)
def _grow(atoms: Atoms, factor: NDArray[np.float64], count: int, atom: int, place: int) -> bool:
    """Add an atom's row to the factor; False when it is collinear with the active ones."""
    if not atoms.known[atom]:
        combine(atoms.rows, atoms.columns[atom], atoms.gram[atom])
        atoms.known[atom] = True
    return append(factor, atoms.gram, count, atom, place)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _refine(room: Room, lasso_weight: float, count: int, code: NDArray[np.float64]) -> None:
    """Take off what rounding added along the path: ``G_a d = correlations - lambda signs``, codes plus d.

    The correlations are those of the residual; ``G_a^-1 = L^-T L^-1``.
    """
    K = code.size
    factor, active, place, change = room.factor, room.active, room.place, room.slope
    for k in range(count):
        change[K + place[k]] = 0.0
    for k in range(count):
        height = 0.0
        for i in range(k + 1):
            behind = K + place[i]
            height += factor[k, behind] * (room.correlation[active[i]] - lasso_weight * room.sign[behind])
        for i in range(k + 1):
            change[K + place[i]] += height * factor[k, K + place[i]]
    for k in range(count):
        code[active[k]] += change[K + place[k]]
