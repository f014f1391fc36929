"""MAV_CMDs to a vehicle, sent until they are answered (https://mavlink.io/en/services/command.html)."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkFailureError
from sparsor.link.connection import OUR_SYSTEM
from sparsor.link.vehicles import vehicle_of

if TYPE_CHECKING:
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Inbox, Message
    from sparsor.link.vehicles import FoundVehicle

ANSWER_S: Final = 1.5
TRIES: Final = 10
WORKING_S: Final = 10.0  # after MAV_RESULT_IN_PROGRESS
BEAT_S: Final = 2.5  # within which a heartbeat has to come
PARAMETERS: Final = 7
ARM_DISARM: Final = 400  # MAV_CMD_COMPONENT_ARM_DISARM
# MAV_RESULT.
ACCEPTED, IN_PROGRESS = 0, 5


def command_long(vehicle: FoundVehicle, command: int, *params: float, confirmation: int = 0) -> Message:
    """Return COMMAND_LONG; parameters that are not given are 0."""
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    values = (*params, *(0.0,) * (PARAMETERS - len(params)))
    return mavlink.MAVLink_command_long_message(vehicle.system_id, vehicle.component_id, command, confirmation, *values)


def order(connection: Connection, vehicle: FoundVehicle, command: int, *params: float, tries: int = TRIES) -> int:
    """Send a MAV_CMD until the vehicle answers; return its MAV_RESULT.

    Raises
    ------
    LinkFailureError
        When it does not answer, or the link is gone.
    """
    with connection.inbox("COMMAND_ACK", system_id=vehicle.system_id) as inbox:
        for confirmation in range(tries):
            connection.send(command_long(vehicle, command, *params, confirmation=confirmation))
            deadline_s = time.monotonic() + ANSWER_S
            while (answer := next(inbox.until(deadline_s), None)) is not None:
                if answer.message.command != command or answer.message.target_system not in (0, OUR_SYSTEM):
                    continue
                if answer.message.result != IN_PROGRESS:
                    return int(answer.message.result)
                deadline_s = time.monotonic() + WORKING_S
    raise LinkFailureError(f"{vehicle.words} does not answer the command {command_title(command)}")


def disarm(connection: Connection, vehicle: FoundVehicle, tries: int = 3) -> bool:
    """Disarm a vehicle; return whether its heartbeat says that it is.

    A vehicle in the air refuses. An acceptance alone proves nothing: it may answer an earlier order to arm.
    """
    try:
        with connection.inbox("HEARTBEAT", system_id=vehicle.system_id) as beats:
            for _ in range(tries):
                if order(connection, vehicle, ARM_DISARM, 0.0) != ACCEPTED:
                    return False
                if _armed_after(time.monotonic(), beats, vehicle) is False:
                    return True
    except LinkFailureError:
        pass
    return False


def _armed_after(moment_s: float, beats: Inbox, vehicle: FoundVehicle) -> bool | None:
    """Return whether a vehicle's first heartbeat after a moment says that it is armed; None when none comes."""
    for beat in beats.until(moment_s + BEAT_S):
        found = vehicle_of(beat)
        if found is not None and found.component_id == vehicle.component_id and beat.time_s >= moment_s:
            return found.armed
    return None


def command_title(command: int) -> str:
    """Return the name of a MAV_CMD.

    Examples
    --------
    >>> command_title(300)
    'MISSION_START'
    """
    return _name("MAV_CMD", command)


def result_words(result: int) -> str:
    """Return a MAV_RESULT in words.

    Examples
    --------
    >>> result_words(1)
    'temporarily rejected'
    """
    return _name("MAV_RESULT", result).replace("_", " ").lower()


def _name(enum: str, number: int) -> str:
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    entry = mavlink.enums[enum].get(number)
    return str(number) if entry is None else str(entry.name).removeprefix(f"{enum}_")
