"""What one file holds, before boots are told apart: every kind of file is read into this."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sparsor.flightlog.log import AUTOPILOT, Damage

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.flightlog.log import NamedValues, Places, Sender


@dataclass(frozen=True, eq=False)
class Ticks:
    """Readings of a vehicle's clock; arrays as in `Clock`."""

    order: NDArray[np.int64]
    received_s: NDArray[np.float64]
    time_s: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Fixes:
    """Positions by one kind of message.

    Parameters
    ----------
    order : array of int64 (n,)
    received_s, time_s : array of float64 (n,)
        `time_s` is NaN where the message does not tell.
    places : Places
    has_fix : array of bool (n,)
    stands_for : array of int32 (n,), optional
        How many messages each row stands for, when not each for itself: those before it that a long log's reader
        left out, too.
    """

    order: NDArray[np.int64]
    received_s: NDArray[np.float64]
    time_s: NDArray[np.float64]
    places: Places
    has_fix: NDArray[np.bool_]
    stands_for: NDArray[np.int32] | None = None

    def take(self, rows: NDArray[np.bool_] | NDArray[np.intp] | slice) -> Fixes:
        """Return some of them."""
        stands_for = None if self.stands_for is None else self.stands_for[rows]
        places = self.places.take(rows)
        return Fixes(self.order[rows], self.received_s[rows], self.time_s[rows], places, self.has_fix[rows], stands_for)


class PackedFixes(Protocol):
    """Positions in fewer bytes than `Fixes` has, which they become row by row."""

    @property
    def order(self) -> NDArray[np.int64]:
        """Places in the log."""

    @property
    def received_s(self) -> NDArray[np.float64]:
        """Unix time on the recorder's clock."""

    def take(self, rows: NDArray[np.intp] | slice) -> Fixes:
        """Return some of them."""


@dataclass(frozen=True, eq=False)
class UnixTimes:
    """What a vehicle says about the time of day: unix time less time since boot, seconds."""

    order: NDArray[np.int64]
    offset_s: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Happening:
    """An event at a place in the log; kinds as in `Event`."""

    order: int
    received_s: float
    system: int
    kind: str
    value: int = 0
    text: str = ""


@dataclass(eq=False)
class Recording:
    """Everything of one file that later stages want.

    Parameters
    ----------
    kind : str
    ticks : dict of int to Ticks
        By system.
    fixes : dict of (int, str) to Fixes, or to what holds them in fewer bytes
        By system and message; the most trusted message first.
    unix : dict of int to UnixTimes
    values : list of NamedValues
    happenings : list of Happening
    heard : dict of Sender to int
    fields : tuple of str
    damage : Damage
    """

    kind: str
    ticks: dict[int, Ticks] = field(default_factory=dict)
    fixes: dict[tuple[int, str], Fixes | PackedFixes] = field(default_factory=dict)
    unix: dict[int, UnixTimes] = field(default_factory=dict)
    values: list[NamedValues] = field(default_factory=list)
    happenings: list[Happening] = field(default_factory=list)
    heard: dict[Sender, int] = field(default_factory=dict)
    fields: tuple[str, ...] = ()
    damage: Damage = field(default_factory=Damage)


def autopilot_of(components: dict[int, int]) -> int:
    """Return which component of a system is the autopilot: 1, or who sent most of its positions.

    Parameters
    ----------
    components : dict of int to int
        Component to the number of its messages.
    """
    return AUTOPILOT if AUTOPILOT in components else max(components, key=lambda one: components[one])


def changes(values: NDArray[np.generic]) -> NDArray[np.intp]:
    """Return where a row of values differs from the one before; the first always does."""
    return np.flatnonzero(np.concatenate(([True], values[1:] != values[:-1]))) if values.size else np.zeros(0, np.intp)
