"""How far a vehicle went between samples, where it turned, and how fast it was."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.core.compiled import njit
from sparsor.geodesy.lengths import distance_m

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.flightlog.sampling import Samples

LONGEST_PAUSE_S: Final = 120.0
"""After a longer silence what the sensor held before says nothing any more."""
DWELL_M_S: Final = 1.0
"""Below this speed a vehicle is taken to dwell."""
_HEADING_M = 3.0  # a heading from a shorter way is the position's noise
_M_PER_DEG = 111_195.0  # for directions, which need no ellipsoid


@dataclass(frozen=True, eq=False)
class Path:
    """The way from sample to sample; row i is the step that ends at sample i.

    Parameters
    ----------
    time_s : array of float64 (n,)
        Ascending within a piece.
    step_m : array of float64 (n,)
        Way from the sample before; 0 at a start.
    turn : array of float64 (n,)
        Cosine of the change of heading at the beginning of the step.
    start : array of bool (n,)
        The first sample of a piece: of a boot, or after a long silence.
    """

    time_s: NDArray[np.float64]
    step_m: NDArray[np.float64]
    turn: NDArray[np.float64]
    start: NDArray[np.bool_]

    @property
    def duration_s(self) -> NDArray[np.float64]:
        """Time of each step; 0 at a start."""
        passed = np.diff(self.time_s, prepend=self.time_s[:1])
        return np.where(self.start, 0.0, np.maximum(passed, 0.0))

    def speed_m_s(self) -> NDArray[np.float64]:
        """Return the speed at each sample, over the steps before and after it."""
        way = self.step_m + np.append(self.step_m[1:], 0.0)
        passed = self.duration_s + np.append(self.duration_s[1:], 0.0)
        speed: NDArray[np.float64] = np.divide(way, passed, out=np.zeros_like(way), where=passed > 0)
        return speed

    def take(self, rows: slice) -> Path:
        """Return a part of the way; its first sample is a start."""
        start = self.start[rows].copy()
        start[:1] = True
        return Path(self.time_s[rows], self.step_m[rows], self.turn[rows], start)


def path_of(samples: Samples) -> Path:
    """Return the way between samples."""
    lon, lat = samples.lon_deg, samples.lat_deg
    start = np.ones(lon.size, dtype=np.bool_)
    passed = np.diff(samples.time_s)
    start[1:] = (np.diff(samples.boot) != 0) | (passed > LONGEST_PAUSE_S) | (passed < 0)
    step_m = np.zeros(lon.size)
    rise_m = np.nan_to_num(np.diff(samples.alt_m))
    step_m[1:] = np.where(start[1:], 0.0, np.hypot(distance_m(lon[:-1], lat[:-1], lon[1:], lat[1:]), rise_m))
    east_m = np.unwrap(lon, period=360.0) * np.cos(np.radians(lat.mean() if lat.size else 0.0)) * _M_PER_DEG
    return Path(samples.time_s, step_m, _turns(east_m, lat * _M_PER_DEG, start), start)


@njit(cache=True, nogil=True)
def _turns(east_m: NDArray[np.float64], north_m: NDArray[np.float64], start: NDArray[np.bool_]) -> NDArray[np.float64]:
    turn = np.ones(east_m.size)
    from_east, from_north, heading, known = 0.0, 0.0, 0.0, False
    for i in range(east_m.size):
        if start[i]:
            from_east, from_north, known = east_m[i], north_m[i], False
            continue
        east, north = east_m[i] - from_east, north_m[i] - from_north
        if east * east + north * north < _HEADING_M * _HEADING_M:
            continue
        now = np.arctan2(north, east)
        if known:
            turn[i] = np.cos(now - heading)
        heading, known = now, True
        from_east, from_north = east_m[i], north_m[i]
    return turn
