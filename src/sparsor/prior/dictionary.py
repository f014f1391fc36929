"""Dictionaries Psi: learned from maps, and the two pre-defined ones the paper compares with."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Literal

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.errors import ModelError

if TYPE_CHECKING:
    from numpy.typing import NDArray

DictionaryName = Literal["learned", "dct", "polynomial"]

_ALPHA = 0.5  # l1 weight while learning, for maps on the 0..1 scale; 0.1 is slower and no better (decisions/0003)
_EPOCHS = 20
_BATCH = 32
_MOST_STEPS = 800  # large sets of maps are as well learned from fewer epochs
_ROUNDING = 1e-9  # maps on the 0..1 scale that differ by less than this are alike
_ENERGY_LEFT = 1e-8  # of the maps, outside the subspace in which the atoms are learned


def learned_dictionary(
    maps: NDArray[np.float64], atoms: int, *, seed: int, progress: Progress = silent
) -> NDArray[np.float64]:
    """Learn a dictionary from maps (the paper's Eq. 5, by scikit-learn's online solver).

    The atoms lie in the span of the maps, so they are learned in the coordinates of the maps' principal
    components, which changes nothing but the time it takes.

    Parameters
    ----------
    maps : array of float64 (n, N)
        Training maps on the 0..1 scale, the mean taken off where the model is centred.
    atoms : int
        K. With fewer maps than atoms, K is the number of maps.
    seed : int
    progress : Progress

    Returns
    -------
    array of float64 (N, K)
        Atoms of unit l2 norm, one a column.

    Raises
    ------
    ModelError
        When there are fewer than two maps, fewer than two atoms are asked for, or the maps are all alike.
    """
    if atoms < 2:
        raise ModelError(f"atoms is {atoms}; a dictionary needs at least 2")
    if len(maps) < 2:
        raise ModelError(f"a dictionary cannot be learned from {len(maps)} map(s); at least 2 are needed")
    from sklearn.decomposition import MiniBatchDictionaryLearning
    from sklearn.exceptions import ConvergenceWarning

    atoms = min(atoms, len(maps))
    coordinates, axes = _principal_coordinates(maps)
    steps = min(_EPOCHS * -(-len(maps) // _BATCH), _MOST_STEPS)
    learner = MiniBatchDictionaryLearning(
        atoms, alpha=_ALPHA, fit_algorithm="lars", batch_size=_BATCH, random_state=seed
    )
    order = np.random.default_rng(seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # LARS on nearly collinear atoms says so each step
        for step in range(steps):
            batch = order.choice(len(coordinates), size=min(_BATCH, len(coordinates)), replace=False)
            learner.partial_fit(coordinates[batch])
            progress("learning the dictionary", step + 1, steps)
    return _unit_columns((learner.components_ @ axes).T)


def dct_dictionary(shape: tuple[int, int], atoms: int) -> NDArray[np.float64]:
    """Return the 2-D DCT-II atoms of lowest frequency, (N, K) orthonormal columns.

    Raises
    ------
    ModelError
        When more atoms than cells are asked for.
    """
    return _separable(shape, atoms, [_dct_basis(side) for side in shape])


def polynomial_dictionary(shape: tuple[int, int], atoms: int) -> NDArray[np.float64]:
    """Return products of Legendre polynomials of lowest total degree, (N, K), of unit norm on the grid.

    The polynomials are made orthonormal on the grid's points.

    Raises
    ------
    ModelError
        When more atoms than cells are asked for.
    """
    return _separable(shape, atoms, [_legendre_basis(side) for side in shape])


def _principal_coordinates(maps: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    _, spread, axes = np.linalg.svd(maps, full_matrices=False)
    energy = np.square(spread)
    if not spread[0] > _ROUNDING:
        raise ModelError("the training maps are all alike: there is nothing to learn from them")
    kept = int(np.searchsorted(np.cumsum(energy), (1 - _ENERGY_LEFT) * energy.sum())) + 1
    return maps @ axes[:kept].T, axes[:kept]


def _unit_columns(psi: NDArray[np.float64]) -> NDArray[np.float64]:
    norms = np.linalg.norm(psi, axis=0)
    return np.ascontiguousarray(psi[:, norms > 0] / norms[norms > 0])


def _separable(shape: tuple[int, int], atoms: int, bases: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    if not 2 <= atoms <= shape[0] * shape[1]:
        raise ModelError(f"atoms is {atoms}; this dictionary has 2..{shape[0] * shape[1]}")
    row, column = (order.ravel() for order in np.indices(shape))
    chosen = np.lexsort((row, np.maximum(row, column), row + column))[:atoms]
    product = bases[0][:, None, row[chosen]] * bases[1][None, :, column[chosen]]
    return _unit_columns(product.reshape(-1, atoms))


def _dct_basis(side: int) -> NDArray[np.float64]:
    place, order = np.arange(side)[:, None] + 0.5, np.arange(side)
    return np.asarray(np.cos(np.pi * place * order / side))


def _legendre_basis(side: int) -> NDArray[np.float64]:
    place = (2 * np.arange(side) + 1) / side - 1
    return np.asarray(np.linalg.qr(np.polynomial.legendre.legvander(place, side - 1))[0])
