"""The binary measurement matrix Phi: drawing, Enhanced Sparsification, measured atoms, incoherence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray


def draw_phi(rng: np.random.Generator, rows: int, cells: int, probability: float, theta: int) -> NDArray[np.bool_]:
    """Draw a random binary matrix and prune it (Algorithm 1, lines 3 and 5).

    Parameters
    ----------
    rng : numpy.random.Generator
    rows, cells : int
        M and N.
    probability : float
        Of a 1 in each entry.
    theta : int
        Enhanced Sparsification (the paper's Eq. 11): a column with fewer than `theta` ones is set to zero;
        0 or 1 turns it off.

    Returns
    -------
    array of bool (M, N)
    """
    phi = rng.random((rows, cells)) < probability
    phi[:, phi.sum(axis=0) < theta] = False
    return phi


@njit(cache=True, nogil=True)
def measured_atoms(phi: NDArray[np.bool_], cells: NDArray[np.int64], psi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``(Phi Psi)^T``: the atoms as the rows of Phi measure them, (K, M).

    Parameters
    ----------
    phi : array of bool (M, N)
    cells : array of int64 (n,)
        The columns of Phi that hold a 1.
    psi : array of float64 (N, K)
    """
    rows = phi.shape[0]
    sums = np.zeros((rows, psi.shape[1]))
    for m in range(rows):
        for cell in cells:
            if phi[m, cell]:
                sums[m] += psi[cell]
    return sums.T.copy()


def incoherence(atoms: NDArray[np.float64], phi: NDArray[np.bool_], *, unit_rows: bool = True) -> float:
    """Return mu, the largest absolute inner product between rows of Phi and atoms of Psi (the paper's Eq. 7).

    Parameters
    ----------
    atoms : array of float64 (K, M)
        ``(Phi Psi)^T`` for atoms of unit norm.
    phi : array of bool (M, N)
    unit_rows : bool
        Whether rows of Phi are scaled to unit l2 norm, so that mu lies in 0..1; the paper takes them as they
        are. Empty rows count for nothing.
    """
    largest = np.abs(atoms).max(axis=0)
    if unit_rows:
        largest = largest / np.sqrt(np.maximum(phi.sum(axis=1), 1))
    return float(largest.max())
