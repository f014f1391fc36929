"""The battery of the practice vehicle: empty after the profile's endurance in the air."""

from __future__ import annotations

import math
from dataclasses import dataclass

CELLS = 4
CAPACITY_MAH = 10_000
IDLE_SHARE = 0.1
LOW = 0.15


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

    def use(self, dt_s: float, *, flying: bool) -> None:
        """Let `dt_s` seconds pass with the motors on."""
        self.draw = 1.0 if flying else IDLE_SHARE
        self.level = max(0.0, self.level - self.draw * dt_s / self.endurance_s)
