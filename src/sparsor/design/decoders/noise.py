"""The noise of measurements: of each its own, and what a drift of the sensor adds to all of them together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Noise:
    """Noise of covariance ``R = D + u u^T``.

    Parameters
    ----------
    variance : array of float64 (m,)
        D, all above 0.
    drift : array of float64 (m,)
        u.
    """

    variance: NDArray[np.float64]
    drift: NDArray[np.float64]

    @property
    def covariance(self) -> NDArray[np.float64]:
        """R, (m, m)."""
        return np.diag(self.variance) + np.outer(self.drift, self.drift)

    def whitened(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return ``values A^T`` with ``A R A^T = I``: noise of variance 1, each its own, (..., m)."""
        return self._without_drift(values / self._root)

    def transposed(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return ``values A``, (..., m)."""
        return self._without_drift(values) / self._root

    def drift_in(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the drift to expect in values (n, m) that hold nothing but noise."""
        own = self.drift / self.variance
        share = (values @ own) / (1.0 + own @ self.drift)
        return np.asarray(share[:, None] * self.drift)

    @cached_property
    def _root(self) -> NDArray[np.float64]:
        return np.sqrt(self.variance)

    def _without_drift(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Multiply by ``(I + v v^T)^(-1/2)``, v being the drift on the scale of the noise."""
        v = self.drift / self._root
        square = float(v @ v)
        if square == 0:
            return values
        return np.asarray(values - np.multiply.outer(values @ v, v) * (1.0 - 1.0 / np.sqrt(1.0 + square)) / square)
