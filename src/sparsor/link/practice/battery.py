"""The battery of the practice vehicle: empty after the profile's endurance in the air, sooner against a wind."""

from __future__ import annotations

import math
from dataclasses import dataclass

CELLS = 4
CAPACITY_MAH = 10_000
IDLE_SHARE = 0.1
LOW = 0.15
CRITICAL = 0.05
# Of the power at cruise, what lifts; the rest overcomes drag and grows with the cube of the airspeed.
LIFTING_SHARE = 0.8


def flying_draw(airspeed_m_s: float, cruise_m_s: float) -> float:
    """Return what flying takes beside what it takes at cruise.

    Up to the cruise airspeed 1, so that a flight without wind lasts as long as the profile and the plan say.

    Examples
    --------
    >>> flying_draw(0.0, 10.0), round(flying_draw(15.0, 10.0), 3)
    (1.0, 1.475)
    """
    return max(1.0, LIFTING_SHARE + (1.0 - LIFTING_SHARE) * (airspeed_m_s / cruise_m_s) ** 3)


@dataclass
class Battery:
    """What is left, and what is drawn now.

    Parameters
    ----------
    endurance_s : float
        From full to empty in the air, seconds.
    level : float
        1 is full.
    draw : float
        Share of what flying takes: 0 with motors off.
    """

    endurance_s: float
    level: float = 1.0
    draw: float = 0.0

    @property
    def low(self) -> bool:
        """Whether it is time to come home."""
        return self.level < LOW

    @property
    def critical(self) -> bool:
        """Whether it is time to land where it is."""
        return self.level < CRITICAL

    @property
    def percent(self) -> int:
        """What is left, rounded up."""
        return math.ceil(self.level * 100.0)

    @property
    def volts(self) -> float:
        """Voltage of all cells."""
        return CELLS * (3.3 + 0.9 * self.level)

    @property
    def amperes(self) -> float:
        """Current drawn now."""
        return self.draw * CAPACITY_MAH / 1000.0 * 3600.0 / self.endurance_s

    @property
    def used_mah(self) -> int:
        """Charge used since power-up."""
        return round((1.0 - self.level) * CAPACITY_MAH)

    @property
    def seconds_left(self) -> int:
        """How long it lasts in the air."""
        return int(self.level * self.endurance_s)

    def run_low(self) -> None:
        """Fall to just below what counts as low."""
        self.level = min(self.level, 0.99 * LOW)

    def use(self, dt_s: float, draw: float = IDLE_SHARE) -> None:
        """Let `dt_s` seconds pass with the motors on; `draw` is a share of what cruising takes."""
        self.draw = draw
        self.level = max(0.0, self.level - self.draw * dt_s / self.endurance_s)
