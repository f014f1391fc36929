"""What happened to a vehicle, by the messages of its autopilot in a .tlog."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from sparsor.flightlog.messages import (
    EXTENDED_SYS_STATE,
    HEARTBEAT,
    MISSION_CURRENT,
    MISSION_ITEM_REACHED,
    STATUSTEXT,
    Table,
)
from sparsor.flightlog.recording import Happening, changes
from sparsor.flightlog.texts import text_of
from sparsor.flightlog.thinning import ChangedRows, Rows

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

_NO_AUTOPILOT = 8  # MAV_AUTOPILOT_INVALID: a ground station, companion, camera
_ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
_STATES = {
    EXTENDED_SYS_STATE: ("landed_state", "landed_state"),
    MISSION_CURRENT: ("item_current", "seq"),
    MISSION_ITEM_REACHED: ("item_reached", "seq"),
}


class StateMessages:
    """The messages of one sender by which its state changed, and its texts, taken block by block."""

    def __init__(self) -> None:
        self._kept: dict[int, Rows] = {}

    def add(self, tables: Mapping[int, Table]) -> None:
        """Take the messages of a block, by kind."""
        for message, table in tables.items():
            if message == HEARTBEAT:
                beats = table.rows(table.fields["autopilot"] != _NO_AUTOPILOT)
                mode = beats.fields["custom_mode"].astype(np.int64) << 1 | _is_armed(beats)
                self._rows(message, ChangedRows).add(*beats.columns, mode)
            elif message in _STATES:
                self._rows(message, ChangedRows).add(*table.columns, table.fields[_STATES[message][1]])
            elif message == STATUSTEXT:
                self._rows(message, Rows).add(*table.columns)

    def happenings(self, system: int) -> Iterator[Happening]:
        """Yield what they tell of a vehicle."""
        beats = self._table(HEARTBEAT)
        armed = _is_armed(beats)
        kinds = {True: "armed", False: "disarmed"}
        for row in changes(armed)[int(armed.size > 0 and not armed[0]) :]:  # a log begins disarmed
            yield _at(beats, row, system, kinds[bool(armed[row])])
        yield from _changes(system, "mode", beats, "custom_mode")
        for message, (kind, name) in _STATES.items():
            yield from _changes(system, kind, self._table(message), name)
        yield from _texts(system, self._table(STATUSTEXT))

    def _rows(self, message: int, kind: type[Rows]) -> Rows:
        return self._kept.setdefault(message, kind())

    def _table(self, message: int) -> Table:
        columns = self._kept[message].joined() if message in self._kept else ()
        return Table(*columns[:3]) if columns else Table.empty(message)


def _is_armed(beats: Table) -> NDArray[np.bool_]:
    return np.asarray((beats.fields["base_mode"] & _ARMED) > 0)


def _at(table: Table, row: int, system: int, kind: str, value: int = 0, text: str = "") -> Happening:
    return Happening(int(table.order[row]), int(table.stamp_us[row]) / 1e6, system, kind, value, text)


def _changes(system: int, kind: str, table: Table, name: str) -> Iterator[Happening]:
    for row in changes(table.fields[name]):
        yield _at(table, int(row), system, kind, int(table.fields[name][row]))


def _texts(system: int, table: Table) -> Iterator[Happening]:
    """Yield the status texts, put together when they came in several messages."""
    starts = np.flatnonzero(_begins_text(table.fields))
    for first, end in pairwise([*starts.tolist(), table.fields.size]):
        fields = table.fields[first:end]
        text = text_of(b"".join(bytes(part) for part in fields["text"]))
        yield _at(table, first, system, "text", int(fields["severity"][0]), text)


def _begins_text(fields: np.ndarray) -> NDArray[np.bool_]:
    begins = np.ones(fields.size, dtype=np.bool_)
    same = (fields["id"][1:] == fields["id"][:-1]) & (fields["id"][1:] != 0)
    begins[1:] = ~(same & (fields["chunk_seq"][1:] == fields["chunk_seq"][:-1] + 1))
    return begins
