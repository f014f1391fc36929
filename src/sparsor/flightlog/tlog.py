"""A ground station's log: every MAVLink frame with the time at which it passed."""

from __future__ import annotations

from collections import defaultdict
from functools import cache
from itertools import count, pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.recfunctions import repack_fields

from sparsor.core.mavlink_scan import RECORD, TlogScanner
from sparsor.flightlog.log import AMBIENT, Damage, NamedValues, Places, Sender
from sparsor.flightlog.recording import Fixes, Happening, Recording, Ticks, UnixTimes, autopilot_of, changes
from sparsor.flightlog.texts import text_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

HEARTBEAT, SYSTEM_TIME, GPS_RAW_INT, SCALED_PRESSURE, ATTITUDE, GLOBAL_POSITION_INT = 0, 2, 24, 29, 30, 33
MISSION_CURRENT, MISSION_ITEM_REACHED, EXTENDED_SYS_STATE = 42, 46, 245
DEBUG_VECT, NAMED_VALUE_FLOAT, NAMED_VALUE_INT, STATUSTEXT, DEBUG_FLOAT_ARRAY = 250, 251, 252, 253, 350
WANTED = (
    *(HEARTBEAT, SYSTEM_TIME, GPS_RAW_INT, SCALED_PRESSURE, ATTITUDE, GLOBAL_POSITION_INT),
    *(MISSION_CURRENT, MISSION_ITEM_REACHED, EXTENDED_SYS_STATE),
    *(DEBUG_VECT, NAMED_VALUE_FLOAT, NAMED_VALUE_INT, STATUSTEXT, DEBUG_FLOAT_ARRAY),
)
_VALID_UNIX_S = 946_684_800.0  # the year 2000: a clock that was never set shows less
_NO_AUTOPILOT = 8  # MAV_AUTOPILOT_INVALID: a ground station, companion, camera
_ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
_FIX_3D = 3
_WRAP = 2.0**32
# A log of many gigabytes is mostly these, of which only the first fields are wanted.
_LEADING = {ATTITUDE: 1, GPS_RAW_INT: 10, GLOBAL_POSITION_INT: 5}
_KEPT = ["order", "stamp_us", "system", "component"]


class Table:
    """All messages of one kind: `records` (RECORD) and `fields`, row by row."""

    def __init__(self, records: np.ndarray, fields: np.ndarray) -> None:
        self.records, self.fields = records, fields

    @property
    def received_s(self) -> NDArray[np.float64]:
        """Unix time at which they were recorded."""
        received: NDArray[np.float64] = self.records["stamp_us"] / 1e6
        return received

    @property
    def senders(self) -> NDArray[np.int64]:
        """System and component in one number."""
        senders: NDArray[np.int64] = self.records["system"].astype(np.int64) << 8 | self.records["component"]
        return senders

    def of(self, system: int, component: int) -> Table:
        """Return what one sender sent."""
        own = self.senders == system << 8 | component
        return self if own.all() else self.rows(own)

    def rows(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> Table:
        """Return some of them."""
        return Table(self.records[rows], self.fields[rows])


def read_tlog(blocks: Iterable[bytes]) -> Recording:
    """Return what a .tlog holds.

    Parameters
    ----------
    blocks : iterable of bytes
        The file in pieces of any size.
    """
    tables, scanner = read_messages(blocks)
    recording = Recording("tlog")
    recording.heard = {Sender(*who): count for who, count in sorted(scanner.heard().items())}
    recording.damage = Damage(scanner.damaged, scanner.skipped, scanner.unknown, scanner.lost)
    for system, component in _autopilots(tables):
        own = {kind: table.of(system, component) for kind, table in tables.items()}
        recording.ticks[system] = _ticks(own)
        recording.unix[system] = _unix(own[SYSTEM_TIME])
        recording.fixes[system, "GLOBAL_POSITION_INT"] = _estimated(own[GLOBAL_POSITION_INT])
        recording.fixes[system, "GPS_RAW_INT"] = _received_positions(own[GPS_RAW_INT])
        recording.happenings += _happenings(system, own)
    recording.values = list(_values(tables))
    return recording


def read_messages(blocks: Iterable[bytes], wanted: Iterable[int] = WANTED) -> tuple[dict[int, Table], TlogScanner]:
    """Return the messages of some kinds in a .tlog, decoded, and the scanner with its counts."""
    kinds = tuple(wanted)
    parts: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {kind: [] for kind in kinds}
    scanner = TlogScanner(kinds)

    def take(data: bytes, *, ended: bool) -> None:
        block = scanner.feed(data, ended=ended)
        for kind in np.unique(block.records["message"]):
            records, fields = block.payloads(int(kind), layout(int(kind)))
            parts[int(kind)].append((repack_fields(records[_KEPT]), fields))

    for data in blocks:
        take(data, ended=False)
    take(b"", ended=True)
    return {kind: _table(kind, parts.pop(kind)) for kind in kinds}, scanner  # no kind is held twice for long


@cache
def layout(message: int) -> np.dtype[np.void]:
    """Return a message's fields, as far as they are wanted, as they lie in its payload."""
    from pymavlink.dialects.v20 import ardupilotmega

    kind = ardupilotmega.mavlink_map[message]
    codes = kind.native_format.decode().lstrip("<")
    sizes = {name: kind.array_lengths[place] for place, name in enumerate(kind.ordered_fieldnames)}
    fields: list[tuple[str, str] | tuple[str, str, int]] = []
    for name, code in zip(kind.ordered_fieldnames, codes, strict=True):
        if code == "c":
            fields.append((name, f"S{sizes[name]}"))
        else:
            fields.append((name, f"<{code}", sizes[name]) if sizes[name] else (name, f"<{code}"))
    return np.dtype(fields[: _LEADING.get(message)])


def _table(kind: int, parts: list[tuple[np.ndarray, np.ndarray]]) -> Table:
    if not parts:
        return Table(np.zeros(0, repack_fields(RECORD[_KEPT])), np.zeros(0, layout(kind)))
    return Table(np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts]))


def _autopilots(tables: dict[int, Table]) -> Iterator[tuple[int, int]]:
    """Yield every system that says where it is or how it lies, and the component that does."""
    kinds = (GLOBAL_POSITION_INT, GPS_RAW_INT, ATTITUDE)
    senders = np.concatenate([tables[kind].senders for kind in kinds])
    counts = np.bincount(senders, minlength=1 << 16).reshape(256, 256)
    for system in np.flatnonzero(counts.any(axis=1)).tolist():
        components = np.flatnonzero(counts[system]).tolist()
        yield system, autopilot_of({one: int(counts[system, one]) for one in components})


def _ticks(own: dict[int, Table]) -> Ticks:
    clocks = [own[kind] for kind in (GLOBAL_POSITION_INT, ATTITUDE, SYSTEM_TIME, SCALED_PRESSURE)]
    order = np.concatenate([table.records["order"] for table in clocks])
    received_s = np.concatenate([table.received_s for table in clocks])
    time_s = np.concatenate([table.fields["time_boot_ms"] / 1e3 for table in clocks])
    rows = np.argsort(order, kind="stable")
    return Ticks(order[rows], received_s[rows], time_s[rows])


def _unix(table: Table) -> UnixTimes:
    unix_s = table.fields["time_unix_usec"] / 1e6
    valid = unix_s > _VALID_UNIX_S
    offset_s = unix_s - table.fields["time_boot_ms"] / 1e3
    return UnixTimes(table.records["order"][valid], offset_s[valid])


def _estimated(table: Table) -> Fixes:
    fields = table.fields
    places = Places(fields["lon"] / 1e7, fields["lat"] / 1e7, fields["alt"] / 1e3, fields["relative_alt"] / 1e3)
    time_s = fields["time_boot_ms"] / 1e3
    return Fixes(table.records["order"], table.received_s, time_s, places, np.ones(fields.size, dtype=np.bool_))


def _received_positions(table: Table) -> Fixes:
    fields = table.fields
    unknown = np.full(fields.size, np.nan)
    places = Places(fields["lon"] / 1e7, fields["lat"] / 1e7, fields["alt"] / 1e3, unknown)
    stamp_s = fields["time_usec"] / 1e6
    time_s = np.where((stamp_s > 0) & (stamp_s < _VALID_UNIX_S), stamp_s, np.nan)
    return Fixes(table.records["order"], table.received_s, time_s, places, fields["fix_type"] >= _FIX_3D)


def _happenings(system: int, own: dict[int, Table]) -> Iterator[Happening]:
    beats = own[HEARTBEAT].rows(own[HEARTBEAT].fields["autopilot"] != _NO_AUTOPILOT)
    armed = (beats.fields["base_mode"] & _ARMED) > 0
    kinds = {True: "armed", False: "disarmed"}
    for row in changes(armed)[int(armed.size > 0 and not armed[0]) :]:  # a log begins disarmed
        record = beats.records[row]
        yield Happening(int(record["order"]), record["stamp_us"] / 1e6, system, kinds[bool(armed[row])])
    yield from _changes(system, "mode", beats, "custom_mode")
    yield from _changes(system, "landed_state", own[EXTENDED_SYS_STATE], "landed_state")
    yield from _changes(system, "item_current", own[MISSION_CURRENT], "seq")
    yield from _changes(system, "item_reached", own[MISSION_ITEM_REACHED], "seq")
    yield from _texts(system, own[STATUSTEXT])


def _changes(system: int, kind: str, table: Table, name: str) -> Iterator[Happening]:
    for row in changes(table.fields[name]):
        record = table.records[row]
        value = int(table.fields[name][row])
        yield Happening(int(record["order"]), record["stamp_us"] / 1e6, system, kind, value)


def _texts(system: int, table: Table) -> Iterator[Happening]:
    """Yield the status texts, put together when they came in several messages."""
    starts = np.flatnonzero(_begins_text(table.fields))
    for first, end in pairwise([*starts.tolist(), table.fields.size]):
        record, fields = table.records[first], table.fields[first:end]
        text = text_of(b"".join(bytes(part) for part in fields["text"]))
        severity = int(fields["severity"][0])
        yield Happening(int(record["order"]), record["stamp_us"] / 1e6, system, "text", severity, text)


def _begins_text(fields: np.ndarray) -> NDArray[np.bool_]:
    begins = np.ones(fields.size, dtype=np.bool_)
    same = (fields["id"][1:] == fields["id"][:-1]) & (fields["id"][1:] != 0)
    begins[1:] = ~(same & (fields["chunk_seq"][1:] == fields["chunk_seq"][:-1] + 1))
    return begins


def _values(tables: dict[int, Table]) -> Iterator[NamedValues]:
    # A float and an integer of one name are two series; so are the messages of one log that share a name.
    for kind, message in ((NAMED_VALUE_FLOAT, "NAMED_VALUE_FLOAT"), (NAMED_VALUE_INT, "NAMED_VALUE_INT")):
        for sender, name, table in _series(tables[kind]):
            stamp_s = unwrapped(table.fields["time_boot_ms"].astype(np.float64)) / 1e3
            yield _named(sender, message, name, table, stamp_s, table.fields["value"])
    for sender, name, table in _series(tables[DEBUG_VECT]):
        for axis in "xyz":
            stamp_s = table.fields["time_usec"] / 1e6
            yield _named(sender, "DEBUG_VECT", f"{name}.{axis}", table, stamp_s, table.fields[axis])
    for sender, name, table in _series(tables[DEBUG_FLOAT_ARRAY]):
        data = table.fields["data"]
        for place in range(1 + int(np.flatnonzero((data != 0).any(axis=0)).max(initial=0))):
            stamp_s = table.fields["time_usec"] / 1e6
            yield _named(sender, "DEBUG_FLOAT_ARRAY", f"{name}[{place}]", table, stamp_s, data[:, place])
    air = tables[SCALED_PRESSURE]
    for who in np.unique(air.senders).tolist():
        system, component = divmod(who, 256)
        own = air.of(system, component)
        stamp_s = own.fields["time_boot_ms"] / 1e3
        for name, scale in (("press_abs", 1.0), ("temperature", 0.01)):
            yield _named(Sender(system, component), AMBIENT, name, own, stamp_s, own.fields[name] * scale)


def _named(
    sender: Sender, message: str, name: str, table: Table, stamp_s: NDArray[np.float64], value: np.ndarray
) -> NamedValues:
    order = table.records["order"].copy()
    return NamedValues(sender, message, name, order, table.received_s, stamp_s, value.astype(np.float64))


def _series(table: Table) -> Iterator[tuple[Sender, str, Table]]:
    """Yield sender, name and messages of every series in a table."""
    numbers: defaultdict[tuple[int, bytes], int] = defaultdict(count().__next__)
    keys = zip(table.senders.tolist(), table.fields["name"].tolist(), strict=True)
    which = np.fromiter(map(numbers.__getitem__, keys), np.int64, table.fields.size)
    same: dict[tuple[int, str], list[int]] = {}  # what stands behind a name's end may differ
    for (who, raw), number in numbers.items():
        same.setdefault((who, text_of(raw)), []).append(number)
    for who, name in sorted(same):
        yield Sender(*divmod(who, 256)), name, table.rows(np.isin(which, same[who, name]))


def unwrapped(counts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a 32-bit counter without its overflows."""
    turns = np.zeros(counts.size)
    turns[1:] = np.cumsum(np.diff(counts) < -_WRAP / 2)
    return counts + turns * _WRAP
