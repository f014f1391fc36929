"""Flight items as MAVLink stores them (MISSION_ITEM_INT), and those that we write."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.errors import MissionError

if TYPE_CHECKING:
    from sparsor.vehicle import Autopilot

# MAV_CMD (MAVLink common.xml).
NAV_WAYPOINT = 16
NAV_LOITER_UNLIM = 17
NAV_LOITER_TURNS = 18
NAV_LOITER_TIME = 19
NAV_RETURN_TO_LAUNCH = 20
NAV_LAND = 21
NAV_TAKEOFF = 22
NAV_LOITER_TO_ALT = 31
NAV_SPLINE_WAYPOINT = 82
NAV_VTOL_TAKEOFF = 84
NAV_VTOL_LAND = 85
NAV_DELAY = 93
NAV_PAYLOAD_PLACE = 94
DO_CHANGE_SPEED = 178
DO_SET_RELAY = 181
DO_SET_SERVO = 183
DO_LAND_START = 189
DO_SET_CAM_TRIGG_DIST = 206
DO_SEND_SCRIPT_MESSAGE = 217

# MAV_FRAME: altitude above sea level, none (a command without a position), above home, above terrain.
FRAME_GLOBAL = 0
FRAME_MISSION = 2
FRAME_RELATIVE = 3
FRAME_TERRAIN = 10

WAYPOINTS = frozenset({NAV_WAYPOINT, NAV_SPLINE_WAYPOINT})
TAKE_OFFS = frozenset({NAV_TAKEOFF, NAV_VTOL_TAKEOFF})
LANDINGS = frozenset({NAV_LAND, NAV_VTOL_LAND})
LOITERS = frozenset({NAV_LOITER_UNLIM, NAV_LOITER_TURNS, NAV_LOITER_TIME, NAV_LOITER_TO_ALT})
ARDUPILOT_ONLY = frozenset({DO_SET_RELAY, DO_SET_SERVO, DO_SEND_SCRIPT_MESSAGE})  # PX4 refuses them in a mission
FLOWN_TO = WAYPOINTS | TAKE_OFFS | LANDINGS | LOITERS | {NAV_PAYLOAD_PLACE}
# An autopilot reads a missing position as "here" for these; for any other the position is the whole point.
POSITION_OPTIONAL = TAKE_OFFS | LANDINGS | {NAV_PAYLOAD_PLACE} | LOITERS

AIR_SPEED, GROUND_SPEED = 0.0, 1.0  # DO_CHANGE_SPEED parameter 1 (SPEED_TYPE)
KEEP_THROTTLE = -1.0  # DO_CHANGE_SPEED parameter 3


@dataclass(frozen=True)
class MissionItem:
    """One item of a mission (MAVLink MISSION_ITEM_INT, in degrees and metres).

    Parameters
    ----------
    command, frame : int
        MAV_CMD and MAV_FRAME.
    params : tuple of float (7,)
        Parameters 1 to 7; of an item with a position 5 is latitude, 6 longitude (degrees) and 7 altitude
        (metres, by the frame). NaN means "not given": allowed in 1 to 4, and in the position of commands that
        read it as "here".
    autocontinue : bool
        Whether the next item follows by itself.

    Raises
    ------
    MissionError
        When there are not seven parameters, one is infinite, or a position is missing or not on Earth.

    Examples
    --------
    >>> item = MissionItem(NAV_WAYPOINT, FRAME_RELATIVE, (5, 0, 0, 0, 25.3, 51.5, 50))
    >>> item.lon_deg, item.lat_deg, item.altitude_m
    (51.5, 25.3, 50.0)
    """

    command: int
    frame: int
    params: tuple[float, ...]
    autocontinue: bool = True

    def __post_init__(self) -> None:
        if len(self.params) != 7:
            raise MissionError(f"command {self.command} has {len(self.params)} parameters; an item has 7")
        # One NaN object for all: tuples then compare equal where both hold it.
        values = tuple(math.nan if math.isnan(value) else float(value) for value in self.params)
        object.__setattr__(self, "params", values)
        if any(math.isinf(value) for value in self.params):
            raise MissionError(f"command {self.command} has an infinite parameter: {self.params}")
        if self.command in FLOWN_TO:
            self._check_position()

    @property
    def has_position(self) -> bool:
        """Whether the vehicle flies to the position in this item."""
        return self.command in FLOWN_TO and not (math.isnan(self.lat_deg) or math.isnan(self.lon_deg))

    @property
    def lat_deg(self) -> float:
        """Parameter 5 of an item with a position."""
        return self.params[4]

    @property
    def lon_deg(self) -> float:
        """Parameter 6 of an item with a position."""
        return self.params[5]

    @property
    def altitude_m(self) -> float:
        """Parameter 7 of an item with a position; above what, the frame says."""
        return self.params[6]

    @property
    def hold_s(self) -> float:
        """Time that the vehicle waits at this item, seconds; 0 for what does not wait."""
        waits = self.command in WAYPOINTS or self.command in (NAV_LOITER_TIME, NAV_DELAY)
        return self.params[0] if waits and self.params[0] > 0 else 0.0

    def _check_position(self) -> None:
        lat, lon = self.lat_deg, self.lon_deg
        if math.isnan(lat) or math.isnan(lon):
            if self.command not in POSITION_OPTIONAL:
                raise MissionError(f"command {self.command} has no position: latitude {lat:g}, longitude {lon:g}")
        elif abs(lat) > 90 or abs(lon) > 180:
            raise MissionError(
                f"command {self.command} lies at latitude {lat:g}, longitude {lon:g}; "
                "allowed are -90..90 and -180..180 degrees"
            )
        if math.isnan(self.altitude_m) and self.command in WAYPOINTS:
            raise MissionError(f"command {self.command} at latitude {lat:g}, longitude {lon:g} has no altitude")


def take_off(
    lon_deg: float,
    lat_deg: float,
    altitude_m: float,
    autopilot: Autopilot,
    *,
    command: int = NAV_TAKEOFF,
    pitch_deg: float = 0.0,
) -> MissionItem:
    """Return a take-off; the position is always written out (a missing one becomes 0/0 on the way)."""
    return MissionItem(command, FRAME_RELATIVE, (pitch_deg, 0.0, 0.0, autopilot.yaw, lat_deg, lon_deg, altitude_m))


def change_speed(speed_m_s: float, kind: float = GROUND_SPEED) -> MissionItem:
    """Return DO_CHANGE_SPEED to a ground or air speed; frame 2, the only one that PX4 takes without a position."""
    return MissionItem(DO_CHANGE_SPEED, FRAME_MISSION, (kind, speed_m_s, KEEP_THROTTLE, 0.0, 0.0, 0.0, 0.0))


def waypoint(
    lon_deg: float, lat_deg: float, altitude_m: float, hold_s: float, radius_m: float, autopilot: Autopilot
) -> MissionItem:
    """Return NAV_WAYPOINT with its hold and the radius that counts as reached (0: the vehicle's own)."""
    return MissionItem(
        NAV_WAYPOINT, FRAME_RELATIVE, (hold_s, radius_m, 0.0, autopilot.yaw, lat_deg, lon_deg, altitude_m)
    )


def loiter(
    lon_deg: float, lat_deg: float, altitude_m: float, hold_s: float, radius_m: float, autopilot: Autopilot
) -> MissionItem:
    """Return NAV_LOITER_TIME, clockwise, left on the line to what follows (parameter 4).

    ArduPilot keeps only the direction of the radius, 1, and circles with WP_LOITER_RAD.
    """
    radius = radius_m if autopilot.waypoint_radius else 1.0
    return MissionItem(NAV_LOITER_TIME, FRAME_RELATIVE, (hold_s, 0.0, radius, 1.0, lat_deg, lon_deg, altitude_m))


def land_start() -> MissionItem:
    """Return DO_LAND_START: here begins the landing, which a failsafe may jump to."""
    return MissionItem(DO_LAND_START, FRAME_MISSION, (0.0,) * 7)


def loiter_to_altitude(lon_deg: float, lat_deg: float, altitude_m: float, radius_m: float) -> MissionItem:
    """Return NAV_LOITER_TO_ALT, clockwise, left with the heading (1) and on the line (4) to what follows."""
    return MissionItem(NAV_LOITER_TO_ALT, FRAME_RELATIVE, (1.0, radius_m, 0.0, 1.0, lat_deg, lon_deg, altitude_m))


def land(lon_deg: float, lat_deg: float, autopilot: Autopilot, *, command: int = NAV_LAND) -> MissionItem:
    """Return a landing at a position on the level of home."""
    return MissionItem(command, FRAME_RELATIVE, (0.0, 0.0, 0.0, autopilot.yaw, lat_deg, lon_deg, 0.0))
