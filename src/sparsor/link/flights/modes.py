"""In which mode a vehicle arms, and in which it flies a mission."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkError
from sparsor.link.missions.checks import COPTERS, PLANES, ROVERS, VTOLS

if TYPE_CHECKING:
    from sparsor.link.inbox import Message
    from sparsor.link.vehicles import FoundVehicle

ARDUPILOT: Final = 3  # MAV_AUTOPILOT
FIXED_WING: Final = 1  # MAV_TYPE
# ArduPilot's mode to arm in. A copter in AUTO is "not armable" (ModeAuto::allows_arming, AUTO_OPTIONS aside), in GUIDED
# a ground station may arm it (ModeGuided::allows_arming). Planes and rovers arm in any of these (Mode::allows_arming);
# a plane takes off as soon as it is armed in AUTO, a rover that is armed in HOLD stands still.
ARMING: Final = {COPTERS: "GUIDED", PLANES: "AUTO", VTOLS: "AUTO", ROVERS: "HOLD"}


@dataclass(frozen=True)
class FlightModes:
    """The modes of a flight.

    Parameters
    ----------
    mission : str
        What a vehicle that flies its mission calls its mode (`mode_title`).
    arming : int or None
        The custom_mode to arm in; None where MAV_CMD_MISSION_START arms as well (PX4).
    """

    mission: str
    arming: int | None


def flight_modes(vehicle: FoundVehicle) -> FlightModes:
    """Return the modes of a flight, as pymavlink numbers and names them.

    Raises
    ------
    LinkError
        When it is a kind of vehicle that we cannot start.
    """
    from pymavlink import mavutil

    if vehicle.autopilot is not None and vehicle.autopilot.name == "px4":
        return FlightModes("MISSION", None)
    kind = FIXED_WING if vehicle.vehicle_type in VTOLS else vehicle.vehicle_type
    numbers = mavutil.mode_mapping_byname(kind)
    arming = next((mode for kinds, mode in ARMING.items() if vehicle.vehicle_type in kinds), None)
    if vehicle.autopilot is None or numbers is None or arming not in numbers:
        raise LinkError(
            f"{vehicle.words}: only copters, planes, VTOLs, rovers and boats can be armed and started from here; "
            "start this one yourself"
        )
    return FlightModes("AUTO", int(numbers[arming]))


def mode_title(heartbeat: Message) -> str:
    """Return what the autopilot calls the mode of a HEARTBEAT."""
    from pymavlink import mavutil

    if heartbeat.type in VTOLS and heartbeat.autopilot == ARDUPILOT:
        # A VTOL has ArduPlane's modes; pymavlink knows that of some of their MAV_TYPEs only.
        names = mavutil.mode_mapping_bynumber(FIXED_WING)
        return str(names.get(heartbeat.custom_mode, f"Mode({heartbeat.custom_mode})"))
    return str(mavutil.mode_string_v10(heartbeat))
