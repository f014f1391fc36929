"""The named values of a .tlog, series by series: every one is kept, in as few bytes as it came in."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.flightlog.log import AMBIENT, NamedValues, Sender
from sparsor.flightlog.messages import DEBUG_FLOAT_ARRAY, DEBUG_VECT, NAMED_VALUE_FLOAT, NAMED_VALUE_INT
from sparsor.flightlog.texts import rows_by_text
from sparsor.flightlog.thinning import Rows

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from sparsor.flightlog.messages import Table

NAMED: Final = (NAMED_VALUE_FLOAT, NAMED_VALUE_INT, DEBUG_VECT, DEBUG_FLOAT_ARRAY)
# Message to the columns of its time and of its values.
_TIMES: Final = {
    NAMED_VALUE_FLOAT: "time_boot_ms",
    NAMED_VALUE_INT: "time_boot_ms",
    DEBUG_VECT: "time_usec",
    DEBUG_FLOAT_ARRAY: "time_usec",
}
_COLUMNS: Final = {
    NAMED_VALUE_FLOAT: ("value",),
    NAMED_VALUE_INT: ("value",),
    DEBUG_VECT: ("x", "y", "z"),
    DEBUG_FLOAT_ARRAY: ("data",),
}
_WRAP = 1 << 32


class NamedSeries:
    """The series of all senders, taken block by block."""

    def __init__(self) -> None:
        self._series: defaultdict[tuple[int, Sender, str], Rows] = defaultdict(Rows)

    def add(self, message: int, sender: Sender, table: Table) -> None:
        """Take the messages of one kind and sender in a block."""
        columns = (_TIMES[message], *_COLUMNS[message])
        for name, rows in rows_by_text(table.fields["name"]):
            fields = table.fields[rows]
            kept = (fields[column] for column in columns)
            self._series[message, sender, name].add(table.order[rows], table.received_s[rows], *kept)

    def named_values(self) -> Iterator[NamedValues]:
        """Yield the series, by message, sender and name; each is given away with it."""
        for message, sender, name in sorted(self._series, key=lambda key: (NAMED.index(key[0]), *key[1:])):
            yield from _expanded(message, sender, name, self._series.pop((message, sender, name)).joined())


def ambient(sender: Sender, columns: tuple[np.ndarray, ...]) -> Iterator[NamedValues]:
    """Yield pressure and temperature from order, stamps and fields of SCALED_PRESSURE."""
    order, stamp_us, fields = columns[:3]
    received_s, stamp_s = stamp_us / 1e6, fields["time_boot_ms"] / 1e3
    for name, scale in (("press_abs", 1.0), ("temperature", 0.01)):
        value = (fields[name] * scale).astype(np.float64)
        yield NamedValues(sender, AMBIENT, name, order, received_s, stamp_s, value)


def unwrapped_s(counts_ms: NDArray[np.uint32]) -> NDArray[np.float64]:
    """Return a 32-bit counter of milliseconds in seconds, without its overflows."""
    before, after = counts_ms[:-1], counts_ms[1:]
    fell = (after < before) & (before - after > _WRAP // 2)
    if not fell.any():
        return np.asarray(counts_ms / 1e3, dtype=np.float64)
    return np.asarray((counts_ms + np.concatenate(([0], np.cumsum(fell))) * _WRAP) / 1e3, dtype=np.float64)


def _expanded(message: int, sender: Sender, name: str, columns: tuple[np.ndarray, ...]) -> Iterator[NamedValues]:
    # A float and an integer of one name are two series; so are the messages of one log that share a name.
    order, received_s, times, *values = columns
    if message in (NAMED_VALUE_FLOAT, NAMED_VALUE_INT):
        kind = "NAMED_VALUE_FLOAT" if message == NAMED_VALUE_FLOAT else "NAMED_VALUE_INT"
        yield NamedValues(sender, kind, name, order, received_s, unwrapped_s(times), values[0].astype(np.float64))
        return
    stamp_s = times / 1e6
    if message == DEBUG_VECT:
        for axis, value in zip("xyz", values, strict=True):
            value_of = value.astype(np.float64)
            yield NamedValues(sender, "DEBUG_VECT", f"{name}.{axis}", order, received_s, stamp_s, value_of)
        return
    (data,) = values
    for place in range(1 + int(np.flatnonzero((data != 0).any(axis=0)).max(initial=0))):
        value_of = data[:, place].astype(np.float64)
        yield NamedValues(sender, "DEBUG_FLOAT_ARRAY", f"{name}[{place}]", order, received_s, stamp_s, value_of)
