"""Transfers of our own over links that lose, delay and repeat: patient where mavsdk gives up."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from sparsor.core.progress import silent
from sparsor.errors import LinkFailureError
from sparsor.link.missions.dialogue import BEGIN, Dialogue
from sparsor.link.missions.readback import differences
from sparsor.link.missions.reading import Reading
from sparsor.link.missions.sending import ACCEPTED, CANCELLED, NOT_RECEIVING, Sending
from sparsor.link.missions.wire import KINDS, WireItem
from sparsor.link.roundtrip import RoundTrip

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from sparsor.core.progress import Progress
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Message, Received
    from sparsor.link.vehicles import FoundVehicle

ATTEMPTS: Final = 3  # of one upload
ANSWER_S: Final = 15.0  # ArduPilot refuses to clear for 8 s after an upload that was broken off
SET_CURRENT: Final = 224  # MAV_CMD_DO_SET_MISSION_CURRENT
MAV_RESULT_ACCEPTED: Final = 0


class Resender:
    """The mission protocol with one vehicle through the connection itself.

    What it learns of the link in one transfer, it uses in the next.

    Parameters
    ----------
    connection : Connection
    vehicle : FoundVehicle
    """

    def __init__(self, connection: Connection, vehicle: FoundVehicle) -> None:
        self._connection, self._vehicle = connection, vehicle
        self._trip = RoundTrip()

    def upload(self, kind: int, items: Sequence[WireItem], progress: Progress = silent) -> None:
        """Send all items of a MAV_MISSION_TYPE; where the vehicle's last word is lost, read back what it holds.

        Raises
        ------
        LinkFailureError
            When the vehicle refuses, or is gone.
        """
        for _ in range(ATTEMPTS):
            with self._dialogue("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK") as dialogue:
                accepted = Sending(dialogue, kind, items, progress).run()
            if accepted or self._holds(kind, items):
                return
        raise LinkFailureError(f"sending {KINDS[kind]} failed: the vehicle broke it off {ATTEMPTS} times")

    def download(self, kind: int) -> tuple[WireItem, ...]:
        """Return what the vehicle holds of a MAV_MISSION_TYPE.

        Raises
        ------
        LinkFailureError
            When it does not answer.
        """
        facts = self._vehicle.autopilot
        with self._dialogue("MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ACK") as dialogue:
            return Reading(dialogue, kind, in_order=facts is None or facts.name == "px4").run()

    def clear(self, kind: int) -> None:
        """Empty a MAV_MISSION_TYPE.

        Raises
        ------
        LinkFailureError
            When the vehicle does not accept it.
        """

        def judge(answer: Received) -> bool:
            result = answer.message.type
            if answer.message.mission_type != kind or result in NOT_RECEIVING:  # busy with an older transfer
                return False
            if result == ACCEPTED:
                return True
            raise LinkFailureError(f"the vehicle does not clear its {KINDS[kind]} (result {result})")

        with self._dialogue("MISSION_ACK") as dialogue:
            cancel = dialogue.mavlink.MAVLink_mission_ack_message(*dialogue.target, CANCELLED, kind)
            order = dialogue.mavlink.MAVLink_mission_clear_all_message(*dialogue.target, kind)
            if not _answered(dialogue, (cancel, order), judge):
                raise LinkFailureError(f"the vehicle does not clear its {KINDS[kind]} when asked to")

    def set_current(self, item: int) -> None:
        """Make an item the next to be flown.

        Asked by command and by message: ArduPilot acks the command, older PX4 knows only the message, which both answer
        with MISSION_CURRENT.

        Raises
        ------
        LinkFailureError
            When the vehicle does not accept it.
        """

        def judge(answer: Received) -> bool:
            message = answer.message
            if answer.kind == "MISSION_CURRENT":
                return bool(message.seq == item)
            return bool(message.command == SET_CURRENT and message.result == MAV_RESULT_ACCEPTED)

        with self._dialogue("MISSION_CURRENT", "COMMAND_ACK") as dialogue:
            command = dialogue.mavlink.MAVLink_command_long_message(
                *dialogue.target, SET_CURRENT, 0, item, 0, 0, 0, 0, 0, 0
            )
            order = dialogue.mavlink.MAVLink_mission_set_current_message(*dialogue.target, item)
            if not _answered(dialogue, (command, order), judge):
                raise LinkFailureError(f"the vehicle does not set the current item to {item} when asked to")

    def _dialogue(self, *kinds: str) -> Dialogue:
        return Dialogue(self._connection, self._vehicle, self._trip, *kinds)

    def _holds(self, kind: int, items: Sequence[WireItem]) -> bool:
        """Return whether the vehicle holds these items, but for what is harmless."""
        facts = self._vehicle.autopilot
        home_is_item_0 = facts is not None and facts.home_is_item_0
        found = differences(kind, items, self.download(kind), home_is_item_0=home_is_item_0)
        return all(one.harmless for one in found)


def _answered(dialogue: Dialogue, orders: Sequence[Message], judge: Callable[[Received], bool]) -> bool:
    """Give an order until an answer is good; False when none was."""
    until_s = time.monotonic() + ANSWER_S
    dialogue.say(BEGIN, *orders)
    while time.monotonic() < until_s:
        received = dialogue.hear()
        if received is None:
            dialogue.say(BEGIN, *orders)
        elif judge(received):
            dialogue.answered(BEGIN)
            return True
    return False
