"""The drift of a sensor, told from the air where a route meets itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.fieldmap.observing import Observations
    from sparsor.fieldmap.response import AirModel
    from sparsor.geodesy.grid import Grid

FEWEST_REVISITS: Final = 3
SIGNIFICANT_SD: Final = 2.0
_APART = 0.25  # of the flight's time: what is nearer in time is one visit
_MOST_PASSES = 1500
_S_PER_H = 3600.0


@dataclass(frozen=True)
class Drift:
    """A linear drift of the sensor.

    Parameters
    ----------
    rate_per_h, sd_per_h : float
        In the sensor's unit per hour, and how far that may be off; NaN when nothing tells.
    revisits : int
        Passes made in or beside a cell of an earlier one.
    applied : bool
        Whether it was taken off: when it is significant.
    """

    rate_per_h: float
    sd_per_h: float
    revisits: int
    applied: bool


NO_DRIFT: Final = Drift(float("nan"), float("nan"), 0, applied=False)


def estimate_drift(
    observations: Observations,
    time_s: NDArray[np.float64],
    cell: NDArray[np.int64],
    grid: Grid,
    model: AirModel,
) -> Drift:
    """Estimate level and drift together by generalised least squares.

    The air is the random field that was fitted along the way, so that passes near to each other tell of the drift
    and a slope of the field along the route does not pass for one.

    Parameters
    ----------
    observations : Observations
    time_s : array of float64 (p,)
        Of the passes, on one clock.
    cell : array of int64 (p,)
    grid : Grid
    model : AirModel
    """
    if time_s.size < FEWEST_REVISITS + 1:
        return NO_DRIFT
    revisits = _revisits(time_s, cell, grid)
    if revisits < FEWEST_REVISITS:
        return Drift(float("nan"), float("nan"), revisits, applied=False)
    rows = np.unique(np.linspace(0, time_s.size - 1, min(time_s.size, _MOST_PASSES)).astype(int))
    hours = (time_s[rows] - time_s[rows].mean()) / _S_PER_H
    weights = observations.weights[rows]
    covariance = _air_covariance(weights, grid, model) + np.diag(observations.variance[rows])
    X = np.column_stack((np.ones(hours.size), hours))
    whitened = np.linalg.solve(np.linalg.cholesky(covariance), np.column_stack((X, observations.value[rows])))
    information = whitened[:, :2].T @ whitened[:, :2]
    inverse = np.linalg.inv(information)
    best = inverse @ (whitened[:, :2].T @ whitened[:, 2])
    rate = float(best[1])
    # Passes that scatter more than was assumed tell less.
    excess = np.square(whitened[:, 2] - whitened[:, :2] @ best).sum() / (hours.size - 2)
    sd = float(np.sqrt(inverse[1, 1] * max(excess, 1.0)))
    return Drift(rate, sd, revisits, applied=abs(rate) > SIGNIFICANT_SD * sd)


def drift_at(drift: Drift, time_s: NDArray[np.float64], begin_s: float) -> NDArray[np.float64]:
    """Return what is to be taken off at each time if the sensor was right at `begin_s`."""
    return drift.rate_per_h * (time_s - begin_s) / _S_PER_H if drift.applied else np.zeros_like(time_s)


def drift_sd_at(
    drift: Drift, expected_sd_per_h: float, time_s: NDArray[np.float64], begin_s: float
) -> NDArray[np.float64]:
    """Return how far what was taken off may be off, at each time; errors of all times go together.

    A drift that is expected stays as uncertain as that: the decoder, which knows the map better, tells it from its own
    fit, and what is known from the same readings is not to count twice.
    """
    sd_per_h = max(expected_sd_per_h, drift.sd_per_h) if drift.applied else expected_sd_per_h
    return sd_per_h * (time_s - begin_s) / _S_PER_H


def _revisits(time_s: NDArray[np.float64], cell: NDArray[np.int64], grid: Grid) -> int:
    """Count the passes in the same or a neighbouring cell as one that was made much earlier."""
    row, column = np.divmod(cell, grid.shape[1])
    earliest = np.full((grid.shape[0] + 2, grid.shape[1] + 2), np.inf)
    np.minimum.at(earliest, (row + 1, column + 1), time_s)
    around = np.stack([earliest[row + down, column + right] for down in range(3) for right in range(3)])
    return int((time_s - around.min(axis=0) > _APART * np.ptp(time_s)).sum())


def slope_variance(model: AirModel) -> float:
    """Return the variance of the air's slope in any one direction, per square metre."""
    return (model.spread * model.rate) ** 2


def _air_covariance(weights: NDArray[np.float64], grid: Grid, model: AirModel) -> NDArray[np.float64]:
    touched = np.flatnonzero(weights.any(axis=0))
    apart = model.rate * grid.lengths_m()[np.ix_(touched, touched)]
    kernel = model.spread**2 * (1.0 + apart) * np.exp(-apart)
    shares = weights[:, touched]
    return np.asarray(shares @ kernel @ shares.T, dtype=np.float64)
