"""Counting what sensors send while a link is recorded."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sparsor.link.inbox import Received

NAMED_VALUES: Final = frozenset({"NAMED_VALUE_FLOAT", "NAMED_VALUE_INT"})
CLOCKS: Final = frozenset({"GLOBAL_POSITION_INT", "ATTITUDE", "SYSTEM_TIME"})
RECENT: Final = 20


@dataclass(frozen=True)
class LastSample:
    """The sample that came last.

    Parameters
    ----------
    name : str
    value : float
    vehicle_s : float or None
        What the vehicle's clock said when it came, seconds since its start.
    """

    name: str
    value: float
    vehicle_s: float | None


class SampleCounter:
    """Listens on a connection (`Connection.listen`); counts the named values that come, whoever sends them.

    Attributes
    ----------
    counts : dict of str to int
        By the value's name.
    last : LastSample or None
    vehicle_s : float or None
        The vehicle's clock: seconds since its start, by its own messages.
    system_id : int or None
        Whose clock it is; set when the vehicle is found.
    """

    def __init__(self) -> None:
        self.counts: dict[str, int] = {}
        self.last: LastSample | None = None
        self.vehicle_s: float | None = None
        self.system_id: int | None = None
        self._times: deque[float] = deque(maxlen=RECENT)

    def __call__(self, received: Received) -> None:
        """Take one message."""
        kind, message = received.kind, received.message
        if kind in NAMED_VALUES:
            name = str(message.name)
            self.counts[name] = self.counts.get(name, 0) + 1
            self.last = LastSample(name, float(message.value), self.vehicle_s)
            if self.vehicle_s is not None:
                self._times.append(self.vehicle_s)
        elif kind in CLOCKS and received.frame.system_id == self.system_id:
            self.vehicle_s = message.time_boot_ms / 1000

    @property
    def total(self) -> int:
        """How many came."""
        return sum(self.counts.values())

    @property
    def age_s(self) -> float | None:
        """Seconds of the vehicle's time since the last one came; None while there is none."""
        if self.last is None or self.last.vehicle_s is None or self.vehicle_s is None:
            return None
        return self.vehicle_s - self.last.vehicle_s

    @property
    def rate_hz(self) -> float | None:
        """How many come in a second of the vehicle's time, of the last ones."""
        times = tuple(self._times)
        if len(times) < 2 or times[-1] <= times[0]:
            return None
        return (len(times) - 1) / (times[-1] - times[0])
