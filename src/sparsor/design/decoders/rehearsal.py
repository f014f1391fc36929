"""A dress rehearsal: the model's validation maps, measured as the flight measured and decoded as it will be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.metrics import centred_relative_error
from sparsor.core.streams import stream
from sparsor.errors import DesignError
from sparsor.prior.statistics import unit_shapes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design.decoders.setting import Setting

COVERAGE = 0.95
_NORMAL_QUANTILE = 1.959964
_STREAM = 4  # not one of the search's


@dataclass(frozen=True)
class Rehearsal:
    """Validation maps with the amplitude of the flown field, and what the flight would have measured of them.

    Parameters
    ----------
    maps : array of float64 (n, N)
        In the sensor's unit, level 0.
    values : array of float64 (n, m)
        Measured with the stated noise, drift included.
    allowed : array of bool (N,)
        Cells that count.
    amplitude : float
        Spread of each map over the cells that count.
    """

    maps: NDArray[np.float64]
    values: NDArray[np.float64]
    allowed: NDArray[np.bool_]
    amplitude: float

    def mean_error(self, decoded: NDArray[np.float64]) -> float:
        """Return the mean ``|s - s_hat| / |s - mean(s)|`` of decoded maps (n, N), cells that count only."""
        return float(centred_relative_error(self.maps[:, self.allowed], decoded[:, self.allowed]).mean())

    def widening(self, decoded: NDArray[np.float64], variance: NDArray[np.float64]) -> float:
        """Return the factor on the standard deviation with which 95 % of the cells lie within 1.96 of it."""
        missed = np.abs(self.maps - decoded)[:, self.allowed]
        return float(np.quantile(missed / np.sqrt(variance[:, self.allowed]), COVERAGE) / _NORMAL_QUANTILE)


def rehearse(setting: Setting, amplitude: float) -> Rehearsal:
    """Measure the validation maps as the flight did, all of one amplitude.

    Parameters
    ----------
    setting : Setting
    amplitude : float
        Spread that every map is given, in the sensor's unit.

    Raises
    ------
    DesignError
        When no validation map has contrast in the cells that count.
    """
    measurements = setting.measurements
    maps = amplitude * unit_shapes(setting.model.validation, setting.allowed)
    if not len(maps):
        raise DesignError("the validation maps have no contrast inside the area: no decoder can be judged on them")
    spread = np.sqrt(measurements.variance + amplitude**2 * setting.nugget)
    draw = stream(setting.seed, _STREAM)
    noise = spread * draw.standard_normal((len(maps), measurements.count))
    noise += measurements.drift_sd * draw.standard_normal((len(maps), 1))
    return Rehearsal(maps, maps @ measurements.weights.T + noise, setting.allowed, amplitude)
