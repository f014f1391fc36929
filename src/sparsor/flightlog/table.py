"""A table of samples (CSV): time, longitude, latitude, altitude and one or more values."""

from __future__ import annotations

import codecs
import csv
import math
import re
from array import array
from datetime import UTC, datetime
from itertools import chain
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.errors import LogError
from sparsor.flightlog.log import AUTOPILOT, Damage, NamedValues, Places, Sender
from sparsor.flightlog.recording import Fixes, Recording, Ticks, UnixTimes

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

MESSAGE: Final = "CSV"
ONLY_VALUE: Final = "value"
"""The name of a column that does not say which sensor it is of."""
_NAMES: Final = {
    "time": "time t timestamp datetime date_time utc unix unix_time epoch seconds sec time_boot time_unix gps_time",
    "lon": "lon lng long longitude",
    "lat": "lat latitude",
    "alt": "alt altitude alt_amsl altitude_amsl amsl elevation alt_msl",
    "height": "height rel_alt relative_alt relative_altitude height_above_home agl",
}
_MEANINGS: Final = {name: meaning for meaning, names in _NAMES.items() for name in names.split()}
_UNITS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "usec": 1e-6, "ns": 1e-9, "m": 1.0, "deg": 1.0}
_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NOT_VALUES: Final = frozenset(("clock", "used"))  # of our own samples
_LONGEST_LINE: Final = 1 << 22
_VALID_UNIX_S = 946_684_800.0
_SYSTEM = 1
_NEEDED = "columns for time, longitude, latitude and a value, such as time_s, lon_deg, lat_deg, alt_m, value"


def is_table(head: bytes) -> bool:
    """Return whether a file's first bytes are text in columns."""
    text = head.decode("utf-8-sig", "replace")
    lines = text.splitlines()
    return (
        bool(lines) and "\x00" not in text and text.count("\ufffd") <= 2 and re.search(r"[,;\t]", lines[0]) is not None
    )


def read_table(blocks: Iterable[bytes]) -> Recording:
    """Return what a table holds.

    Rows without a place or a time are left out; a value that is missing leaves out only itself.

    Parameters
    ----------
    blocks : iterable of bytes
        Text with a header line, in pieces of any size; columns parted by commas, semicolons or tabs.

    Raises
    ------
    LogError
        When a column that is needed is missing, or no row has a time, a place and a value.
    """
    rows = _rows(blocks)
    header = next(rows, [])
    meanings = _meanings(header)
    missing = [what for what in ("time", "lon", "lat") if what not in meanings]
    names = [(place, name) for place, name in enumerate(header) if _is_value(place, name, meanings)]
    if missing or not names:
        raise LogError(f"its columns are {', '.join(header) or 'none'}; give {_NEEDED}")
    numbers, dates_s = _columns(rows, [*meanings.values(), *(place for place, _ in names)], meanings["time"])
    time_s = _seconds(numbers[meanings["time"]], dates_s, header[meanings["time"]])
    good = np.isfinite(time_s) & np.isfinite(numbers[meanings["lon"]]) & np.isfinite(numbers[meanings["lat"]])
    if not good.any():
        raise LogError(
            f"none of its {good.size} rows has a time and a place that can be read; give times in seconds or as "
            "2024-05-01T12:00:00Z, longitudes and latitudes in degrees"
        )
    if not any(np.isfinite(numbers[place][good]).any() for place, _ in names):
        columns = ", ".join(name for _, name in names)
        raise LogError(f"no number stands under {columns} where there is a time and a place; give {_NEEDED}")
    return _recorded(time_s, meanings, numbers, names, good)


def _recorded(
    time_s: NDArray[np.float64],
    meanings: dict[str, int],
    numbers: dict[int, NDArray[np.float64]],
    names: list[tuple[int, str]],
    good: NDArray[np.bool_],
) -> Recording:
    unknown = np.full(time_s.size, np.nan)
    alt_m, height_m = (numbers[meanings[what]] if what in meanings else unknown for what in ("alt", "height"))
    places = Places(numbers[meanings["lon"]], numbers[meanings["lat"]], alt_m, height_m).take(good)
    order = np.flatnonzero(good).astype(np.int64)
    time_s, received_s = time_s[good], unknown[good]
    recording = Recording("CSV", damage=Damage(places=int((~good).sum())))
    if time_s.size and time_s[0] > _VALID_UNIX_S:
        start_s = math.floor(time_s[0])
        recording.unix[_SYSTEM] = UnixTimes(order, np.full(order.size, float(start_s)))
        time_s = time_s - start_s
    recording.ticks[_SYSTEM] = Ticks(order, received_s, time_s)
    everywhere = np.ones(order.size, dtype=np.bool_)
    recording.fixes[_SYSTEM, MESSAGE] = Fixes(order, received_s, time_s, places, everywhere)
    sender = Sender(_SYSTEM, AUTOPILOT)
    for place, name in names:
        value = numbers[place][good]
        series = NamedValues(sender, MESSAGE, name, order, received_s, time_s, value, places)
        if np.isfinite(value).any():
            recording.values.append(series.take(np.isfinite(value)))
    recording.heard = {sender: order.size}
    return recording


def _lines(blocks: Iterable[bytes]) -> Iterator[str]:
    decoder = codecs.getincrementaldecoder("utf-8-sig")("replace")
    rest = ""
    for block in (*blocks, b""):
        *lines, rest = (rest + decoder.decode(block, final=not block).replace("\x00", "")).split("\n")
        yield from (f"{line}\n" for line in lines)
        if len(rest) > _LONGEST_LINE:
            raise LogError(f"it is not a table (a line has more than {_LONGEST_LINE} characters); give {_NEEDED}")
    yield rest


def _rows(blocks: Iterable[bytes]) -> Iterator[list[str]]:
    """Yield the rows that are not empty, the header first; one that cannot be parsed has no cells.

    Only the header may go on in the next line between quotation marks: elsewhere one that damage made would take the
    rows behind it.
    """
    lines = _lines(blocks)
    first = next(lines)
    delimiter = max(";\t,", key=first.count)
    try:
        header = next((row for row in csv.reader(chain([first], lines), delimiter=delimiter) if row), [])
    except csv.Error as error:
        raise LogError(f"it is not a table ({error}); give {_NEEDED}") from error
    yield [cell.strip() for cell in header]
    for line in lines:
        text = line.strip("\r\n").replace("\r", " ")
        if not text:
            continue
        try:
            (row,) = csv.reader([text], delimiter=delimiter)
        except csv.Error:
            row = []
        yield [(cell if delimiter == "," else cell.replace(",", ".")).strip(" \t") for cell in row]


def _columns(
    rows: Iterable[list[str]], wanted: list[int], time: int
) -> tuple[dict[int, NDArray[np.float64]], NDArray[np.float64]]:
    """Return some columns as numbers, and the times as dates if there is no number among them."""
    numbers = {place: array("d") for place in wanted}
    dates_s = array("d")
    no_number = True
    for row in rows:
        for place, column in numbers.items():
            column.append(_number(row[place]) if place < len(row) else math.nan)
        no_number = no_number and math.isnan(numbers[time][-1])
        if no_number:
            dates_s.append(_date_s(row[time]) if time < len(row) else math.nan)
    return {place: np.array(column) for place, column in numbers.items()}, np.array(dates_s)


def _plain(name: str) -> tuple[str, str]:
    """Return a column's name without its unit, and the unit."""
    words = [word for word in re.split(r"[^a-z0-9]+", name.lower()) if word]
    unit = words[-1] if len(words) > 1 and words[-1] in _UNITS else ""
    return "_".join(words[:-1] if unit else words), unit


def _meanings(header: list[str]) -> dict[str, int]:
    found: dict[str, int] = {}
    for place, name in enumerate(header):
        meaning = _MEANINGS.get(_plain(name)[0])
        if meaning is not None:
            found.setdefault(meaning, place)
    return found


def _is_value(place: int, name: str, meanings: dict[str, int]) -> bool:
    plain = _plain(name)[0]
    return place not in meanings.values() and plain not in _NOT_VALUES and plain not in _MEANINGS and bool(plain)


def _number(cell: str) -> float:
    if _NUMBER.fullmatch(cell) is None:  # `float` takes underscores, other scripts' digits and separators too
        return math.nan
    value = float(cell)
    return value if math.isfinite(value) else math.nan


def _seconds(times: NDArray[np.float64], dates_s: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """Return the times in seconds: by the unit in the name, else dates, else by their size."""
    unit = _plain(name)[1]
    if unit:
        return times * _UNITS[unit]
    if not np.isfinite(times).any():
        return dates_s
    typical = float(np.nanmedian(times))
    for limit, scale in ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3)):  # unix time in ns, us, ms
        if typical > limit:
            return times * scale
    return times


def _date_s(cell: str) -> float:
    try:
        date = datetime.fromisoformat(cell)
    except ValueError:
        return math.nan
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()
