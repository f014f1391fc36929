"""The mission protocol over links that lose, delay and repeat: patient where mavsdk gives up.

https://mavlink.io/en/services/mission.html, from the ground station's side. A vehicle acks an item that it did not
ask for with MAV_MISSION_INVALID_SEQUENCE; on such links that is the echo of a resent item and no reason to end.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any, Final

from sparsor.core.progress import silent
from sparsor.errors import LinkFailureError
from sparsor.link.connection import lost
from sparsor.link.wire import KINDS, WireItem

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.core.progress import Progress
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Message
    from sparsor.link.vehicles import FoundVehicle

# mavsdk's system id: ArduPilot denies an upload for 8 s to any but the one who began one and gave up.
MAVSDK_SYSTEM: Final = 245
RESEND_S: Final = 1.5  # longer than a round trip at 500 ms of delay each way
PATIENCE: Final = 40  # resends in a row without any news
RESTART: Final = 6  # resends after which the transfer is begun anew: the vehicle may have dropped it
SILENT_S: Final = 6.0
AT_ONCE: Final = 8  # requests on their way at the same time; PX4 takes them only one by one
# MAV_MISSION_RESULT.
ACCEPTED, ERROR, NO_SPACE, INVALID_SEQUENCE, CANCELLED = 0, 1, 4, 13, 15
NOT_RECEIVING: Final = frozenset({ERROR, CANCELLED})  # what ArduPilot says to an item when no transfer runs (any more)


class Resender:
    """Transfers with one vehicle through the connection itself.

    Parameters
    ----------
    connection : Connection
    vehicle : FoundVehicle
    resend_s : float
        How long to wait for an answer before sending again.
    """

    def __init__(self, connection: Connection, vehicle: FoundVehicle, resend_s: float = RESEND_S) -> None:
        from pymavlink.dialects.v20 import ardupilotmega

        self._connection, self._vehicle, self._mavlink = connection, vehicle, ardupilotmega
        self._resend_s = resend_s
        self._target = (vehicle.system_id, vehicle.component_id)

    def upload(self, kind: int, items: Sequence[WireItem], progress: Progress = silent) -> None:
        """Send all items of a MAV_MISSION_TYPE.

        The last answer may be lost: that the vehicle then answers "out of sequence" only suggests that it has
        everything, so read it back.

        Raises
        ------
        LinkFailureError
            When the vehicle refuses, or is gone.
        """
        begin = self._mavlink.MAVLink_mission_count_message(*self._target, len(items), kind)
        answer: Any = begin
        last, resent = -1, 0
        kinds = ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK")
        with self._connection.inbox(*kinds, system_id=self._vehicle.system_id) as inbox:
            self._send(answer)
            while resent < PATIENCE:
                received = next(inbox.until(time.monotonic() + self._resend_s), None)
                if received is None:
                    self._check_alive()
                    resent += 1
                    answer = begin if resent % RESTART == 0 else answer
                    self._send(answer)
                    continue
                message = received.message
                if message.mission_type != kind or message.target_system not in (0, MAVSDK_SYSTEM):
                    continue
                if received.kind == "MISSION_ACK":
                    if self._ended(message.type, kind, last == len(items) - 1, resent):
                        return
                    if message.type in NOT_RECEIVING and last < len(items) - 1:
                        answer, last = begin, -1
                elif message.seq < len(items) and message.seq != last:
                    last, resent = message.seq, 0
                    answer = self._item(kind, last, items[last])
                    self._send(answer)
                    progress(f"send {KINDS[kind]}", last, len(items))
        raise LinkFailureError(f"sending {KINDS[kind]} failed: the vehicle stopped asking at item {last + 1}")

    def download(self, kind: int) -> tuple[WireItem, ...]:
        """Return what the vehicle holds of a MAV_MISSION_TYPE.

        Raises
        ------
        LinkFailureError
            When it does not answer.
        """
        count, got = -1, dict[int, WireItem]()
        window = 1 if self._vehicle.autopilot is not None and self._vehicle.autopilot.name == "px4" else AT_ONCE
        kinds, resent, due_s = ("MISSION_COUNT", "MISSION_ITEM_INT"), 0, 0.0
        with self._connection.inbox(*kinds, system_id=self._vehicle.system_id) as inbox:
            while count != len(got):
                wanted = [number for number in range(max(count, 0)) if number not in got][:window]
                if time.monotonic() >= due_s:
                    self._check_alive()
                    self._request(kind, wanted)
                    resent, due_s = resent + 1, time.monotonic() + self._resend_s
                if resent > PATIENCE:
                    raise LinkFailureError(f"reading its {KINDS[kind]} failed: the vehicle does not answer")
                received = next(inbox.until(due_s), None)
                if received is None or received.message.mission_type != kind:
                    continue
                if received.kind == "MISSION_COUNT":
                    count, due_s = int(received.message.count) if count < 0 else count, 0.0
                elif received.message.seq not in got:
                    got[received.message.seq], resent = _wire_item(received.message), 0
                    due_s = due_s if len(wanted) > 1 else 0.0
        self._send(self._mavlink.MAVLink_mission_ack_message(*self._target, ACCEPTED, kind))
        return tuple(got[number] for number in range(count))

    def _send(self, message: Message) -> None:
        self._connection.send(message, as_system=MAVSDK_SYSTEM)

    def _request(self, kind: int, wanted: Sequence[int]) -> None:
        if not wanted:
            self._send(self._mavlink.MAVLink_mission_request_list_message(*self._target, kind))
        for number in wanted:
            self._send(self._mavlink.MAVLink_mission_request_int_message(*self._target, number, kind))

    def _ended(self, result: int, kind: int, all_asked: bool, resent: int) -> bool:
        """Return whether an ack ends an upload; raise when it refuses it."""
        if result == ACCEPTED:
            return all_asked
        if result == INVALID_SEQUENCE or result in NOT_RECEIVING:
            return all_asked and resent > 0
        why = "it has no room for so many" if result == NO_SPACE else f"refused with MAV_MISSION_RESULT {result}"
        raise LinkFailureError(f"sending {KINDS[kind]} failed: {why}")

    def _item(self, kind: int, number: int, item: WireItem) -> Any:  # noqa: ANN401 # pymavlink has no types
        return self._mavlink.MAVLink_mission_item_int_message(
            *self._target, number, item.frame, item.command, int(number == 0), int(item.autocontinue),
            *item.params, item.x, item.y, item.z, kind,
        )  # fmt: skip

    def _check_alive(self) -> None:
        gone = lost(self._connection, self._vehicle.system_id, SILENT_S)
        if gone is not None:
            raise gone


def _wire_item(message: Any) -> WireItem:  # noqa: ANN401 # pymavlink has no types
    params = tuple(float(getattr(message, f"param{place}")) for place in (1, 2, 3, 4))
    z = 0.0 if math.isnan(message.z) else float(message.z)
    one, two, three, four = params
    return WireItem(
        int(message.command), int(message.frame), (one, two, three, four), int(message.x), int(message.y), z,
        bool(message.autocontinue),
    )  # fmt: skip
