"""A sensor's own clock."""

from __future__ import annotations

from collections import deque
from typing import Final


class SensorClock:
    """A sensor's own times on our clock.

    A line cannot have been measured after it came, and some lines come with hardly any delay: the smallest
    difference between arrival and the sensor's time among the last lines is the offset of the clocks. A sensor
    that starts anew, or whose clock is set, begins anew here too: its lines would seem to come from the future,
    or to have been on the way for longer than `LATEST_S`.

    Examples
    --------
    >>> clock = SensorClock()
    >>> [round(clock.ours(own, arrived), 3) for own, arrived in ((1.0, 100.2), (2.0, 101.0), (3.0, 102.3))]
    [100.2, 101.0, 102.0]
    """

    LATEST_S: Final = 5.0
    LINES: Final = 60

    def __init__(self) -> None:
        self._offsets_s: deque[float] = deque(maxlen=self.LINES)

    def ours(self, own_s: float | None, arrived_s: float) -> float:
        """Return when a line was measured, on the clock of its arrival."""
        if own_s is None:
            return arrived_s
        offset_s = arrived_s - own_s
        if self._offsets_s and abs(offset_s - min(self._offsets_s)) > self.LATEST_S:
            self._offsets_s.clear()
        self._offsets_s.append(offset_s)
        return own_s + min(self._offsets_s)
