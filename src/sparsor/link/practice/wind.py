"""The wind that the practice vehicle flies in: steady, with gusts on top."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sparsor.core.streams import stream
from sparsor.errors import InputError

# Gusts forget themselves within this time: the along-wind length of the Dryden model (MIL-F-8785C) at 50 m, about
# 90 m, carried past a vehicle at some 20 m/s; one number for all heights and speeds.
GUST_TIME_S = 4.0
STREAM = 1  # of the seed; the sensor's noise is stream 0
STRONGEST_M_S = 60.0


@dataclass(frozen=True)
class WindSettings:
    """The wind as it is asked for; level, the same everywhere.

    Parameters
    ----------
    speed_m_s : float
        Of the steady wind.
    from_deg : float
        Where it comes from, clockwise from north, -360..360.
    gusts_m_s : float
        Standard deviation of the gusts, along and across.

    Raises
    ------
    InputError
        When a value is out of range.
    """

    speed_m_s: float = 0.0
    from_deg: float = 0.0
    gusts_m_s: float = 0.0

    def __post_init__(self) -> None:
        for what, value in (("a wind", self.speed_m_s), ("gusts", self.gusts_m_s)):
            if not 0 <= value <= STRONGEST_M_S:
                raise InputError(f"{what} of {value:g} m/s; allowed are 0..{STRONGEST_M_S:g}")
        if not -360 <= self.from_deg <= 360:
            raise InputError(f"a wind from {self.from_deg:g} degrees; allowed are -360..360, 90 comes from the east")


class Wind:
    """The wind now; `step` lets it change.

    Parameters
    ----------
    settings : WindSettings
    seed : int
        Of the gusts.
    """

    def __init__(self, settings: WindSettings, seed: int = 0) -> None:
        self.settings = settings
        self._draw = stream(seed, STREAM)
        towards = math.radians(settings.from_deg + 180.0)
        self._steady = settings.speed_m_s * math.sin(towards), settings.speed_m_s * math.cos(towards)
        self._gust = (0.0, 0.0)

    @property
    def east_m_s(self) -> float:
        """Towards the east."""
        return self._steady[0] + self._gust[0]

    @property
    def north_m_s(self) -> float:
        """Towards the north."""
        return self._steady[1] + self._gust[1]

    @property
    def speed_m_s(self) -> float:
        """Of wind and gust together."""
        return math.hypot(self.east_m_s, self.north_m_s)

    @property
    def from_deg(self) -> float:
        """Where it comes from now, 0..360."""
        return math.degrees(math.atan2(-self.east_m_s, -self.north_m_s)) % 360.0

    def step(self, dt_s: float) -> None:
        """Let `dt_s` seconds pass: a first-order Gauss-Markov process, whose spread does not depend on the step."""
        if self.settings.gusts_m_s == 0:
            return
        kept = math.exp(-dt_s / GUST_TIME_S)
        fresh = self.settings.gusts_m_s * math.sqrt(1.0 - kept * kept)
        east, north = self._draw.standard_normal(2)
        self._gust = kept * self._gust[0] + fresh * float(east), kept * self._gust[1] + fresh * float(north)
