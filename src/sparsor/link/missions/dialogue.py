"""Messages to one vehicle and its answers over a link that loses: numbered, in copies, sent again in time."""

from __future__ import annotations

import math
import time
from collections import deque
from typing import TYPE_CHECKING, Any, Final, Self

from sparsor.link.connection import lost

if TYPE_CHECKING:
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Message, Received
    from sparsor.link.roundtrip import RoundTrip
    from sparsor.link.vehicles import FoundVehicle

# mavsdk's system id: ArduPilot denies an upload for 8 s to any but the one who began one and gave up.
MAVSDK_SYSTEM: Final = 245
PACE_S: Final = 0.02  # between two messages: a mission item of 51 bytes then fits a telemetry radio of 57600 baud
SILENT_S: Final = 10.0  # a vehicle that says nothing for so long is gone
PATIENCE_S: Final = 40.0  # how long a transfer may get no further
BEGIN: Final = -1  # number of the message that begins a transfer; items count from 0
UNSURE: Final = 4  # timeouts in a row after which the vehicle may have broken off a transfer, or be done with it


class Dialogue:
    """What is said to a vehicle, and what it answers.

    Parameters
    ----------
    connection : Connection
    vehicle : FoundVehicle
    trip : RoundTrip
        Learns from each answer.
    *kinds : str
        Names of the messages to hear.

    Attributes
    ----------
    mavlink : module
        pymavlink's messages.
    target : tuple of int
        System and component to address.
    """

    def __init__(self, connection: Connection, vehicle: FoundVehicle, trip: RoundTrip, *kinds: str) -> None:
        from pymavlink.dialects.v20 import ardupilotmega

        self.mavlink: Any = ardupilotmega
        self.target = (vehicle.system_id, vehicle.component_id)
        self._connection, self._vehicle, self._trip = connection, vehicle, trip
        self._queue: deque[tuple[int, Message]] = deque()
        self._sent_s: dict[int, float | None] = {}  # when a number was first sent; None once it was sent again
        self._next_s = 0.0
        self._timer_s: float | None = None  # when the wait for an answer began, as in RFC 6298
        self._inbox = connection.inbox(*kinds, system_id=vehicle.system_id)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._inbox.__exit__()

    def say(self, number: int, *messages: Message) -> None:
        """Queue messages, each in as many copies as the link needs."""
        self._queue.extend((number, message) for message in messages for _ in range(self._trip.copies))

    def say_once(self, message: Message) -> None:
        """Send a message that nothing depends on."""
        self._connection.send(message, as_system=MAVSDK_SYSTEM)

    def answered(self, number: int) -> None:
        """Take a number as answered: it needs no more copies, and its round trip is known."""
        self._queue = deque(entry for entry in self._queue if entry[0] != number)
        if number in self._sent_s:
            sent_s = self._sent_s.pop(number)
            self._timer_s = time.monotonic()
            self._trip.answered(None if sent_s is None else time.monotonic() - sent_s)

    def drop_below(self, number: int) -> None:
        """Send nothing more of smaller numbers."""
        self._queue = deque(entry for entry in self._queue if entry[0] >= number)

    def forget(self) -> None:
        """Begin anew: nothing is queued and nothing was sent."""
        self._queue.clear()
        self._sent_s.clear()
        self._timer_s = None

    def hear(self) -> Received | None:
        """Return the next answer; None when there was no news for the resend time: then nothing is queued any more.

        Raises
        ------
        LinkFailureError
            When the vehicle is gone.
        """
        while True:
            expires_s = math.inf if self._timer_s is None else self._timer_s + self._trip.resend_s
            sends_s = self._next_s if self._queue else math.inf
            received = next(self._inbox.until(min(expires_s, sends_s)), None)
            if received is not None:
                if getattr(received.message, "target_system", 0) in (0, MAVSDK_SYSTEM):
                    return received
            elif sends_s < expires_s:
                self._send_next()
            else:
                self._expire()
                return None

    def _send_next(self) -> None:
        number, message = self._queue.popleft()
        self.say_once(message)
        now_s = time.monotonic()
        self._next_s = now_s + PACE_S
        self._timer_s = self._timer_s or now_s
        self._sent_s.setdefault(number, now_s)

    def _expire(self) -> None:
        gone = lost(self._connection, self._vehicle.system_id, SILENT_S)
        if gone is not None:
            raise gone
        self._trip.expired()
        self._timer_s = None
        self._queue.clear()
        self._sent_s = dict.fromkeys(self._sent_s)
