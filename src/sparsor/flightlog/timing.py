"""When a value was measured, in the vehicle's time since boot: which clock its stamp is from is found, not believed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.flightlog.clocks import boots_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

VEHICLE, COMPANION, RECEIVE = "vehicle", "companion", "receive"
SHARED_S: Final = 1.0
"""Stamps on the vehicle's clock differ from it at arrival by less than this, for nearly all values.

A companion that was powered up with the vehicle counts from a second or two after it: a clock of its own."""
OWN_S: Final = 30.0
"""The same where the sender is the vehicle's autopilot: its stamps can be of no other clock, only late."""
FITTED_S: Final = 2.0
"""Stamps on a companion's clock lie as close as this to one line over the vehicle's clock at arrival."""
_NEARLY_ALL = 0.9
_HALF = 0.5  # a clock goes on while values arrive; zeros in a short log do not
_FEWEST = 5
_MOST = 300
# What one unit of the stamp is worth when the sender wrote another unit than the message says.
_SCALES = (1.0, 1e3, 1e-3, 1e6, 1e-6)


@dataclass(frozen=True)
class ClockUse:
    """Which clock some of the samples were timed by.

    Parameters
    ----------
    boot : int
        Of the vehicle.
    clock : str
        "vehicle": the stamps are the vehicle's time since boot; "companion": they are another clock, mapped by
        `rate` and `offset_s`; "receive": the stamps are useless, the vehicle's time at arrival counts; "file": a
        table's own times.
    rate : float
        Seconds of the sender's clock for one of the vehicle's.
    offset_s : float
        The vehicle's time when the sender's clock showed 0.
    residual_s : float
        Median distance of the mapped stamps from the vehicle's time at arrival.
    samples : int
    """

    boot: int
    clock: str
    rate: float
    offset_s: float
    residual_s: float
    samples: int


def vehicle_times(
    boot: int, stamp_s: NDArray[np.float64], heard_s: NDArray[np.float64], unix_offset_s: float, *, autopilot: bool
) -> tuple[NDArray[np.float64], NDArray[np.str_], list[ClockUse]]:
    """Return when values were measured, and by which clock that is known.

    Parameters
    ----------
    boot : int
        Number of the vehicle's boot in which all of them came.
    stamp_s : array of float64 (n,)
        The sender's stamps, in order of arrival.
    heard_s : array of float64 (n,)
        The vehicle's time at their arrival.
    unix_offset_s : float
        Unix time of the vehicle's power-up, for senders that stamp with the time of day; may be NaN.
    autopilot : bool
        Whether the sender is the vehicle's autopilot.

    Returns
    -------
    time_s : array of float64 (n,)
    clock : array of str (n,)
    uses : list of ClockUse
    """
    shared_s = _shared(stamp_s, heard_s, unix_offset_s, OWN_S if autopilot else SHARED_S)
    if shared_s is not None:
        return shared_s, np.full(stamp_s.size, VEHICLE), [_use(boot, VEHICLE, 1.0, 0.0, shared_s, heard_s)]
    time_s, clock = heard_s.copy(), np.full(stamp_s.size, RECEIVE, dtype="<U9")
    uses: list[ClockUse] = []
    run = boots_of(stamp_s)
    for number in np.unique(run):
        rows = run == number
        line = _line(stamp_s[rows], heard_s[rows])
        if line is None:
            uses.append(_use(boot, RECEIVE, float("nan"), float("nan"), heard_s[rows], heard_s[rows]))
            continue
        slope, offset_s = line
        time_s[rows] = slope * stamp_s[rows] + offset_s
        clock[rows] = COMPANION
        uses.append(_use(boot, COMPANION, 1.0 / slope, offset_s, time_s[rows], heard_s[rows]))
    return time_s, clock, uses


def _shared(
    stamp_s: NDArray[np.float64], heard_s: NDArray[np.float64], unix_offset_s: float, tolerance_s: float
) -> NDArray[np.float64] | None:
    """Return the stamps as the vehicle's time when that is what they are, in whatever unit."""
    for scale in _SCALES:
        for origin_s in (0.0, unix_offset_s):
            time_s = stamp_s * scale - origin_s
            with np.errstate(invalid="ignore"):
                near = np.abs(time_s - heard_s) <= tolerance_s
            if near.mean() >= _NEARLY_ALL and np.ptp(time_s[near]) >= _HALF * np.ptp(heard_s[near]):
                return np.asarray(np.where(near, time_s, heard_s), dtype=np.float64)
    return None


def _line(stamp_s: NDArray[np.float64], heard_s: NDArray[np.float64]) -> tuple[float, float] | None:
    """Fit the vehicle's time over the sender's by the median of slopes (Theil 1950, Sen 1968); None if it is no clock.

    Delays are one-sided and come in bursts, which the median does not see.
    """
    from scipy.stats import theilslopes

    good = np.flatnonzero(np.isfinite(stamp_s))
    if np.unique(stamp_s[good]).size < _FEWEST:
        return None
    few = good[np.linspace(0, good.size - 1, min(good.size, _MOST)).astype(np.intp)]
    fit = theilslopes(heard_s[few], stamp_s[few])
    if not fit.slope > 0:
        return None
    off_s = np.abs(heard_s[good] - fit.slope * stamp_s[good] - fit.intercept)
    if (off_s <= FITTED_S).mean() < _NEARLY_ALL or good.size < stamp_s.size:
        return None
    return float(fit.slope), float(fit.intercept)


def _use(
    boot: int, clock: str, rate: float, offset_s: float, time_s: NDArray[np.float64], heard_s: NDArray[np.float64]
) -> ClockUse:
    return ClockUse(boot, clock, rate, offset_s, float(np.median(np.abs(time_s - heard_s))), time_s.size)
