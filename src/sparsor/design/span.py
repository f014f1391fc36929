"""Errors of whole maps, in the coordinates of the dictionary's span."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sparsor.design.basis import aligned

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Span(NamedTuple):
    """Validation maps and atoms in an orthonormal basis of the atoms' span, over the cells that count.

    With ``Psi = Q R``, ``|s - Psi c|^2 = |s - Q Q^T s|^2 + |Q^T s - R c|^2``: a quarter of the numbers at
    K = N / 4, and the first term is what no code whatever can go below.

    Parameters
    ----------
    atoms : array of float64 (K, r)
        ``R^T``: one atom a row.
    maps : array of float64 (n, r)
        ``Q^T s`` of each map.
    floor : array of float64 (n,)
        The squared l2 error that is left outside the span.
    by_cell : array of float64 (N, n)
        The maps themselves, transposed, for sums over cells.
    """

    atoms: NDArray[np.float64]
    maps: NDArray[np.float64]
    floor: NDArray[np.float64]
    by_cell: NDArray[np.float64]


def span_of(psi: NDArray[np.float64], maps: NDArray[np.float64], allowed: NDArray[np.bool_]) -> Span:
    """Return maps and atoms in the coordinates of the dictionary's span.

    Parameters
    ----------
    psi : array of float64 (N, K)
    maps : array of float64 (n, N)
    allowed : array of bool (N,)
        The cells whose error counts.
    """
    basis, triangle = np.linalg.qr(psi[allowed])
    inside = maps[:, allowed] @ basis
    outside = maps[:, allowed] - inside @ basis.T
    atoms, by_cell = aligned(*triangle.T.shape), aligned(*maps.T.shape)
    atoms[:], by_cell[:] = triangle.T, maps.T
    return Span(atoms, inside, np.square(outside).sum(axis=1), by_cell)
