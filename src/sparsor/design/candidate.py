"""The validation error E of one candidate Phi, compiled."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from sparsor.design.lars import solve_lasso

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design.monte_carlo import Problem


def reconstruction_error(
    problem: Problem,
    phi: NDArray[np.bool_],
    cells: NDArray[np.int64],
    atoms: NDArray[np.float64],
    limit: float,
) -> float | None:
    """Return E, the mean squared l2 error over the validation maps (Algorithm 1, lines 13 to 19).

    Cells outside an area do not count.

    Parameters
    ----------
    problem : Problem
    phi : array of bool (M, N)
    cells : array of int64 (n,)
        The columns of Phi that hold a 1.
    atoms : array of float64 (K, M)
        ``(Phi Psi)^T``.
    limit : float
        Of the mean error: as it only grows from map to map, a candidate beyond it is given up.

    Returns
    -------
    float or None
        None when the limit was passed.
    """
    total = _summed_error(
        phi,
        cells,
        atoms,
        problem.maps,
        problem.psi,
        problem.legs.allowed,
        problem.lasso_weight,
        limit * len(problem.maps),
    )
    return None if total < 0 else float(total / len(problem.maps))


@njit(cache=True, nogil=True)
def _summed_error(
    phi: NDArray[np.bool_],
    cells: NDArray[np.int64],
    atoms: NDArray[np.float64],
    maps: NDArray[np.float64],
    psi: NDArray[np.float64],
    allowed: NDArray[np.bool_],
    lasso_weight: float,
    limit: float,
) -> float:
    """Return the summed squared error, or -1 once it is beyond `limit`."""
    K, M = atoms.shape
    gram = np.empty((K, K))
    known = np.zeros(K, dtype=np.bool_)
    code = np.empty(K)
    target = np.empty(M)
    total = 0.0
    for i in range(maps.shape[0]):
        for m in range(M):
            target[m] = 0.0
            for cell in cells:
                if phi[m, cell]:
                    target[m] += maps[i, cell]
        code[:] = 0.0
        solve_lasso(atoms, target, lasso_weight, gram, known, code)
        used = np.flatnonzero(code)
        for cell in range(psi.shape[0]):
            if allowed[cell]:
                left = maps[i, cell]
                for k in used:
                    left -= code[k] * psi[cell, k]
                total += left * left
        if total > limit:
            return -1.0
    return total
