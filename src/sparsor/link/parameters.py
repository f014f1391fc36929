"""Reading the few parameters of a vehicle that the upload asks about (PARAM_REQUEST_READ)."""

from __future__ import annotations

import struct
import time
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Message
    from sparsor.link.vehicles import FoundVehicle

ANSWER_S: Final = 0.7
TRIES: Final = 3
INT32: Final = 6  # MAV_PARAM_TYPE_INT32


def read_parameter(connection: Connection, vehicle: FoundVehicle, name: str) -> float | None:
    """Return a parameter's value; None when the vehicle does not answer (it may not have it).

    Raises
    ------
    LinkFailureError
        When the link is gone.
    """
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    asked = mavlink.MAVLink_param_request_read_message(vehicle.system_id, vehicle.component_id, name.encode(), -1)
    with connection.inbox("PARAM_VALUE", system_id=vehicle.system_id) as inbox:
        for _ in range(TRIES):
            connection.send(asked)
            for answer in inbox.until(time.monotonic() + ANSWER_S):
                if answer.message.param_id == name:
                    return _value(answer.message, vehicle)
    return None


def fence_enforced(connection: Connection, vehicle: FoundVehicle) -> bool | None:
    """Return whether the vehicle will keep to an uploaded fence; None when it does not say.

    ArduPilot: FENCE_ENABLE is set and FENCE_TYPE has the bit of polygons (4). PX4: GF_ACTION is not 0 (none).
    """
    if vehicle.autopilot is not None and vehicle.autopilot.name == "px4":
        action = read_parameter(connection, vehicle, "GF_ACTION")
        return None if action is None else action != 0
    enabled = read_parameter(connection, vehicle, "FENCE_ENABLE")
    if not enabled:
        return None if enabled is None else False
    kinds = read_parameter(connection, vehicle, "FENCE_TYPE")
    return None if kinds is None else bool(int(kinds) & 4)


def fence_ceiling_m(connection: Connection, vehicle: FoundVehicle) -> float | None:
    """Return the height above home at which an enabled altitude fence of ArduPilot begins; None without one.

    FENCE_ENABLE is set, FENCE_TYPE has the bit 1; FENCE_ALT_MAX, metres.
    """
    if vehicle.autopilot is None or vehicle.autopilot.name != "ardupilot":
        return None
    if not read_parameter(connection, vehicle, "FENCE_ENABLE"):
        return None
    kinds = read_parameter(connection, vehicle, "FENCE_TYPE")
    return read_parameter(connection, vehicle, "FENCE_ALT_MAX") if kinds and int(kinds) & 1 else None


def _value(message: Message, vehicle: FoundVehicle) -> float:
    value = float(message.param_value)
    # PX4 sends the bits of a whole number in the float's place, ArduPilot its value.
    if vehicle.autopilot is not None and vehicle.autopilot.name == "px4" and message.param_type == INT32:
        return float(struct.unpack("<i", struct.pack("<f", value))[0])
    return value
