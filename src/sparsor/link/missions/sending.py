"""One upload over a link that loses, delays and repeats.

https://mavlink.io/en/services/mission.html, from the ground station's side. Both autopilots take an item only when its
number is the one they want, and go on waiting otherwise: ArduPilot acks it with MAV_MISSION_INVALID_SEQUENCE
(MissionItemProtocol.cpp), PX4 says nothing (mavlink_mission.cpp). So several items can be on their way at once, as in
go-back-N: the number that the vehicle asks for says what it has.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkFailureError
from sparsor.link.missions.dialogue import BEGIN, PATIENCE_S, UNSURE
from sparsor.link.missions.wire import KINDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.core.progress import Progress
    from sparsor.link.inbox import Message
    from sparsor.link.missions.dialogue import Dialogue
    from sparsor.link.missions.wire import WireItem

AT_ONCE: Final = 8  # items on their way at the same time
# MAV_MISSION_RESULT.
ACCEPTED, ERROR, NO_SPACE, INVALID_SEQUENCE, CANCELLED = 0, 1, 4, 13, 15
NOT_RECEIVING: Final = frozenset({ERROR, CANCELLED})  # what is said to an item when no transfer runs (any more)


class Sending:
    """An upload under way.

    Parameters
    ----------
    dialogue : Dialogue
        Hears MISSION_REQUEST_INT, MISSION_REQUEST and MISSION_ACK.
    kind : int
        MAV_MISSION_TYPE.
    items : sequence of WireItem
    progress : Progress
    """

    def __init__(self, dialogue: Dialogue, kind: int, items: Sequence[WireItem], progress: Progress) -> None:
        self._dialogue, self._kind, self._items, self._progress = dialogue, kind, items, progress
        self._wanted, self._queued, self._furthest = BEGIN, 0, BEGIN
        self._broken_off, self._timeouts = False, 0
        self._news_s = time.monotonic()

    def run(self) -> bool:
        """Send everything.

        Returns
        -------
        bool
            True when the vehicle accepted; False when its last word was lost, so that only what it holds can tell.

        Raises
        ------
        LinkFailureError
            When it refuses, or is gone, or does not get any further.
        """
        self._begin()
        while time.monotonic() - self._news_s < PATIENCE_S:
            received = self._dialogue.hear()
            if received is None:
                if self._unsure():
                    return False
                self._send_again()
            elif received.message.mission_type != self._kind:
                continue
            elif received.kind != "MISSION_ACK":
                self._asked(received.message.seq)
            elif self._accepted(received.message.type):
                return True
        raise LinkFailureError(
            f"sending {KINDS[self._kind]} failed: the vehicle stopped asking at item {max(self._wanted, 0)}"
        )

    @property
    def _everything(self) -> bool:
        return self._queued == len(self._items)

    def _begin(self) -> None:
        """Send the number of items; PX4 takes it only after what it was at before was called off."""
        mavlink, target = self._dialogue.mavlink, self._dialogue.target
        self._wanted, self._queued, self._broken_off = BEGIN, 0, False
        self._dialogue.forget()
        self._dialogue.say(
            BEGIN,
            mavlink.MAVLink_mission_ack_message(*target, CANCELLED, self._kind),
            mavlink.MAVLink_mission_count_message(*target, len(self._items), self._kind),
        )

    def _asked(self, number: int) -> None:
        """Take the vehicle's word for how far it is: forwards mostly, backwards when it began anew."""
        if self._wanted == BEGIN and number != 0:
            return  # said in a transfer that ran before
        if number >= len(self._items):
            self._broken_off = True  # it counts another transfer's items
            return
        self._dialogue.answered(number - 1)  # BEGIN for item 0
        self._dialogue.drop_below(number)
        self._wanted, self._broken_off, self._timeouts = number, False, 0
        if number > self._furthest:
            self._furthest, self._news_s = number, time.monotonic()
            self._progress(f"send {KINDS[self._kind]}", number, len(self._items))
        self._fill(max(self._queued, number))

    def _fill(self, start: int) -> None:
        stop = max(start, min(self._wanted + AT_ONCE, len(self._items)))
        for number in range(start, stop):
            self._dialogue.say(number, self._message(number))
        self._queued = stop

    def _unsure(self) -> bool:
        """Return whether, all items sent, the vehicle seems to be done: it takes none, or asks for none any more."""
        self._timeouts += 1
        return self._everything and (self._broken_off or self._timeouts >= UNSURE)

    def _send_again(self) -> None:
        if self._wanted == BEGIN or self._broken_off:
            self._begin()
        else:
            self._fill(self._wanted)

    def _accepted(self, result: int) -> bool:
        """Return whether an ack ends the upload; raise when it refuses it."""
        if result == ACCEPTED:
            return self._everything
        if result in NOT_RECEIVING:
            self._broken_off = True  # unless a request follows: then it was the echo of an older message
            return False
        if result == INVALID_SEQUENCE:  # the echo of a copy
            return False
        why = "it has no room for so many" if result == NO_SPACE else f"refused with MAV_MISSION_RESULT {result}"
        raise LinkFailureError(f"sending {KINDS[self._kind]} failed: {why}")

    def _message(self, number: int) -> Message:
        item = self._items[number]
        return self._dialogue.mavlink.MAVLink_mission_item_int_message(
            *self._dialogue.target, number, item.frame, item.command, int(number == 0), int(item.autocontinue),
            *item.params, item.x, item.y, item.z, self._kind,
        )  # fmt: skip
