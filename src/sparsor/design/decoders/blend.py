"""The blend: training covariance and exponential kernel, mixed as decodes the validation maps best."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.sparse import csr_array

from sparsor.design.decoders.covariance import kernel_covariance
from sparsor.prior.statistics import Kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design.decoders.rehearsal import Rehearsal
    from sparsor.design.decoders.setting import Setting

MIXES = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.99, 1.0)
LENGTHS_CELLS = (1.5, 3.0, 6.0, 12.0, 24.0, 96.0)
NUGGETS = (0.0, 1e-4, 1e-3, 1e-2)


@dataclass(frozen=True)
class Blend:
    """``alpha C + (1 - alpha) exp(-d / ell)``, and a nugget on the readings; all of amplitude 1.

    Parameters
    ----------
    alpha : float
        Share of the training covariance.
    length_cells : float
        ell.
    nugget : float
        Variance of the readings that neither part explains.
    """

    alpha: float
    length_cells: float
    nugget: float


_START = Blend(0.5, 12.0, 1e-4)


def choose_blend(setting: Setting, rehearsal: Rehearsal) -> Blend:
    """Return the blend with the lowest error on the rehearsed validation maps.

    The amplitude is taken as known here, the one that the maps were given: then a blend is one gain matrix for all.
    """
    shape, allowed = setting.model.shape, setting.allowed
    rows = csr_array(setting.measurements.weights)
    own = _Part.of(setting.training, rows)
    kernels = {
        length: _Part.of(kernel_covariance(shape, Kernel(1.0, length, 0.0), allowed), rows) for length in LENGTHS_CELLS
    }
    noise = setting.noise.covariance / rehearsal.amplitude**2 + np.diag(setting.nugget)

    @cache
    def error(blend: Blend) -> float:
        mixed = own.mixed(blend.alpha, kernels[blend.length_cells])
        try:
            return rehearsal.mean_error(mixed.decode(rehearsal.values, noise, blend.nugget))
        except LinAlgError:  # too smooth for readings without noise
            return np.inf

    best, before = _START, None
    while best != before:  # one choice at a time, until none changes: each change lowers the error
        before = best
        best = min([best, *(replace(best, length_cells=length) for length in LENGTHS_CELLS)], key=error)
        best = min([best, *(replace(best, alpha=alpha) for alpha in MIXES)], key=error)
        best = min([best, *(replace(best, nugget=nugget) for nugget in NUGGETS)], key=error)
    return best


@dataclass(frozen=True)
class _Part:
    """A covariance as measurements see it: between cells and readings, and between readings."""

    towards: NDArray[np.float64]
    inner: NDArray[np.float64]

    @classmethod
    def of(cls, covariance: NDArray[np.float64], rows: csr_array[np.float64, tuple[int, int]]) -> _Part:
        towards = np.asarray(rows @ covariance).T
        return cls(towards, np.asarray(rows @ towards))

    def mixed(self, share: float, other: _Part) -> _Part:
        return _Part(share * self.towards + (1 - share) * other.towards, share * self.inner + (1 - share) * other.inner)

    def decode(self, values: NDArray[np.float64], noise: NDArray[np.float64], nugget: float) -> NDArray[np.float64]:
        """Return the maps (n, N) of measured values (n, m) by universal kriging with unknown level."""
        inner = self.inner + noise
        inner[np.diag_indices_from(inner)] += nugget
        solved = cho_solve(
            cho_factor(inner, lower=True, overwrite_a=True, check_finite=False),
            np.column_stack([values.T, np.ones(len(inner))]),
            check_finite=False,
        )
        ones = solved[:, -1]
        level = solved[:, :-1].sum(axis=0) / ones.sum()
        return np.asarray((level + self.towards @ (solved[:, :-1] - np.outer(ones, level))).T)
