"""What a flight log says, whatever kind of file it came from."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from sparsor.flightlog.clocks import Clock

AUTOPILOT = 1  # MAV_COMP_ID_AUTOPILOT1
AMBIENT = "SCALED_PRESSURE"
"""The message under whose name air pressure ("press_abs", hPa) and temperature ("temperature", degrees C) are kept."""


class Sender(NamedTuple):
    """Who sent a message."""

    system: int
    component: int

    def __str__(self) -> str:
        return f"{self.system}/{self.component}"


@dataclass(frozen=True, eq=False)
class Places:
    """Positions, one for each row of what they belong to.

    Parameters
    ----------
    lon_deg, lat_deg : array of float64 (n,)
    alt_amsl_m : array of float64 (n,)
        Metres above mean sea level; NaN when unknown.
    height_m : array of float64 (n,)
        Metres above home; NaN when unknown.
    """

    lon_deg: NDArray[np.float64]
    lat_deg: NDArray[np.float64]
    alt_amsl_m: NDArray[np.float64]
    height_m: NDArray[np.float64]

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> Places:
        """Return some of the rows."""
        return Places(self.lon_deg[rows], self.lat_deg[rows], self.alt_amsl_m[rows], self.height_m[rows])


@dataclass(frozen=True)
class DroppedFixes:
    """How many positions of a track were not believed, and why.

    Parameters
    ----------
    zero : int
        At 0/0, or outside the globe.
    no_fix : int
        The receiver had no three-dimensional fix.
    jumping : int
        Farther from their neighbours than anything flies.
    """

    zero: int = 0
    no_fix: int = 0
    jumping: int = 0

    def __add__(self, other: DroppedFixes) -> DroppedFixes:
        return DroppedFixes(self.zero + other.zero, self.no_fix + other.no_fix, self.jumping + other.jumping)


@dataclass(frozen=True, eq=False)
class Track:
    """Where a vehicle was during one boot, by one kind of message.

    Parameters
    ----------
    message : str
        Where the positions are from: GLOBAL_POSITION_INT, GPS_RAW_INT, POS, GPS, ...
    time_s : array of float64 (n,)
        The vehicle's seconds since boot, strictly increasing.
    places : Places
    dropped : DroppedFixes
    """

    message: str
    time_s: NDArray[np.float64]
    places: Places
    dropped: DroppedFixes = field(default_factory=DroppedFixes)


@dataclass(frozen=True, eq=False)
class Boot:
    """A vehicle from power-up to power-down, as far as it was logged.

    Parameters
    ----------
    system : int
    number : int
        Counted from 0 in the order of the log; `Clock.boot` refers to it.
    start_s, end_s : float
        First and last time heard, seconds since boot.
    unix_offset_s : float
        Unix time less time since boot, seconds; NaN when nothing tells.
    unix_source : str
        "vehicle" (its SYSTEM_TIME or GPS time), "receiver" (the clock of whoever recorded), or "".
    tracks : tuple of Track
        The most trusted first.
    """

    system: int
    number: int
    start_s: float
    end_s: float
    unix_offset_s: float
    unix_source: str
    tracks: tuple[Track, ...]


@dataclass(frozen=True, eq=False)
class NamedValues:
    """All values of one name from one sender, as they came.

    Parameters
    ----------
    sender : Sender
    message : str
        NAMED_VALUE_FLOAT, DEBUG_VECT, debug_vect, a .BIN message, "CSV", ...
    name : str
        By which a sensor is asked for. Vectors and arrays have their parts ("VEC.x", "ARR[3]"), messages of a .BIN
        file their columns ("NO2S.NO2").
    order : array of int64 (n,)
        Places in the log, increasing.
    received_s : array of float64 (n,)
        Unix time on the clock of whoever recorded; NaN when none did.
    stamp_s : array of float64 (n,)
        The sender's own clock as it wrote it, taken for the unit it should have; NaN when the message has none.
    value : array of float64 (n,)
    places : Places or None
        Where the values are from, when the message says so itself.
    """

    sender: Sender
    message: str
    name: str
    order: NDArray[np.int64]
    received_s: NDArray[np.float64]
    stamp_s: NDArray[np.float64]
    value: NDArray[np.float64]
    places: Places | None = None

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> NamedValues:
        """Return some of the values."""
        return replace(
            self,
            order=self.order[rows],
            received_s=self.received_s[rows],
            stamp_s=self.stamp_s[rows],
            value=self.value[rows],
            places=None if self.places is None else self.places.take(rows),
        )


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a vehicle.

    Parameters
    ----------
    system, boot : int
    time_s : float
        Seconds since boot.
    kind : str
        "armed", "disarmed", "mode", "landed_state" (MAV_LANDED_STATE), "item_current", "item_reached", "text".
    value : int
        Number of the mode, state or mission item, or the severity of a text.
    text : str
    """

    system: int
    boot: int
    time_s: float
    kind: str
    value: int = 0
    text: str = ""


@dataclass(frozen=True)
class Damage:
    """What was wrong with the files.

    Parameters
    ----------
    places : int
        How often a record was due and none stood there.
    skipped_bytes : int
        Bytes that belonged to no record.
    unknown : int
        Whole messages of kinds that nobody here knows.
    lost : int
        Messages that the senders' counters say were sent and never recorded.
    repeated : int
        Values left out because another of the files has them too.
    """

    places: int = 0
    skipped_bytes: int = 0
    unknown: int = 0
    lost: int = 0
    repeated: int = 0

    def __add__(self, other: Damage) -> Damage:
        return Damage(
            self.places + other.places,
            self.skipped_bytes + other.skipped_bytes,
            self.unknown + other.unknown,
            self.lost + other.lost,
            self.repeated + other.repeated,
        )


@dataclass(frozen=True, eq=False)
class FlightLog:
    """One or several log files of a mission.

    Parameters
    ----------
    files : tuple of str
    kinds : tuple of str
        One a file: "tlog", "BIN", "ulg" or "CSV".
    clocks : mapping of int to Clock
        By system: the vehicle's time since boot along the log.
    boots : tuple of Boot
    values : tuple of NamedValues
    events : tuple of Event
        By boot and time.
    heard : mapping of Sender to int
        Everybody in the log, with the number of messages.
    fields : tuple of str
        .BIN: every MSG.FIELD that can be asked for.
    damage : Damage
    """

    files: tuple[str, ...]
    kinds: tuple[str, ...]
    clocks: Mapping[int, Clock]
    boots: tuple[Boot, ...]
    values: tuple[NamedValues, ...]
    events: tuple[Event, ...]
    heard: Mapping[Sender, int]
    fields: tuple[str, ...] = ()
    damage: Damage = field(default_factory=Damage)

    @property
    def vehicles(self) -> tuple[int, ...]:
        """Systems of which a position is known."""
        return tuple(sorted({boot.system for boot in self.boots if any(t.time_s.size for t in boot.tracks)}))
