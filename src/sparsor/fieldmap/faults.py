"""Readings that a sensor's own faults have spoilt: they are marked and left out, never taken away."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.fieldmap.response import FEWEST_TO_FIT, AirModel, estimate_air, fit_air

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.fieldmap.path import Path
    from sparsor.fieldmap.response import Air
    from sparsor.vehicle.sensor import SensorProfile

SPIKE_SD: Final = 5.0
"""A reading this many standard deviations from what the others say of it is a spike."""
MOST_IN_A_ROW: Final = 2
FROZEN_S: Final = 20.0
"""A reading that stays the same for longer, where noise should move it, is frozen."""
_LEAST_SPIKE = 0.05  # of the readings' range: less is the model's misfit where there is hardly any noise
_FIRST_SPIKE_SD = 8.0
_BY_CHANCE = 1e-4
_MOST_ROUNDS = 6
_MAD_TO_SD = 1.4826


class Reason(StrEnum):
    """Why a sample is not used; USED is empty."""

    USED = ""
    NOT_IN_FLIGHT = "not at the mission's height"
    OUTSIDE = "outside the grid"
    UNCALIBRATED = "nothing to calibrate with"
    WARM_UP = "sensor warming up"
    SATURATED = "sensor saturated"
    FROZEN = "sensor frozen"
    SPIKE = "spike"


FAULTS: Final = (Reason.UNCALIBRATED, Reason.WARM_UP, Reason.SATURATED, Reason.FROZEN, Reason.SPIKE)


def sensor_faults(
    time_s: NDArray[np.float64], boot: NDArray[np.int64], reading: NDArray[np.float64], profile: SensorProfile
) -> NDArray[np.str_]:
    """Return a `Reason` for each reading that tells of warm-up, saturation or a frozen sensor.

    Parameters
    ----------
    time_s, boot : arrays (n,)
    reading : array of float64 (n,)
        As the sensor gave it.
    profile : SensorProfile
    """
    reasons = np.full(reading.size, Reason.USED, dtype="<U32")
    for number in np.unique(boot):
        rows = np.flatnonzero(boot == number)
        reasons[rows[frozen(time_s[rows], reading[rows])]] = Reason.FROZEN
    if profile.range is not None:
        low, high = profile.range
        reasons[(reading <= low) | (reading >= high)] = Reason.SATURATED
    for number in np.unique(boot):
        rows = np.flatnonzero(boot == number)
        reasons[rows[time_s[rows] - time_s[rows[0]] < profile.warm_up_s]] = Reason.WARM_UP
    return reasons


def frozen(time_s: NDArray[np.float64], reading: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which readings repeat the one before for too long to be chance.

    A coarse sensor repeats itself now and then: how often, the readings outside a run tell. A sensor that mostly
    repeats itself has no noise to be missed.

    Parameters
    ----------
    time_s, reading : array of float64 (n,)
    """
    marked = np.zeros(reading.size, dtype=np.bool_)
    if reading.size < 2:
        return marked
    edges = np.flatnonzero(np.concatenate(([True], np.diff(reading) != 0, [True])))
    first, last = edges[:-1], edges[1:] - 1
    repeats = (last - first).astype(np.float64)
    others = reading.size - 1 - repeats
    share = (repeats.sum() - repeats + 1.0) / (others + 2.0)
    chance = reading.size * share**repeats
    long = (time_s[last] - time_s[first] >= FROZEN_S) & (share < 0.5) & (chance < _BY_CHANCE)
    for begin, end in zip(first[long], last[long], strict=True):
        marked[begin + 1 : end + 1] = True  # the first of them was a reading
    return marked


def fit_without_spikes(
    path: Path, reading: NDArray[np.float64], usable: NDArray[np.bool_], *, t90_s: float, noise_sd: float
) -> tuple[AirModel, Air, NDArray[np.bool_]]:
    """Fit the air to the readings and find those that do not belong to it.

    A reading is judged by what all others say of it, until the set of spikes rests.

    Parameters
    ----------
    path : Path
    reading : array of float64 (n,)
    usable : array of bool (n,)
    t90_s : float
    noise_sd : float
        Of the sensor's profile; counts where there are too few readings to estimate it.

    Returns
    -------
    model : AirModel
    air : Air
    spike : array of bool (n,)
    """
    few = usable.sum() < FEWEST_TO_FIT
    known_noise = noise_sd if few and noise_sd > 0 else None
    spike = _standing_out(path, reading, usable)
    low, high = np.percentile(reading[usable], [2, 98]) if usable.any() else (0.0, 0.0)
    least = _LEAST_SPIKE * (high - low)
    model = fit_air(path, reading, usable & ~spike, t90_s=t90_s, noise_sd=known_noise)
    air = estimate_air(model, path, reading, usable & ~spike)
    for _ in range(0 if few else _MOST_ROUNDS):  # a few readings do not tell which of them is wrong
        found = _spikes(model, air, reading, usable, usable & ~spike, least)
        if np.array_equal(found, spike):
            break
        spike = found
        model = fit_air(path, reading, usable & ~spike, t90_s=t90_s, noise_sd=known_noise, near=model)
        air = estimate_air(model, path, reading, usable & ~spike)
    return model, air, spike


def _spikes(
    model: AirModel,
    air: Air,
    reading: NDArray[np.float64],
    usable: NDArray[np.bool_],
    believed: NDArray[np.bool_],
    least: float,
) -> NDArray[np.bool_]:
    """Return which usable readings lie too far from what the believed others say."""
    noise = model.noise_sd**2
    away = np.abs(reading - air.reading)
    # A believed reading has pulled the estimate its way: away / sd is that of an estimate without it.
    variance = np.where(believed, np.maximum(noise - air.reading_variance, 0.01 * noise), noise + air.reading_variance)
    pulled = np.where(believed, variance / max(noise, 1e-300), 1.0)
    return _isolated(usable & (away > SPIKE_SD * np.sqrt(variance)) & (away / pulled > least))


def _isolated(out: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return those of the readings far out that stand alone: several in a row are the edge of a plume."""
    edges = np.flatnonzero(np.diff(out.astype(np.int8), prepend=0, append=0))
    kept = np.zeros(out.size, dtype=np.bool_)
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        kept[begin:end] = end - begin <= MOST_IN_A_ROW
    return kept


def _standing_out(path: Path, reading: NDArray[np.float64], usable: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return readings that stand out from both their neighbours: coarse, but no fit is needed."""
    spike = np.zeros(reading.size, dtype=np.bool_)
    rows = np.flatnonzero(usable)
    if rows.size < FEWEST_TO_FIT:
        return spike
    value = reading[rows]
    out = np.zeros(rows.size)
    out[1:-1] = value[1:-1] - (value[:-2] + value[2:]) / 2
    out[path.start[rows]] = 0.0
    away = np.abs(out)
    sd = _MAD_TO_SD * float(np.median(away))
    highest = np.ones(rows.size, dtype=np.bool_)
    highest[1:] &= away[1:] >= away[:-1]
    highest[:-1] &= away[:-1] >= away[1:]
    spike[rows[highest & (away > _FIRST_SPIKE_SD * sd) & (sd > 0)]] = True
    return spike
