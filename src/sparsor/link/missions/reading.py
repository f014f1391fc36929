"""One download over a link that loses, delays and repeats.

https://mavlink.io/en/services/mission.html, from the ground station's side. ArduPilot gives any item at any time; PX4
breaks off unless it is asked for the next one, or again for the last.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkFailureError
from sparsor.link.missions.dialogue import BEGIN, PATIENCE_S, UNSURE
from sparsor.link.missions.wire import KINDS, WireItem

if TYPE_CHECKING:
    from sparsor.link.inbox import Message
    from sparsor.link.missions.dialogue import Dialogue

AT_ONCE: Final = 16  # requests on their way at the same time
ACCEPTED, UNSUPPORTED = 0, 3  # MAV_MISSION_RESULT


class Reading:
    """A download under way.

    Parameters
    ----------
    dialogue : Dialogue
        Hears MISSION_COUNT, MISSION_ITEM_INT and MISSION_ACK.
    kind : int
        MAV_MISSION_TYPE.
    in_order : bool
        Whether the vehicle gives its items only one after the other.
    """

    def __init__(self, dialogue: Dialogue, kind: int, *, in_order: bool) -> None:
        self._dialogue, self._kind = dialogue, kind
        self._at_once = 1 if in_order else AT_ONCE
        self._count: int | None = None
        self._got: dict[int, WireItem] = {}
        self._asked: set[int] = set()
        self._broken_off, self._timeouts = False, 0
        self._news_s = time.monotonic()

    def run(self) -> tuple[WireItem, ...]:
        """Read everything.

        Raises
        ------
        LinkFailureError
            When the vehicle refuses, or is gone, or does not get any further.
        """
        self._begin()
        while self._count is None or len(self._got) < self._count:
            if time.monotonic() - self._news_s > PATIENCE_S:
                raise LinkFailureError(f"reading its {KINDS[self._kind]} failed: the vehicle does not answer")
            received = self._dialogue.hear()
            if received is None:
                self._ask_again()
            elif received.message.mission_type == self._kind:
                self._take(received.kind, received.message)
        self._dialogue.say_once(
            self._dialogue.mavlink.MAVLink_mission_ack_message(*self._dialogue.target, ACCEPTED, self._kind)
        )
        return tuple(self._got[number] for number in range(self._count))

    def _begin(self) -> None:
        mavlink, target = self._dialogue.mavlink, self._dialogue.target
        self._count, self._broken_off, self._timeouts = None, False, 0
        self._got.clear()  # PX4 starts from the first item
        self._asked.clear()
        self._dialogue.forget()
        self._dialogue.say(BEGIN, mavlink.MAVLink_mission_request_list_message(*target, self._kind))

    def _take(self, name: str, message: Message) -> None:
        if name == "MISSION_ACK":
            if message.type == UNSUPPORTED:
                raise LinkFailureError(f"the vehicle keeps no {KINDS[self._kind]}")
            self._broken_off = self._broken_off or message.type != ACCEPTED
            return
        if name == "MISSION_COUNT":
            if self._count is not None:
                return
            self._count = int(message.count)
            self._dialogue.answered(BEGIN)
        elif self._count is None or message.seq >= self._count or message.seq in self._got:
            return
        else:
            self._got[message.seq] = _wire_item(message)
            self._asked.discard(message.seq)
            self._dialogue.answered(message.seq)
        self._news_s, self._broken_off, self._timeouts = time.monotonic(), False, 0
        self._ask()

    def _ask(self) -> None:
        """Keep as many requests on their way as the vehicle stands."""
        mavlink, target = self._dialogue.mavlink, self._dialogue.target
        missing = (one for one in range(self._count or 0) if one not in self._got and one not in self._asked)
        for number in missing:
            if len(self._asked) >= self._at_once:
                return
            self._asked.add(number)
            self._dialogue.say(number, mavlink.MAVLink_mission_request_int_message(*target, number, self._kind))

    def _ask_again(self) -> None:
        self._timeouts += 1
        if self._count is None or self._broken_off or self._timeouts >= UNSURE:
            self._begin()
        else:
            self._asked.clear()
            self._ask()


def _wire_item(message: Message) -> WireItem:
    one, two, three, four = (float(getattr(message, f"param{place}")) for place in (1, 2, 3, 4))
    z = 0.0 if math.isnan(message.z) else float(message.z)
    return WireItem(
        int(message.command), int(message.frame), (one, two, three, four), int(message.x), int(message.y), z,
        bool(message.autocontinue),
    )  # fmt: skip
