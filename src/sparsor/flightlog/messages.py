"""The MAVLink messages of a .tlog that are wanted, found and decoded."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.core.mavlink_scan import Block, Group, TlogScanner

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

HEARTBEAT, SYSTEM_TIME, GPS_RAW_INT, SCALED_PRESSURE, ATTITUDE, GLOBAL_POSITION_INT = 0, 2, 24, 29, 30, 33
MISSION_CURRENT, MISSION_ITEM_REACHED, EXTENDED_SYS_STATE = 42, 46, 245
DEBUG_VECT, NAMED_VALUE_FLOAT, NAMED_VALUE_INT, STATUSTEXT, DEBUG_FLOAT_ARRAY = 250, 251, 252, 253, 350
WANTED: Final = (
    *(HEARTBEAT, SYSTEM_TIME, GPS_RAW_INT, SCALED_PRESSURE, ATTITUDE, GLOBAL_POSITION_INT),
    *(MISSION_CURRENT, MISSION_ITEM_REACHED, EXTENDED_SYS_STATE),
    *(DEBUG_VECT, NAMED_VALUE_FLOAT, NAMED_VALUE_INT, STATUSTEXT, DEBUG_FLOAT_ARRAY),
)
# A log of many gigabytes is mostly these, of which only the first fields are wanted.
_LEADING = {ATTITUDE: 1, GPS_RAW_INT: 10, GLOBAL_POSITION_INT: 5, MISSION_CURRENT: 1}


class Table:
    """Messages of one kind from one sender.

    Parameters
    ----------
    order : array of int64 (n,)
        Places in the log.
    stamp_us : array of uint64 (n,)
        Unix time at which they were recorded, microseconds.
    fields : structured array (n,)
        As in `layout`.
    """

    def __init__(self, order: NDArray[np.int64], stamp_us: NDArray[np.uint64], fields: np.ndarray) -> None:
        self.order, self.stamp_us, self.fields = order, stamp_us, fields

    @classmethod
    def empty(cls, message: int) -> Table:
        """Return a table without a message."""
        return cls(np.zeros(0, np.int64), np.zeros(0, np.uint64), np.zeros(0, layout(message)))

    @property
    def received_s(self) -> NDArray[np.float64]:
        """Unix time at which they were recorded."""
        received: NDArray[np.float64] = self.stamp_us / 1e6
        return received

    @property
    def columns(self) -> tuple[NDArray[np.int64], NDArray[np.uint64], np.ndarray]:
        """What the table is made from."""
        return self.order, self.stamp_us, self.fields

    def rows(self, rows: NDArray[np.bool_] | NDArray[np.intp] | slice) -> Table:
        """Return some of them."""
        return Table(self.order[rows], self.stamp_us[rows], self.fields[rows])


def scanned(blocks: Iterable[bytes], scanner: TlogScanner) -> Iterator[Block]:
    """Yield what a scanner finds in a file that comes in pieces of any size."""
    for data in blocks:
        yield scanner.feed(data, ended=False)
    yield scanner.feed(b"", ended=True)


def table_of(group: Group) -> Table:
    """Return the messages of one kind and sender in a block, decoded."""
    records = group.block.records
    return Table(records["order"][group.rows], records["stamp_us"][group.rows], group.fields(layout(group.message)))


def read_messages(
    blocks: Iterable[bytes], wanted: Iterable[int] = WANTED
) -> tuple[dict[tuple[int, int, int], Table], TlogScanner]:
    """Return all messages of some kinds in a .tlog, decoded, and the scanner with its counts.

    The tables are by message, system and component.
    """
    scanner = TlogScanner(tuple(wanted))
    parts: dict[tuple[int, int, int], list[Table]] = {}
    for block in scanned(blocks, scanner):
        for group in scanner.groups(block):
            parts.setdefault((group.message, group.system, group.component), []).append(table_of(group))
    tables = {
        key: Table(*(np.concatenate(column) for column in zip(*(one.columns for one in tables), strict=True)))
        for key, tables in parts.items()
    }
    return tables, scanner


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
