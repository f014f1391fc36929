"""A ground station's log: every MAVLink frame with the time at which it passed."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.lib.recfunctions import repack_fields

from sparsor.core.mavlink_scan import TlogScanner
from sparsor.flightlog.log import Damage, Places, Sender
from sparsor.flightlog.messages import (
    ATTITUDE,
    GLOBAL_POSITION_INT,
    GPS_RAW_INT,
    SCALED_PRESSURE,
    SYSTEM_TIME,
    WANTED,
    Table,
    scanned,
    table_of,
)
from sparsor.flightlog.recording import Fixes, Recording, Ticks, UnixTimes, autopilot_of
from sparsor.flightlog.thinning import APART_S, CLOCK_S, PLACE_DEG, PLACE_M, WHOLE, Course, ThinnedRows
from sparsor.flightlog.tlogevents import StateMessages
from sparsor.flightlog.tlogvalues import NAMED, NamedSeries, ambient

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from numpy.typing import NDArray

    from sparsor.flightlog.log import NamedValues

_CLOCKS: Final = (GLOBAL_POSITION_INT, ATTITUDE, SYSTEM_TIME, SCALED_PRESSURE)
_SHOWS_PLACE: Final = (GLOBAL_POSITION_INT, GPS_RAW_INT, ATTITUDE)
_VALID_UNIX_S = 946_684_800.0  # the year 2000: a clock that was never set shows less
_FIX_3D = 3
_RECEIVED = ["time_usec", "lat", "lon", "alt", "fix_type"]
_UNIX_APART_S = 60.0
_AIR = (0.05, 5.0)  # hPa, 0.01 degrees C


def read_tlog(blocks: Iterable[bytes], whole: int = WHOLE) -> Recording:
    """Return what a .tlog holds.

    Parameters
    ----------
    blocks : iterable of bytes
        The file in pieces of any size.
    whole : int
        So many readings of a clock, and positions of a kind, are kept as they are; of more, see `thinning`.
    """
    scanner = TlogScanner(WANTED)
    heard: defaultdict[Sender, _Heard] = defaultdict(partial(_Heard, whole))
    series = NamedSeries()
    for block in scanned(blocks, scanner):
        own: defaultdict[Sender, dict[int, Table]] = defaultdict(dict)
        for group in scanner.groups(block):
            sender = Sender(group.system, group.component)
            if group.message in NAMED:
                series.add(group.message, sender, table_of(group))
            else:
                own[sender][group.message] = table_of(group)
        for sender, tables in own.items():
            heard[sender].add(tables)
    recording = Recording("tlog")
    recording.heard = {Sender(*who): count for who, count in sorted(scanner.heard().items())}
    recording.damage = Damage(scanner.damaged, scanner.skipped, scanner.unknown, scanner.lost)
    for sender in _autopilots(heard):
        heard[sender].tell(sender.system, recording)
    recording.values += series.named_values()
    for sender in sorted(heard):
        recording.values += heard[sender].ambient(sender)
    return recording


class _Heard:
    """What one sender says of itself, taken block by block."""

    def __init__(self, whole: int) -> None:
        apart_ms = APART_S * 1e3
        place = (PLACE_DEG * 1e7, PLACE_DEG * 1e7, PLACE_M * 1e3)
        self.positions = 0
        self._clock = ThinnedRows(_clock_course, (CLOCK_S * 1e3,), APART_S * 1e6, whole)
        self._estimated = ThinnedRows(_estimated_course, (*place, PLACE_M * 1e3), apart_ms, whole)
        self._received = ThinnedRows(_received_course, place, APART_S * 1e6, whole)
        self._unix = ThinnedRows(_unix_course, (CLOCK_S * 1e6,), _UNIX_APART_S * 1e3, whole)
        self._air = ThinnedRows(_air_course, _AIR, apart_ms, whole)
        self._states = StateMessages()

    def add(self, tables: dict[int, Table]) -> None:
        """Take the messages of a block, by kind."""
        clocks = [tables[kind] for kind in _CLOCKS if kind in tables]
        if clocks:
            order = np.concatenate([table.order for table in clocks])
            rows = np.argsort(order, kind="stable")
            stamp_us = np.concatenate([table.stamp_us for table in clocks])
            time_ms = np.concatenate([table.fields["time_boot_ms"] for table in clocks])
            self._clock.add(order[rows], stamp_us[rows], time_ms[rows])
        if GLOBAL_POSITION_INT in tables:
            self._estimated.add(*tables[GLOBAL_POSITION_INT].columns)
        if GPS_RAW_INT in tables:
            table = tables[GPS_RAW_INT]
            self._received.add(table.order, table.stamp_us, repack_fields(table.fields[_RECEIVED]))
        if SCALED_PRESSURE in tables:
            self._air.add(*tables[SCALED_PRESSURE].columns)
        if SYSTEM_TIME in tables:
            table = tables[SYSTEM_TIME]
            valid = table.rows(table.fields["time_unix_usec"] / 1e6 > _VALID_UNIX_S)
            self._unix.add(valid.order, valid.fields)
        self.positions += sum(tables[kind].order.size for kind in _SHOWS_PLACE if kind in tables)
        self._states.add(tables)

    def tell(self, system: int, recording: Recording) -> None:
        """Give a recording what the autopilot of a system said."""
        recording.ticks[system] = _ticks(self._clock.joined())
        recording.unix[system] = _unix(self._unix.joined())
        for message, rows in (("GLOBAL_POSITION_INT", self._estimated), ("GPS_RAW_INT", self._received)):
            if columns := rows.joined():
                recording.fixes[system, message] = _Positions(*columns)
        recording.happenings += self._states.happenings(system)

    def ambient(self, sender: Sender) -> Iterator[NamedValues]:
        """Yield the air's pressure and temperature."""
        columns = self._air.joined()
        if columns:
            yield from ambient(sender, columns)


def _autopilots(heard: Mapping[Sender, _Heard]) -> Iterator[Sender]:
    """Yield every system that says where it is or how it lies, by the component that does."""
    components: dict[int, dict[int, int]] = {}
    for sender in sorted(heard):
        if heard[sender].positions:
            components.setdefault(sender.system, {})[sender.component] = heard[sender].positions
    for system, counts in components.items():
        yield Sender(system, autopilot_of(counts))


def _ticks(columns: tuple[np.ndarray, ...]) -> Ticks:
    if not columns:
        return Ticks(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))
    order, stamp_us, time_ms = columns[:3]
    return Ticks(order, stamp_us / 1e6, time_ms / 1e3)


def _unix(columns: tuple[np.ndarray, ...]) -> UnixTimes:
    if not columns:
        return UnixTimes(np.zeros(0, np.int64), np.zeros(0))
    order, fields = columns[:2]
    return UnixTimes(order, fields["time_unix_usec"] / 1e6 - fields["time_boot_ms"] / 1e3)


@dataclass(frozen=True, eq=False)
class _Positions:
    """Messages of GLOBAL_POSITION_INT, or some fields of GPS_RAW_INT, as they came; columns as in `Table`."""

    order: NDArray[np.int64]
    stamp_us: NDArray[np.uint64]
    fields: np.ndarray
    stands_for: NDArray[np.int32]

    @property
    def received_s(self) -> NDArray[np.float64]:
        return np.asarray(self.stamp_us / 1e6, dtype=np.float64)

    def take(self, rows: NDArray[np.intp] | slice) -> Fixes:
        fields = self.fields[rows]
        if "relative_alt" in (fields.dtype.names or ()):
            height_m, time_s = fields["relative_alt"] / 1e3, fields["time_boot_ms"] / 1e3
            has_fix = np.ones(fields.size, dtype=np.bool_)
        else:
            height_m, time_s = np.full(fields.size, np.nan), _since_boot_s(fields)
            has_fix = fields["fix_type"] >= _FIX_3D
        places = Places(fields["lon"] / 1e7, fields["lat"] / 1e7, fields["alt"] / 1e3, height_m)
        return Fixes(self.order[rows], self.stamp_us[rows] / 1e6, time_s, places, has_fix, self.stands_for[rows])


def _since_boot_s(fields: np.ndarray) -> NDArray[np.float64]:
    """Return the time of GPS_RAW_INT, NaN where it is none or the time of day."""
    stamp_s = fields["time_usec"] / 1e6
    return np.where((stamp_s > 0) & (stamp_s < _VALID_UNIX_S), stamp_s, np.nan)


def _course(along: np.ndarray, *across: np.ndarray, state: np.ndarray | None = None) -> Course:
    columns = np.stack(across, axis=1).astype(np.float64)
    states = np.zeros(along.size, dtype=np.int64) if state is None else state.astype(np.int64)
    return Course(along.astype(np.float64), columns, states)


def _clock_course(_order: np.ndarray, stamp_us: np.ndarray, time_ms: np.ndarray) -> Course:
    return _course(stamp_us, time_ms)


def _unix_course(_order: np.ndarray, fields: np.ndarray) -> Course:
    return _course(fields["time_boot_ms"], fields["time_unix_usec"] - fields["time_boot_ms"] * 1e3)


def _estimated_course(_order: np.ndarray, _stamp_us: np.ndarray, fields: np.ndarray) -> Course:
    names = ("lat", "lon", "alt", "relative_alt")
    return _course(fields["time_boot_ms"], *(fields[name] for name in names), state=_at_zero(fields))


def _received_course(_order: np.ndarray, stamp_us: np.ndarray, fields: np.ndarray) -> Course:
    time_us = _since_boot_s(fields) * 1e6
    along = np.where(np.isnan(time_us), stamp_us, time_us)
    state = _at_zero(fields) + 2 * (fields["fix_type"] >= _FIX_3D)
    return _course(along, fields["lat"], fields["lon"], fields["alt"], state=state)


def _air_course(_order: np.ndarray, _stamp_us: np.ndarray, fields: np.ndarray) -> Course:
    return _course(fields["time_boot_ms"], fields["press_abs"], fields["temperature"])


def _at_zero(fields: np.ndarray) -> NDArray[np.bool_]:
    return np.asarray((fields["lat"] == 0) & (fields["lon"] == 0))
