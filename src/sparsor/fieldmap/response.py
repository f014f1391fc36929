"""The air from the readings of a slow sensor: a regularised inverse of its first-order response."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.fieldmap import kalman

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.fieldmap.path import Path

TAU_PER_T90: Final = 1.0 / math.log(10.0)
FEWEST_TO_FIT: Final = 30
"""From fewer values noise and air cannot be told apart."""
_FIT_BLOCKS, _FIT_BLOCK = 8, 512
_LENGTHS_M = np.geomspace(20.0, 5000.0, 6)
_RATIOS = np.geomspace(0.1, 300.0, 6)
_WIDEST_LENGTH_M = (5.0, 100_000.0)
_WIDEST_RATIO = (1e-3, 1e4)
_QUICKER = (0.0, 1 / 3)
_CLEARLY = 10.0  # of twice the log likelihood: scripts/bench/measuring.py counts how often it is wrong


@dataclass(frozen=True)
class AirModel:
    """How readings come about: air that varies along the way, seen through a slow and noisy sensor.

    Parameters
    ----------
    tau_s : float
        Time constant of the sensor; 0 when it answers at once.
    level : float
        Mean of the air.
    spread : float
        Standard deviation of the air around it.
    length_m : float
        Over which the air varies (Matern-3/2).
    noise_sd : float
        Of a single reading.
    """

    tau_s: float
    level: float
    spread: float
    length_m: float
    noise_sd: float

    @property
    def rate(self) -> float:
        """The Matern-3/2 kernel's rate, 1/m."""
        return math.sqrt(3.0) / self.length_m


@dataclass(frozen=True, eq=False)
class Air:
    """What the air was at each sample.

    Parameters
    ----------
    value, variance : array of float64 (n,)
    reading, reading_variance : array of float64 (n,)
        What the sensor would have shown without noise.
    predicted, adjoint, link : array of float64 (n, 3, 3)
        From which covariances between samples follow; see `kalman.smooth`.
    """

    value: NDArray[np.float64]
    variance: NDArray[np.float64]
    reading: NDArray[np.float64]
    reading_variance: NDArray[np.float64]
    predicted: NDArray[np.float64]
    adjoint: NDArray[np.float64]
    link: NDArray[np.float64]

    def mean_variance(self, first: NDArray[np.int64], last: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the variance of the mean air from sample `first` to sample `last`, of each pair of them."""
        return kalman.mean_variances(first, last, self.predicted, self.adjoint, self.link)


def fit_air(
    path: Path,
    reading: NDArray[np.float64],
    usable: NDArray[np.bool_],
    *,
    t90_s: float,
    noise_sd: float | None = None,
    near: AirModel | None = None,
) -> AirModel:
    """Estimate by maximum likelihood how much the air varies, over which length, and how noisy the readings are.

    Parameters
    ----------
    path : Path
    reading : array of float64 (n,)
    usable : array of bool (n,)
        The others are passed over.
    t90_s : float
        Time to 90 % of a step; 0 when the sensor answers at once.
    noise_sd : float, optional
        When it is known and not to be estimated.
    near : AirModel, optional
        An estimate to start from.
    """
    from scipy.optimize import minimize

    level = float(reading[usable].mean()) if usable.any() else 0.0
    tau_s = t90_s * TAU_PER_T90
    parts = _fitting_parts(path, reading - level, usable)

    def misfit(point: NDArray[np.float64]) -> tuple[float, float]:
        length_m, ratio = _parameters(point)
        scale = 1.0 if noise_sd is None else noise_sd
        squares, logs, count = _likelihood(parts, AirModel(tau_s, 0.0, ratio * scale, length_m, scale))
        if count == 0:
            return 0.0, scale
        if noise_sd is not None:
            return squares + logs, noise_sd
        variance = max(squares / count, 1e-24)
        return count * math.log(variance) + logs, math.sqrt(variance)

    begin = np.zeros(2)
    if near is None:
        points = [np.log([length, ratio]) for length in _LENGTHS_M for ratio in _RATIOS]
        begin[:] = min(points, key=lambda point: misfit(point)[0])
    else:
        begin[:] = np.log([near.length_m, max(near.spread, 1e-12) / max(near.noise_sd, 1e-12)])

    def objective(point: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
        return misfit(point)[0]

    found = minimize(objective, begin, method="Nelder-Mead", options={"xatol": 0.05, "fatol": 0.1})
    length_m, ratio = _parameters(found.x)
    noise = misfit(found.x)[1]
    return AirModel(tau_s, level, ratio * noise, length_m, noise)


def quicker_fits_better(model: AirModel, path: Path, reading: NDArray[np.float64], usable: NDArray[np.bool_]) -> bool:
    """Return whether the readings tell clearly against a sensor as slow as the fitted one.

    Parameters
    ----------
    model : AirModel
        As `fit_air` returns it.
    path : Path
    reading : array of float64 (n,)
    usable : array of bool (n,)
    """
    if model.tau_s == 0 or usable.sum() < FEWEST_TO_FIT:
        return False
    parts = _fitting_parts(path, reading - model.level, usable)
    slow = sum(_likelihood(parts, model)[:2])
    for share in _QUICKER:
        t90_s = share * model.tau_s / TAU_PER_T90
        quick = fit_air(path, reading, usable, t90_s=t90_s, near=model)
        if slow - sum(_likelihood(parts, quick)[:2]) > _CLEARLY:
            return True
    return False


def estimate_air(model: AirModel, path: Path, reading: NDArray[np.float64], usable: NDArray[np.bool_]) -> Air:
    """Return the air at every sample, also at those that are not usable, from the usable ones before and after.

    Parameters
    ----------
    model : AirModel
    path : Path
    reading : array of float64 (n,)
    usable : array of bool (n,)
    """
    state, covariance, predicted, adjoint, link = kalman.smooth(
        np.where(usable, reading - model.level, 0.0),
        usable,
        path.duration_s,
        path.step_m,
        path.turn,
        path.start,
        model.tau_s,
        model.spread,
        model.rate,
        model.noise_sd,
    )
    return Air(
        value=state[:, 1] + model.level,
        variance=np.maximum(covariance[:, 1, 1], 0.0),
        reading=state[:, 0] + model.level,
        reading_variance=np.maximum(covariance[:, 0, 0], 0.0),
        predicted=predicted,
        adjoint=adjoint,
        link=link,
    )


def _likelihood(parts: list[_Part], model: AirModel) -> tuple[float, float, int]:
    """Return the two parts of minus twice the log likelihood, of squares and of logarithms, and the values' number."""
    squares, logs, count = 0.0, 0.0, 0
    for part in parts:
        way = part.path
        one = kalman.likelihood(
            part.value,
            part.usable,
            way.duration_s,
            way.step_m,
            way.turn,
            way.start,
            model.tau_s,
            model.spread,
            model.rate,
            model.noise_sd,
        )
        squares, logs, count = squares + one[0], logs + one[1], count + one[2]
    return squares, logs, count


def _parameters(point: NDArray[np.float64]) -> tuple[float, float]:
    length_m, ratio = np.exp(np.clip(point, -30.0, 30.0))
    return float(np.clip(length_m, *_WIDEST_LENGTH_M)), float(np.clip(ratio, *_WIDEST_RATIO))


@dataclass(frozen=True, eq=False)
class _Part:
    path: Path
    value: NDArray[np.float64]
    usable: NDArray[np.bool_]


def _fitting_parts(path: Path, value: NDArray[np.float64], usable: NDArray[np.bool_]) -> list[_Part]:
    """Return the samples to fit on: all of them, or blocks spread over a long log."""
    n = value.size
    if n <= _FIT_BLOCKS * _FIT_BLOCK:
        return [_Part(path, value, usable)]
    begins = np.linspace(0, n - _FIT_BLOCK, _FIT_BLOCKS).astype(int)
    blocks = [slice(begin, begin + _FIT_BLOCK) for begin in begins]
    return [_Part(path.take(rows), value[rows], usable[rows]) for rows in blocks]
