"""Whether a vehicle stands on the ground, leaves it, or fell: by what it says, and by its positions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sparsor.geodesy.lengths import distance_m

if TYPE_CHECKING:
    from sparsor.link.flights.views import Fix

# MAV_LANDED_STATE; rovers say nothing of the kind (0).
ON_GROUND, IN_AIR, TAKING_OFF, LANDING = 1, 2, 3, 4
FLYING: Final = frozenset({IN_AIR, TAKING_OFF, LANDING})
OFF_GROUND_M: Final = 1.0
MOVING_M_S: Final = 1.0
MOVED_M: Final = 5.0  # a slow boat is under way too
FALL_M_S: Final = 4.0  # no autopilot lands so fast
FALL_S: Final = 5.0


class Ground:
    """Follows one vehicle's EXTENDED_SYS_STATE and its positions; times are the vehicle's own."""

    def __init__(self) -> None:
        self._state = 0
        self._fix: Fix | None = None
        self._stood: Fix | None = None  # where it was armed
        self._armed = False
        self._fell_s: float | None = None
        self._stands_since_s: float | None = None

    def says(self, state: int) -> bool:
        """Take what it says of itself (MAV_LANDED_STATE); return whether it has just landed."""
        before, self._state = self._state, state
        return state == ON_GROUND and before in FLYING

    def disarmed(self) -> bool:
        """Take that it was disarmed; return whether it has just landed and has not said so yet."""
        return self._state in FLYING and self.is_under and self.says(ON_GROUND)

    def take(self, fix: Fix, down_m_s: float, *, armed: bool, done: bool) -> None:
        """Take a position; `done` says that the mission has no waypoint left."""
        self._fix, self._armed = fix, armed
        if down_m_s > FALL_M_S:
            self._fell_s = fix.time_s
        if not armed or self._stood is None:
            self._stood = fix
        down = self._state == ON_GROUND or (done and self.is_under)
        if not armed or not down or fix.ground_speed_m_s >= MOVING_M_S:
            self._stands_since_s = None
        elif self._stands_since_s is None:
            self._stands_since_s = fix.time_s

    @property
    def is_left(self) -> bool:
        """Whether the vehicle is under way, given that it is armed."""
        fix, stood = self._fix, self._stood
        if self._state in FLYING:
            return True
        # Where it says that it stands on the ground, what it moves is noise; heights begin anew when it is armed.
        if self._state == ON_GROUND or not self._armed or fix is None or stood is None:
            return False
        moved_m = float(distance_m(stood.lon_deg, stood.lat_deg, [fix.lon_deg], [fix.lat_deg])[0])
        return fix.height_m >= OFF_GROUND_M or fix.ground_speed_m_s >= MOVING_M_S or moved_m >= MOVED_M

    @property
    def is_under(self) -> bool:
        """Whether the vehicle is on the ground, as far as it tells."""
        fix = self._fix
        if fix is not None and self._fell_s is not None and fix.time_s - self._fell_s < FALL_S:
            return False  # a copter that is disarmed in the air calls itself landed (ArduPilot)
        return self._state == ON_GROUND or (fix is not None and fix.height_m < OFF_GROUND_M)

    @property
    def stands_s(self) -> float:
        """How long it has been standing there, armed and still; 0 when it does not."""
        if self._fix is None or self._stands_since_s is None:
            return 0.0
        return self._fix.time_s - self._stands_since_s
