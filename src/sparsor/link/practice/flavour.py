"""How the two flavours differ: numbers, modes, habits, parameters.

ArduPilot's values were seen on ArduCopter 4.6 in SITL; PX4's are from its sources, a multicopter's defaults
(rc.mc_defaults; docs/practice-autopilot.md).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.errors import VehicleError


class Mode(Enum):
    """What the vehicle does; each flavour has its own number for it."""

    MANUAL = "manual"
    HOLD = "hold"
    GUIDED = "guided"
    TAKEOFF = "take-off"
    MISSION = "mission"
    RETURN = "return"
    LAND = "land"


def _px4(main: int, sub: int = 0) -> int:
    return main << 16 | sub << 24


@dataclass(frozen=True)
class Flavour:
    """One autopilot's habits.

    Parameters
    ----------
    name, title : str
        As typed, and as people write it.
    autopilot : int
        MAV_AUTOPILOT of the heartbeat.
    modes : tuple of (Mode, str, int)
        What each mode is called, and its custom_mode.
    start_mode : Mode
        After power-up.
    version : int
        AUTOPILOT_VERSION.flight_sw_version.
    retry_s, give_up_s : float
        Mission upload: an item is asked for again, and the transfer is given up, after so long.
    streams_unasked : bool
        Whether telemetry flows before anybody asks for it.
    disarm_s : float
        From landing to disarming.
    parameters : tuple of (str, float, int)
        Name, value and MAV_PARAM_TYPE.
    """

    name: str
    title: str
    autopilot: int
    modes: tuple[tuple[Mode, str, int], ...]
    start_mode: Mode
    version: int
    retry_s: float
    give_up_s: float
    streams_unasked: bool
    disarm_s: float
    parameters: tuple[tuple[str, float, int], ...]

    def on(self, kind: str) -> Flavour:
        """Return the flavour on a kind of vehicle: ArduPilot's modes have other numbers on planes and rovers."""
        if self.is_px4 or kind not in _ARDUPILOTS:
            return self
        title, modes = _ARDUPILOTS[kind]
        return replace(self, title=title, modes=modes)

    @property
    def is_px4(self) -> bool:
        """Whether this is the PX4 flavour."""
        return bool(self.autopilot == mavlink.MAV_AUTOPILOT_PX4)

    def custom_mode(self, mode: Mode) -> int:
        """Return HEARTBEAT.custom_mode of a mode."""
        return next(number for known, _, number in self.modes if known is mode)

    def mode_title(self, mode: Mode) -> str:
        """Return what the autopilot calls a mode."""
        return next(title for known, title, _ in self.modes if known is mode)

    def mode_of(self, custom_mode: int) -> Mode | None:
        """Return the mode of a custom_mode, None for one that this autopilot does not offer."""
        return next((mode for mode, _, number in self.modes if number == custom_mode), None)


_INT32, _REAL32, _INT8 = mavlink.MAV_PARAM_TYPE_INT32, mavlink.MAV_PARAM_TYPE_REAL32, mavlink.MAV_PARAM_TYPE_INT8

ARDUPILOT = Flavour(
    name="ardupilot",
    title="ArduCopter (practice)",
    autopilot=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
    modes=(
        (Mode.MANUAL, "STABILIZE", 0),
        (Mode.MISSION, "AUTO", 3),
        (Mode.GUIDED, "GUIDED", 4),
        (Mode.HOLD, "LOITER", 5),
        (Mode.RETURN, "RTL", 6),
        (Mode.LAND, "LAND", 9),
    ),
    start_mode=Mode.MANUAL,
    version=4 << 24 | 6 << 16 | 2 << 8 | 255,
    retry_s=1.0,
    give_up_s=8.0,
    streams_unasked=False,
    disarm_s=0.5,
    parameters=(
        ("SYSID_THISMAV", 1, mavlink.MAV_PARAM_TYPE_INT16),
        ("ARMING_CHECK", 1, _INT32),
        ("AUTO_OPTIONS", 0, _INT32),
        ("BATT_CAPACITY", 10000, _INT32),
        ("DISARM_DELAY", 10, _INT8),
        ("FENCE_ACTION", 1, _INT8),
        ("FENCE_ALT_MAX", 100, _REAL32),
        ("FENCE_ENABLE", 0, _INT8),
        ("FENCE_MARGIN", 2, _REAL32),
        ("FENCE_RADIUS", 300, _REAL32),
        ("FENCE_TOTAL", 0, _INT8),
        ("FENCE_TYPE", 7, _INT8),
        ("FS_GCS_ENABLE", 0, _INT8),
        ("FS_GCS_TIMEOUT", 5, _REAL32),
        ("MIS_OPTIONS", 0, mavlink.MAV_PARAM_TYPE_INT16),
        ("MIS_RESTART", 0, _INT8),
        ("MIS_TOTAL", 0, mavlink.MAV_PARAM_TYPE_INT16),
        ("RALLY_TOTAL", 0, _INT8),
        ("RTL_ALT", 1500, _INT32),
        ("WPNAV_ACCEL", 250, _REAL32),
        ("WPNAV_RADIUS", 200, _REAL32),
        ("WPNAV_SPEED", 1000, _REAL32),
        ("WPNAV_SPEED_DN", 150, _REAL32),
        ("WPNAV_SPEED_UP", 250, _REAL32),
    ),
)

PX4 = Flavour(
    name="px4",
    title="PX4 (practice)",
    autopilot=mavlink.MAV_AUTOPILOT_PX4,
    modes=(
        (Mode.MANUAL, "Manual", _px4(1)),
        (Mode.GUIDED, "Position", _px4(3)),
        (Mode.TAKEOFF, "Takeoff", _px4(4, 2)),
        (Mode.HOLD, "Hold", _px4(4, 3)),
        (Mode.MISSION, "Mission", _px4(4, 4)),
        (Mode.RETURN, "Return", _px4(4, 5)),
        (Mode.LAND, "Land", _px4(4, 6)),
    ),
    start_mode=Mode.HOLD,
    version=1 << 24 | 15 << 16 | 4 << 8 | 255,
    retry_s=0.25,
    give_up_s=5.0,
    streams_unasked=True,
    disarm_s=2.0,
    parameters=(
        ("MAV_SYS_ID", 1, _INT32),
        ("COM_DISARM_LAND", 2, _REAL32),
        ("COM_DISARM_PRFLT", 10, _REAL32),
        ("COM_DL_LOSS_T", 10, _INT32),
        ("GF_ACTION", 2, _INT32),
        ("GF_MAX_HOR_DIST", 0, _REAL32),
        ("GF_MAX_VER_DIST", 0, _REAL32),
        ("MIS_DIST_1WP", 10000, _REAL32),
        ("MIS_TAKEOFF_ALT", 2.5, _REAL32),
        ("MIS_TKO_LAND_REQ", 0, _INT32),
        ("MPC_ACC_HOR", 3, _REAL32),
        ("MPC_XY_CRUISE", 5, _REAL32),
        ("NAV_ACC_RAD", 2, _REAL32),
        ("NAV_DLL_ACT", 0, _INT32),
        ("RTL_RETURN_ALT", 30, _REAL32),
    ),
)

# ArduPlane's and Rover's own numbers (mode.h of each); a quadplane has ArduPlane's.
_PLANE_MODES = (
    (Mode.MANUAL, "MANUAL", 0),
    (Mode.MISSION, "AUTO", 10),
    (Mode.RETURN, "RTL", 11),
    (Mode.HOLD, "LOITER", 12),
    (Mode.GUIDED, "GUIDED", 15),
    (Mode.LAND, "QLAND", 20),
)
_ROVER_MODES = (
    (Mode.MANUAL, "MANUAL", 0),
    (Mode.HOLD, "HOLD", 4),
    (Mode.MISSION, "AUTO", 10),
    (Mode.RETURN, "RTL", 11),
    (Mode.LAND, "HOLD", 4),  # what it does instead
    (Mode.GUIDED, "GUIDED", 15),
)
_ARDUPILOTS = {
    "plane": ("ArduPlane (practice)", _PLANE_MODES),
    "vtol": ("ArduPlane (practice)", _PLANE_MODES),
    "rover": ("ArduRover (practice)", _ROVER_MODES),
    "boat": ("ArduRover (practice)", _ROVER_MODES),
}

FLAVOURS = {flavour.name: flavour for flavour in (ARDUPILOT, PX4)}


def flavour_named(name: str) -> Flavour:
    """Return a flavour by name.

    Raises
    ------
    VehicleError
        When there is none of that name.

    Examples
    --------
    >>> flavour_named("px4").retry_s
    0.25
    """
    try:
        return FLAVOURS[name]
    except KeyError:
        raise VehicleError(f"unknown autopilot '{name}'; known are {', '.join(FLAVOURS)}") from None
