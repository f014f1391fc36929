"""The messages that the practice autopilot sends by itself, at the rates that each link asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.exchange import Message, Outgoing
from sparsor.link.practice.messages import BUILDERS, OTHERS

if TYPE_CHECKING:
    from sparsor.link.practice.flight import Flight

# MAVLink's MAV_DATA_STREAM groups as ArduCopter fills them, of the messages that we have.
GROUPS: dict[int, tuple[int, ...]] = {
    mavlink.MAV_DATA_STREAM_EXTENDED_STATUS: (1, 24, 42, 162),
    mavlink.MAV_DATA_STREAM_POSITION: (33,),
    mavlink.MAV_DATA_STREAM_EXTRA1: (30,),
    mavlink.MAV_DATA_STREAM_EXTRA2: (74,),
    mavlink.MAV_DATA_STREAM_EXTRA3: (2, 147, 168),
}
GROUPS[mavlink.MAV_DATA_STREAM_ALL] = tuple(number for group in GROUPS.values() for number in group)
# Hertz of what PX4 sends unasked.
UNASKED_HZ = {1: 1.0, 2: 1.0, 24: 1.0, 30: 10.0, 33: 5.0, 42: 1.0, 74: 4.0, 147: 0.5, 231: 0.5, 242: 0.5, 245: 1.0}
FASTEST_HZ = 20.0


@dataclass
class _Stream:
    interval_s: float
    due_s: float


class Telemetry:
    """Who gets which message how often, in simulated time.

    Parameters
    ----------
    flight : Flight
    boot_unix_s : float
        What the clock said at power-up.
    """

    def __init__(self, flight: Flight, boot_unix_s: float) -> None:
        self._flight = flight
        self._boot_unix_s = boot_unix_s
        self._links: dict[int, dict[int, _Stream]] = {}

    def join(self, link: int) -> None:
        """Begin to send to a link."""
        rates = UNASKED_HZ if self._flight.flavour.streams_unasked else {}
        now = self._flight.time_s
        self._links[link] = {number: _Stream(1.0 / rate, now) for number, rate in rates.items()}

    def leave(self, link: int) -> None:
        """Forget a link."""
        self._links.pop(link, None)

    def request_group(self, link: int, group: int, rate_hz: float) -> None:
        """REQUEST_DATA_STREAM: messages of a group at a rate; 0 stops them."""
        for number in GROUPS.get(group, ()):
            self.set_interval(link, number, 1.0 / rate_hz if rate_hz > 0 else -1.0)

    def set_interval(self, link: int, number: int, interval_s: float) -> bool:
        """MAV_CMD_SET_MESSAGE_INTERVAL: below 0 stops, 0 is the usual rate; False for unknown messages."""
        if not self._has(number) or link not in self._links:
            return False
        streams = self._links[link]
        if interval_s < 0:
            streams.pop(number, None)
            return True
        if interval_s == 0:
            interval_s = 1.0 / UNASKED_HZ.get(number, 1.0)
        streams[number] = _Stream(max(interval_s, 1.0 / FASTEST_HZ), self._flight.time_s)
        return True

    def interval_s(self, link: int, number: int) -> float:
        """Return the interval of a message on a link, -1 for one that is not sent."""
        running = self._links.get(link, {}).get(number)
        return running.interval_s if running else -1.0

    def build(self, number: int) -> Message:
        """Return a message as it is now, None for one that we do not have, or not now."""
        return BUILDERS[number](self._flight, self._boot_unix_s) if self._has(number) else None

    def _has(self, number: int) -> bool:
        return number in BUILDERS and number not in OTHERS[self._flight.flavour.name]

    def due(self) -> list[Outgoing]:
        """Return what is to be sent at this moment of the flight."""
        now, out = self._flight.time_s, []
        built: dict[int, Message] = {}
        for link, streams in self._links.items():
            for number, running in streams.items():
                if now + 1e-9 < running.due_s:
                    continue
                running.due_s = max(running.due_s + running.interval_s, now - running.interval_s)
                if number not in built:
                    built[number] = self.build(number)
                if built[number] is not None:
                    out.append(Outgoing(built[number], link))
        return out
