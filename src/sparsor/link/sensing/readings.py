"""What a line says: values with names, and perhaps a time; the rules that both formats share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Final, Protocol

from sparsor.errors import InputError, SparsorError

if TYPE_CHECKING:
    from collections.abc import Iterable

LONGEST_NAME: Final = 10  # NAMED_VALUE_FLOAT has char[10]
LARGEST: Final = 3.4028234e38  # of its float
TIME_UNITS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6}


@dataclass(frozen=True)
class Reading:
    """What one line says.

    Parameters
    ----------
    values : tuple of (str, float)
        Names and finite values, in order.
    faults : tuple of str
        Why other values of the line are none.
    time_s : float or None
        The sensor's own time, seconds since whenever; None when the line has none.
    """

    values: tuple[tuple[str, float], ...]
    faults: tuple[str, ...] = ()
    time_s: float | None = None


class LineFormat(Protocol):
    """Turns a line into readings."""

    has_time: bool
    needs_header: bool
    """Whether the first line has to be the columns' names."""

    def read(self, line: str) -> Reading | None:
        """Return what a line says, None for a header; ValueError when it says nothing that is understood."""
        ...


def reading_of(texts: Iterable[tuple[str, str | None]], time_s: float | None) -> Reading:
    """Return a reading from names and texts; texts that are no value become faults."""
    values, faults = [], []
    for name, text in texts:
        try:
            values.append((name, _number(text)))
        except ValueError as error:
            faults.append(f"{name}: {error}")
    return Reading(tuple(values), tuple(faults), time_s)


def time_of(text: str | None, second: float) -> float:
    """Return a time in seconds, from a number or ISO 8601; ValueError when it is neither."""
    try:
        time_s = float(text or "") * second
    except ValueError:
        time_s = datetime.fromisoformat((text or "").strip()).timestamp()
    if not math.isfinite(time_s):
        raise ValueError(f"'{text}' is not a time")
    return time_s


def second_of(time_unit: str) -> float:
    """Return how long a unit of time is, seconds; InputError when it is unknown."""
    if time_unit not in TIME_UNITS:
        raise InputError(f"the unit of time '{time_unit}'; known are {', '.join(TIME_UNITS)}")
    return TIME_UNITS[time_unit]


def is_name(name: str) -> bool:
    """Return whether NAMED_VALUE_FLOAT can carry a name."""
    return 0 < len(name) <= LONGEST_NAME and name.isascii() and name.isprintable() and " " not in name


def checked_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names; InputError when one is none, or two are the same."""
    found = tuple(names)
    for name in found:
        if not is_name(name):
            raise InputError(
                f"a value named '{name}'; MAVLink has room for 1 to {LONGEST_NAME} ASCII characters without a space"
            )
    if len(set(found)) < len(found):
        raise InputError(f"the names {', '.join(found)} are not all different; give NAME=COLUMN for each value")
    return found


def read_line(form: LineFormat, text: str) -> Reading | None:
    """Return what a line says, with why when it says nothing; None for a header."""
    try:
        return form.read(text)
    except SparsorError:
        raise
    except ValueError as error:
        return Reading((), (str(error),))


def _number(text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError:
        raise ValueError(f"'{text or ''}' is not a number") from None
    if not abs(value) <= LARGEST:  # NaN as well
        raise ValueError(f"'{text}' is not a value that can be sent")
    return value
