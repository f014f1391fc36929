"""MAV_CMDs to a vehicle, sent until they are answered (https://mavlink.io/en/services/command.html)."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkFailureError
from sparsor.link.connection import OUR_SYSTEM

if TYPE_CHECKING:
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Message
    from sparsor.link.vehicles import FoundVehicle

ANSWER_S: Final = 1.5
TRIES: Final = 10
WORKING_S: Final = 10.0  # after MAV_RESULT_IN_PROGRESS
PARAMETERS: Final = 7
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
