"""Strict JSON, and values out of it with errors that name the place."""

from __future__ import annotations

import json
import math
from typing import NoReturn, cast

from sparsor.errors import MissionError


def parse(content: bytes) -> dict[str, object]:
    """Return the object that the content of a file is, in strict JSON.

    Raises
    ------
    MissionError
        When it is not UTF-8, not JSON (NaN is not), cut short, or not an object.
    """
    try:
        value = json.loads(content.decode("utf-8-sig"), parse_constant=_no_constant)
    except UnicodeDecodeError as error:
        raise MissionError("it is not text in UTF-8") from error
    except json.JSONDecodeError as error:
        cut = "it ends too early" if error.pos >= len(error.doc.rstrip()) else "it is not JSON"
        raise MissionError(f"{cut}: {error.msg} at line {error.lineno}, column {error.colno}") from error
    except RecursionError as error:
        raise MissionError("its JSON is nested too deeply") from error
    except ValueError as error:  # a whole number of thousands of digits
        raise MissionError(f"it holds a number that cannot be read: {error}") from error
    return as_mapping(value, "the file")


def as_mapping(value: object, where: str) -> dict[str, object]:
    """Return a value that has to be an object."""
    if not isinstance(value, dict):
        raise MissionError(f"{where} is {_shown(value)}; it has to be an object")
    return cast("dict[str, object]", value)


def mapping(holder: dict[str, object], key: str) -> dict[str, object]:
    """Return the object under a key."""
    if key not in holder:
        raise MissionError(f"'{key}' is missing")
    return as_mapping(holder[key], key)


def sequence(value: object, where: str) -> list[object]:
    """Return a value that has to be a list."""
    if not isinstance(value, list):
        raise MissionError(f"{where} is {_shown(value)}; it has to be a list")
    return value


def number(value: object, where: str) -> float:
    """Return a value that has to be a finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise MissionError(f"{where} is {_shown(value)}; it has to be a number")
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise MissionError(f"{where} is not a finite number")
    return result


def numbers(value: object, where: str, count: int, *, null_allowed: bool = False) -> list[float]:
    """Return a list of `count` numbers; null becomes NaN where it is allowed."""
    entries = sequence(value, where)
    if len(entries) != count:
        raise MissionError(f"{where} has {len(entries)} values; it has to have {count}")
    return [
        math.nan if entry is None and null_allowed else number(entry, f"{where}, value {position}")
        for position, entry in enumerate(entries, start=1)
    ]


def whole(holder: dict[str, object], where: str, default: int | None = None) -> int:
    """Return the whole number under the last part of `where`, 0..65535."""
    key = where.rsplit(".", maxsplit=1)[-1]
    if key not in holder and default is not None:
        return default
    value = number(holder.get(key), where)
    if value != int(value) or not 0 <= value <= 65_535:
        raise MissionError(f"{where} is {value:g}; it has to be a whole number, 0..65535")
    return int(value)


def text(holder: dict[str, object], key: str, where: str) -> str:
    """Return the text under a key."""
    value = holder.get(key)
    if not isinstance(value, str):
        raise MissionError(f"{where}: {key} is {_shown(value)}; it has to be text")
    return value


def _no_constant(name: str) -> NoReturn:
    raise MissionError(f"it holds {name}, which is not JSON; a value that is not given is null")


def _shown(value: object) -> str:
    if value is None:
        return "null or missing"
    return json.dumps(value)[:60]
