"""A vehicle's time since boot along a log, and where in the log it was booted again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

RESTART_S = 5.0
"""A clock that falls back farther than this was started again; messages overtake each other by less."""
_NEIGHBOURS = 7
_AT_ONCE = 1 << 16


@dataclass(frozen=True, eq=False)
class Clock:
    """A vehicle's time at places in the log.

    Parameters
    ----------
    order : array of int64 (n,)
        Places in the log, increasing.
    received_s : array of float64 (n,)
        Unix time on the recorder's clock, which may step; NaN when there is none.
    time_s : array of float64 (n,)
        The vehicle's seconds since boot.
    boot : array of int64 (n,)
        Number of the boot.
    """

    order: NDArray[np.int64]
    received_s: NDArray[np.float64]
    time_s: NDArray[np.float64]
    boot: NDArray[np.int64]

    def at(
        self, order: NDArray[np.int64], received_s: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return the vehicle's time and boot at other places in the log.

        Between two readings of the clock the recorder's clock divides the time, or, where it steps, the number of
        messages does. Before the first reading and behind the last one it is that reading.

        Parameters
        ----------
        order : array of int64 (m,)
        received_s : array of float64 (m,)

        Returns
        -------
        time_s : array of float64 (m,)
        boot : array of int64 (m,)
        """
        time_s, boot = np.empty(order.size), np.empty(order.size, dtype=np.int64)
        for start in range(0, order.size, _AT_ONCE):  # what is worked out on the way is many times the result
            rows = slice(start, start + _AT_ONCE)
            time_s[rows], boot[rows] = self._at(order[rows], received_s[rows])
        return time_s, boot

    def _at(
        self, order: NDArray[np.int64], received_s: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        after = np.clip(np.searchsorted(self.order, order, side="right"), 1, max(self.order.size - 1, 1))
        after = np.minimum(after, self.order.size - 1)
        before = np.maximum(after - 1, 0)
        span = np.maximum(self.order[after] - self.order[before], 1)
        part = np.clip((order - self.order[before]) / span, 0.0, 1.0)
        passed_s = self.received_s[after] - self.received_s[before]
        since_s = received_s - self.received_s[before]
        steady = (passed_s > 0) & (since_s >= 0) & (since_s <= passed_s) & (part > 0) & (part < 1)
        part = np.where(steady, since_s / np.where(passed_s > 0, passed_s, 1.0), part)
        across = self.boot[before] != self.boot[after]  # nothing lies between two boots
        part = np.where(across, np.round(part), part)
        time_s = self.time_s[before] + part * (self.time_s[after] - self.time_s[before])
        return time_s, np.where(part > 0.5, self.boot[after], self.boot[before])

    def runs_at(self, order: NDArray[np.int64], received_s: NDArray[np.float64], within_s: float) -> NDArray[np.bool_]:
        """Return whether the clock was read, by the recorder's clock, shortly before or after places in the log.

        A file may hold values for longer than the vehicle was heard, or without it. Where there is no recorder's clock
        the places in the log are all that counts.
        """
        after = np.clip(np.searchsorted(self.order, order, side="right"), 0, self.order.size - 1)
        before = np.maximum(after - 1, 0)
        apart_s = np.fmin(*(np.abs(received_s - self.received_s[row]) for row in (before, after)))
        return ~(apart_s > within_s)


def boots_of(time_s: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the number of the boot for each reading of a clock, in the order in which they came.

    A single reading out of line is not a boot: the median of its neighbours is what has to fall back.

    Examples
    --------
    >>> boots_of(np.array([50.0, 51.0, 52.0, 20.0, 53.0, 54.0, 2.0, 3.0, 4.0, 5.0])).tolist()
    [0, 0, 0, 0, 0, 0, 1, 1, 1, 1]
    """
    from scipy.ndimage import median_filter

    if time_s.size == 0:
        return np.zeros(0, dtype=np.int64)
    smooth = median_filter(time_s, size=min(_NEIGHBOURS, time_s.size), mode="nearest")
    fell = np.flatnonzero(np.diff(smooth) < -RESTART_S)
    boots = np.zeros(time_s.size, dtype=np.int64)
    for group in np.split(fell, np.flatnonzero(np.diff(fell) > _NEIGHBOURS) + 1):
        if group.size:  # the median may fall in steps; the clock itself fell where it fell deepest
            first = max(int(group[0]) - _NEIGHBOURS // 2, 0)
            falls = np.diff(time_s[first : int(group[-1]) + _NEIGHBOURS // 2 + 2])
            boots[first + int(np.argmin(falls)) + 1] = 1
    return np.asarray(np.cumsum(boots), dtype=np.int64)
