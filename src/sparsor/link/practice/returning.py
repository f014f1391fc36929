"""Return to launch: up to the return height, straight home, down."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.link.practice.motion import Aim

if TYPE_CHECKING:
    from sparsor.link.practice.motion import Motion

OVER_HOME_M = 1.0
NEAR_HOME_M = 10.0
STILL_M_S = 0.5


class Return:
    """One return to launch; a new one begins with each change of mode."""

    def __init__(self) -> None:
        self._descending = False

    def aim(self, motion: Motion, height_m: float) -> Aim:
        """Return where to fly now, by the height at which to fly home (metres above it)."""
        cruise = motion.vehicle.cruise_m_s
        away = motion.distance_m(0.0, 0.0)
        self._descending |= away < OVER_HOME_M and motion.ground_speed_m_s < STILL_M_S
        if self._descending:
            return Aim(0.0, 0.0, 0.0, cruise, landing=True)
        if motion.up_m < height_m - 1.0 and away > NEAR_HOME_M:
            return motion.here(height_m)
        return Aim(0.0, 0.0, motion.up_m, cruise)
