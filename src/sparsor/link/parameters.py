"""Reading and setting parameters of a vehicle (https://mavlink.io/en/services/parameter.html)."""

from __future__ import annotations

import math
import struct
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkFailureError

if TYPE_CHECKING:
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Message
    from sparsor.link.vehicles import FoundVehicle

ANSWER_S: Final = 0.7
READ_TRIES: Final = 6
SET_TRIES: Final = 15
REAL32: Final = 9  # MAV_PARAM_TYPE_REAL32


@dataclass(frozen=True)
class Parameter:
    """A parameter as the vehicle tells it.

    Parameters
    ----------
    name : str
    value : float
    kind : int
        MAV_PARAM_TYPE.
    """

    name: str
    value: float
    kind: int


def read_parameter(connection: Connection, vehicle: FoundVehicle, name: str) -> Parameter | None:
    """Return a parameter; None when the vehicle does not answer (it may not have it).

    Raises
    ------
    LinkFailureError
        When the link is gone.
    """
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    asked = mavlink.MAVLink_param_request_read_message(vehicle.system_id, vehicle.component_id, name.encode(), -1)
    with connection.inbox("PARAM_VALUE", system_id=vehicle.system_id) as inbox:
        for _ in range(READ_TRIES):
            connection.send(asked)
            for answer in inbox.until(time.monotonic() + ANSWER_S):
                if answer.message.param_id == name:
                    return _told(answer.message, vehicle)
    return None


def set_parameter(connection: Connection, vehicle: FoundVehicle, wanted: Parameter) -> None:
    """Set a parameter: sent until the vehicle tells that it has this value.

    Raises
    ------
    LinkFailureError
        When it does not take it, or the link is gone.
    """
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    sent = mavlink.MAVLink_param_set_message(
        vehicle.system_id, vehicle.component_id, wanted.name.encode(), _encoded(wanted, vehicle), wanted.kind
    )
    told: Parameter | None = None
    with connection.inbox("PARAM_VALUE", system_id=vehicle.system_id) as inbox:
        for _ in range(SET_TRIES):
            connection.send(sent)
            for answer in inbox.until(time.monotonic() + ANSWER_S):
                if answer.message.param_id != wanted.name:
                    continue
                told = _told(answer.message, vehicle)
                if math.isclose(told.value, wanted.value, rel_tol=1e-6):
                    return
    answered = "does not answer" if told is None else f"keeps {told.value:g}"
    raise LinkFailureError(f"setting {wanted.name} to {wanted.value:g} failed: the vehicle {answered}")


def _bytewise(kind: int, vehicle: FoundVehicle) -> bool:
    """Whether the bits of a whole number take the float's place (PX4), not its value (ArduPilot)."""
    return vehicle.autopilot is not None and vehicle.autopilot.name == "px4" and kind != REAL32


def _told(message: Message, vehicle: FoundVehicle) -> Parameter:
    value, kind = float(message.param_value), int(message.param_type)
    if _bytewise(kind, vehicle):
        value = float(struct.unpack("<i", struct.pack("<f", value))[0])
    return Parameter(str(message.param_id), value, kind)


def _encoded(parameter: Parameter, vehicle: FoundVehicle) -> float:
    if _bytewise(parameter.kind, vehicle):
        return float(struct.unpack("<f", struct.pack("<i", round(parameter.value)))[0])
    return parameter.value
