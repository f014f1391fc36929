"""What a sensor's line of text says: columns, or a regular expression of the user's."""

from __future__ import annotations

import csv
import re
from typing import TYPE_CHECKING, Final

from sparsor.errors import InputError
from sparsor.link.sensing.readings import checked_names, is_name, reading_of, second_of, time_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.link.sensing.readings import Reading

DELIMITERS: Final = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
TIME_GROUP: Final = "time"
VALUE_GROUP: Final = "value"
NAME_GROUP: Final = "name"


class Columns:
    """Values between delimiters.

    Parameters
    ----------
    values : sequence of str, optional
        `COLUMN` or `NAME=COLUMN`; a column is its number, from 1, or its name in the first line. None: the first
        column, unless the first line names several.
    name : str
        Of a value that is given no other.
    time : str, optional
        The column of the sensor's own time.
    delimiter : str
        One character, or comma, semicolon, tab, space (any white space).
    time_unit : {"s", "ms", "us"}

    Raises
    ------
    InputError
        When a name is not one, two values have the same, a column cannot be meant, or nothing says which is.

    Examples
    --------
    >>> Columns(["NO2=2", "T=3"], time="1").read("12.5,31,28.4")
    Reading(values=(('NO2', 31.0), ('T', 28.4)), faults=(), time_s=12.5)
    """

    def __init__(
        self,
        values: Sequence[str] | None = None,
        *,
        name: str = "NO2",
        time: str | None = None,
        delimiter: str = "comma",
        time_unit: str = "s",
    ) -> None:
        self._chosen = bool(values)
        pairs = [value.rpartition("=") for value in values or ("1",)]
        self._names = checked_names(given if found else name for given, found, _ in pairs)
        self._wanted = [column for *_, column in pairs]
        self._time = time
        self._second = second_of(time_unit)
        if time == "1" and not values:
            raise InputError("column 1 is the time: say which column is the value (--value COLUMN)")
        self._delimiter = DELIMITERS.get(delimiter, delimiter)
        if len(self._delimiter) != 1 or self._delimiter in '"\r\n':
            raise InputError(f"the delimiter '{delimiter}'; give one character, or one of {', '.join(DELIMITERS)}")
        self.has_time = time is not None
        self.needs_header = any(not column.isdigit() for column in [*self._wanted, *([time] if time else [])])
        self._begun = False
        self._places: dict[str, int] = {}
        if not self.needs_header:
            self._find({})

    def read(self, line: str) -> Reading | None:
        """Return what a line says; None for the header; InputError when the header lacks a column."""
        cells = self._cells(line)
        first, self._begun = not self._begun, True
        if first and not self._chosen:
            _refuse_names(cells)
        if first and self.needs_header:
            self._find({cell: place for place, cell in enumerate(cells)})
            return None
        try:
            time_s = None if self._time is None else time_of(self._cell(cells, self._time), self._second)
        except ValueError:
            if first:
                return None
            raise
        texts = [
            (name, _cell_or_none(cells, self._places[column]))
            for name, column in zip(self._names, self._wanted, strict=True)
        ]
        reading = reading_of(texts, time_s)
        return None if first and not reading.values else reading

    def _cells(self, line: str) -> list[str]:
        if self._delimiter == " ":
            return line.split()
        try:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=self._delimiter), [])]
        except csv.Error as error:
            raise ValueError(str(error)) from error

    def _cell(self, cells: Sequence[str], column: str) -> str:
        text = _cell_or_none(cells, self._places[column])
        if text is None:
            raise ValueError(f"it has no column {column}")
        return text

    def _find(self, header: dict[str, int]) -> None:
        for column in [*self._wanted, *([self._time] if self._time else [])]:
            if column.isdigit() and int(column) > 0:
                self._places[column] = int(column) - 1
            elif column in header:
                self._places[column] = header[column]
            else:
                there = f"the first line has {', '.join(header)}" if header else "columns are counted from 1"
                raise InputError(f"there is no column '{column}'; {there}")


class Pattern:
    r"""A regular expression: each named group is a value; `value`, `name` and `time` have their own meaning.

    Parameters
    ----------
    expression : str
        Searched for in every line. Group `value` is called `name`, or what the group `name` holds; the group
        `time` is the sensor's own time; any other named group is a value of that name.
    name : str
    time_unit : {"s", "ms", "us"}

    Raises
    ------
    InputError
        When the expression is none, or names no value.

    Examples
    --------
    >>> Pattern(r"no2=(?P<NO2>\S+) t=(?P<T>\S+)").read("#7 no2=31.5 t=28.4 ok").values
    (('NO2', 31.5), ('T', 28.4))
    """

    def __init__(self, expression: str, *, name: str = "NO2", time_unit: str = "s") -> None:
        try:
            self._expression = re.compile(expression)
        except re.error as error:
            raise InputError(f"the pattern '{expression}' is not a regular expression: {error}") from error
        groups = [group for group in self._expression.groupindex if group not in (TIME_GROUP, NAME_GROUP)]
        if not groups:
            raise InputError(f"the pattern '{expression}' names no value; write (?P<value>[-0-9.]+), or (?P<NO2>...)")
        self._groups = groups
        self._names = checked_names(name if group == VALUE_GROUP else group for group in groups)
        self._named = NAME_GROUP in self._expression.groupindex
        self._second = second_of(time_unit)
        self.has_time, self.needs_header = TIME_GROUP in self._expression.groupindex, False

    def read(self, line: str) -> Reading:
        """Return what a line says; ValueError when the expression is not in it."""
        match = self._expression.search(line)
        if match is None:
            raise ValueError("the pattern is not in it")
        names = list(self._names)
        if self._named and VALUE_GROUP in self._groups:
            name = match[NAME_GROUP] or ""
            if not is_name(name):
                raise ValueError(f"the name '{name}' is not one")
            names[self._groups.index(VALUE_GROUP)] = name
        time_s = time_of(match[TIME_GROUP], self._second) if self.has_time else None
        return reading_of([(name, match[group]) for name, group in zip(names, self._groups, strict=True)], time_s)


def _refuse_names(cells: Sequence[str]) -> None:
    """Refuse a first line that names several columns, when nobody said which of them is the value."""
    if len(cells) > 1 and not any(_is_number(cell) for cell in cells):
        raise InputError(
            f"the first line names {len(cells)} columns: {', '.join(cells)}. Say which are to be sent, e.g. --value "
            f"NO2={cells[-1]}"
        )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _cell_or_none(cells: Sequence[str], place: int) -> str | None:
    return cells[place] if place < len(cells) else None
