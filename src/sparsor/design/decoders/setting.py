"""What a decoder is made for, and what every decoder returns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sparsor.design.decoders.covariance import training_covariance
from sparsor.design.decoders.noise import Noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design.decoders.measurements import Measurements
    from sparsor.design.decoders.rehearsal import Rehearsal
    from sparsor.prior.model import Model

_LEAST_NOISE = 1e-5  # sd, of the spread of the values: keeps systems without noise solvable


@dataclass(frozen=True)
class Estimate:
    """Several decoded maps, in the unit of the values.

    Parameters
    ----------
    mean, variance : array of float64 (n, N)
        Level included.
    level : array of float64 (n,)
        The constant part, a.
    pull : array of float64 (n, m), optional
        Of linear decoders: ``mean = level + C H^T pull``, which carries over to other places than cells.
    """

    mean: NDArray[np.float64]
    variance: NDArray[np.float64]
    level: NDArray[np.float64]
    pull: NDArray[np.float64] | None = None

    def spread(self, allowed: NDArray[np.bool_]) -> float:
        """Return the spread to expect of the first map around its mean: the decoded one's and what it leaves open."""
        return float(np.sqrt(self.mean[0, allowed].var() + self.variance[0, allowed].mean()))


class Decoder(Protocol):
    """Turns values measured in one setting into maps."""

    def decode(self, values: NDArray[np.float64]) -> Estimate:
        """Return the maps measured as `values`, (n, m): one map a row."""

    def trial(self, rehearsal: Rehearsal) -> Estimate:
        """Return the rehearsed validation maps, decoded without what is known of each one."""

    def finer(self, estimate: Estimate, factor: int) -> NDArray[np.float64] | None:
        """Return the first map on a grid `factor` times finer, or None where the decoder knows cells only."""

    @property
    def settings(self) -> dict[str, float]:
        """What was chosen for it on the validation maps."""


@dataclass(frozen=True)
class Setting:
    """Model, measurements and what counts.

    Parameters
    ----------
    model : Model
    measurements : Measurements
    allowed : array of bool (N,)
        Cells that count.
    nugget : array of float64 (m,)
        Variance of the readings around what their weights say, as a share of the amplitude's square.
    seed : int
        Of the rehearsal's noise and the bootstrap.
    """

    model: Model
    measurements: Measurements
    allowed: NDArray[np.bool_]
    nugget: NDArray[np.float64]
    seed: int

    @cached_property
    def noise(self) -> Noise:
        """Noise, its variances with a floor far below the spread of the values, so that none is 0."""
        variance = self.measurements.variance
        scale = float(value_scale(self.measurements.values[None], variance)[0])
        return Noise(np.maximum(variance, (_LEAST_NOISE * scale) ** 2), self.measurements.drift_sd)

    @cached_property
    def training(self) -> NDArray[np.float64]:
        """Covariance of the training maps, amplitude 1."""
        return training_covariance(self.model, self.allowed)


def value_scale(values: NDArray[np.float64], noise: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the spread of the values (n, m) of each map, or the noise's where that is more, (n,)."""
    rounding = 1e-9 * np.abs(values).max(axis=1)
    spread = np.maximum(values.std(axis=1), np.sqrt(noise.mean()))
    return np.asarray(np.maximum(np.maximum(spread, rounding), np.finfo(float).tiny ** 0.25))
