"""How far a reconstruction is from the truth; every figure names one of these definitions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def squared_error(truth: NDArray[np.float64], estimate: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the squared l2 error of each whole map, ``|s - s_hat|^2``, (n,).

    Parameters
    ----------
    truth, estimate : array of float64 (n, N)
        One map a row, on the 0..1 scale of the training windows.
    """
    return np.asarray(np.square(truth - estimate).sum(axis=1))


def relative_error(truth: NDArray[np.float64], estimate: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``|s - s_hat| / |s|`` of each map, (n,); it depends on where the scale has its zero."""
    return np.asarray(np.linalg.norm(truth - estimate, axis=1) / np.linalg.norm(truth, axis=1))


def centred_relative_error(truth: NDArray[np.float64], estimate: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``|s - s_hat| / |s - mean(s)|`` of each map, (n,).

    The definition users are shown: it does not depend on the unit's zero or size. A map without any
    contrast has no such error and gives NaN.

    Examples
    --------
    >>> truth = np.array([[1.0, 3.0]])
    >>> centred_relative_error(truth, np.array([[2.0, 2.0]]))  # knowing only the mean
    array([1.])
    """
    spread = np.linalg.norm(truth - truth.mean(axis=1, keepdims=True), axis=1)
    error = np.linalg.norm(truth - estimate, axis=1)
    # The mean of equal values is rounded: what is left of them then is no contrast.
    contrast = np.ptp(truth, axis=1) > 0
    return np.asarray(np.divide(error, spread, out=np.full(spread.shape, np.nan), where=contrast))


def rmse(truth: NDArray[np.float64], estimate: NDArray[np.float64]) -> float:
    """Return the root mean squared error per cell, in the unit of the maps."""
    return float(np.sqrt(np.mean(np.square(truth - estimate))))
