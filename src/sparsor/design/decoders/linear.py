"""The linear decoders: kriging, the training maps' covariance (MMSE), and their blend."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from sparsor.design.decoders.blend import choose_blend
from sparsor.design.decoders.covariance import kernel_covariance, unit_kernel
from sparsor.design.decoders.fine import kernel_sum, upsampled
from sparsor.design.decoders.gaussian import System
from sparsor.prior.statistics import Kernel

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sparsor.design.decoders.rehearsal import Rehearsal
    from sparsor.design.decoders.setting import Estimate, Setting


@dataclass(frozen=True)
class LinearDecoder:
    """The posterior mean and variance under one covariance.

    Parameters
    ----------
    setting : Setting
    covariance : array of float64 (N, N)
        Of amplitude 1.
    settings : dict of str to float
        What was chosen on the validation maps.
    kernel : Kernel, optional
        The part of the covariance that is known between cells, amplitude included.
    nugget : float
        Variance of the readings added to the setting's.
    """

    setting: Setting
    covariance: NDArray[np.float64]
    settings: dict[str, float]
    kernel: Kernel | None = None
    nugget: float = 0.0

    @cached_property
    def system(self) -> System:
        """The linear system, factorised once."""
        readings = self.setting.measurements
        noise = self.setting.noise
        return System(
            self.covariance, readings.weights, noise.variance, self.setting.nugget + self.nugget, readings.drift_sd
        )

    def decode(self, values: NDArray[np.float64]) -> Estimate:
        """Return the maps measured as `values`, (n, m): one map a row."""
        return self.system.posterior(values)

    def trial(self, rehearsal: Rehearsal) -> Estimate:
        """Return the rehearsed validation maps, decoded."""
        return self.decode(rehearsal.values)

    def finer(self, estimate: Estimate, factor: int) -> NDArray[np.float64]:
        """Return the posterior mean of the first map on a grid `factor` times finer, (rows * factor * ...,).

        The kernel is evaluated at the finer grid's centres; what the covariance holds beside it, the training maps'
        part, is interpolated bilinearly between cell centres.
        """
        assert estimate.pull is not None
        shape = self.setting.model.shape
        sources = estimate.pull[0] @ self.setting.measurements.weights
        cells = estimate.mean[0]
        if self.kernel is None:
            return upsampled(cells, shape, factor)
        smooth = cells - kernel_sum(self.kernel, sources, shape, 1)
        return upsampled(smooth, shape, factor) + kernel_sum(self.kernel, sources, shape, factor)


def kriging(setting: Setting) -> LinearDecoder:
    """Return universal kriging with the model's exponential kernel."""
    shape, kernel = setting.model.shape, setting.model.kernel
    unit = unit_kernel(kernel, shape, setting.allowed)
    return LinearDecoder(setting, kernel_covariance(shape, unit, setting.allowed), {}, unit)


def mmse(setting: Setting) -> LinearDecoder:
    """Return the conditional mean under the training maps' covariance."""
    return LinearDecoder(setting, setting.training, {})


def blend(setting: Setting, rehearsal: Rehearsal) -> LinearDecoder:
    """Return the blend of both, as decodes the rehearsed validation maps best."""
    chosen = choose_blend(setting, rehearsal)
    shape, rest = setting.model.shape, 1 - chosen.alpha
    unit = unit_kernel(Kernel(1.0, chosen.length_cells, 0.0), shape, setting.allowed)
    return LinearDecoder(
        setting,
        chosen.alpha * setting.training + rest * kernel_covariance(shape, unit, setting.allowed),
        {"alpha": chosen.alpha, "length_cells": chosen.length_cells, "nugget": chosen.nugget},
        replace(unit, variance=rest * unit.variance) if rest > 0 else None,
        chosen.nugget,
    )
