"""The binary measurement matrix Phi: drawing, Enhanced Sparsification, measured atoms, incoherence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.compiled import njit

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
    return _pruned(rng.random((rows, cells)), probability, theta)


@njit(cache=True, nogil=True)
def _pruned(drawn: NDArray[np.float64], probability: float, theta: int) -> NDArray[np.bool_]:
    phi = drawn < probability
    ones = np.zeros(phi.shape[1], dtype=np.uint16)
    for m in range(phi.shape[0]):
        for cell in range(phi.shape[1]):
            ones[cell] += phi[m, cell]
    kept = ones >= theta
    for m in range(phi.shape[0]):
        for cell in range(phi.shape[1]):
            phi[m, cell] &= kept[cell]
    return phi


@njit(cache=True, nogil=True)
def visited_cells(phi: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the columns of Phi that hold a 1, ascending."""
    seen = np.zeros(phi.shape[1], dtype=np.bool_)
    for m in range(phi.shape[0]):
        for cell in range(phi.shape[1]):
            seen[cell] |= phi[m, cell]
    return np.flatnonzero(seen)


def measured_atoms(phi: NDArray[np.bool_], cells: NDArray[np.int64], psi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``(Phi Psi)^T``: the atoms as the rows of Phi measure them, (K, M).

    Parameters
    ----------
    phi : array of bool (M, N)
    cells : array of int64 (n,)
        The columns of Phi that hold a 1.
    psi : array of float64 (N, K)
    """
    sums = np.empty((phi.shape[0], psi.shape[1]))
    sum_cells(phi, cells, psi, sums)
    return sums.T.copy()


@njit(cache=True, nogil=True)
def sum_cells(
    phi: NDArray[np.bool_], cells: NDArray[np.int64], values: NDArray[np.float64], sums: NDArray[np.float64]
) -> None:
    """Write ``Phi values`` into `sums`, for the `cells` where Phi holds a 1.

    Parameters
    ----------
    phi : array of bool (M, N)
    cells : array of int64 (n,)
    values : array of float64 (N, k)
    sums : array of float64 (M, k)
    """
    for m in range(phi.shape[0]):
        for j in range(sums.shape[1]):
            sums[m, j] = 0.0
        for cell in cells:
            if phi[m, cell]:
                for j in range(sums.shape[1]):
                    sums[m, j] += values[cell, j]


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
    return float(_largest_product(atoms, phi.sum(axis=1), unit_rows))


@njit(cache=True, nogil=True)
def _largest_product(atoms: NDArray[np.float64], ones: NDArray[np.int64], unit_rows: bool) -> float:
    largest = 0.0
    for m in range(atoms.shape[1]):
        norm = np.sqrt(max(ones[m], 1)) if unit_rows else 1.0
        for k in range(atoms.shape[0]):
            largest = max(largest, abs(atoms[k, m]) / norm)
    return largest
