"""Values that people write into TOML files, checked by a pydantic model; what is wrong becomes one sentence."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING, TypeVar

from pydantic import BaseModel, ValidationError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from pydantic_core import ErrorDetails

    from sparsor.errors import InputError

Checked = TypeVar("Checked", bound=BaseModel)


def model_of_file(kind: type[Checked], path: Path, what: str, error: type[InputError]) -> Checked:
    """Return what a TOML file says.

    Parameters
    ----------
    kind : type
        The model that its values have to fit.
    path : Path
    what : str
        What the file is, for the errors: "vehicle profile".
    error : type
        What is raised.

    Raises
    ------
    InputError
        Of the type given: when the file cannot be read, is not TOML, or a value in it is not allowed.
    """
    try:
        content = path.read_bytes()
    except OSError as failure:
        raise error(f"cannot read the {what} '{path}': {failure.strerror or failure}") from failure
    return model_of_toml(kind, content, f"the {what} '{path}'", error)


def model_of_toml(kind: type[Checked], content: bytes, source: str, error: type[InputError]) -> Checked:
    """Return what the text of a TOML file says; `source` is named in the errors, see `model_of_file`."""
    try:
        values = tomllib.loads(content.decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as failure:
        raise error(f"{source} is not TOML: {failure}") from failure
    return model_of_mapping(kind, values, source, error)


def model_of_mapping(
    kind: type[Checked], values: Mapping[str, object], source: str, error: type[InputError]
) -> Checked:
    """Return values as TOML gives them, checked; `source` is named in the errors, see `model_of_file`."""
    try:
        return kind.model_validate(dict(values))
    except ValidationError as failure:
        raise error(_sentence(failure.errors()[0], source, list(kind.model_fields))) from failure


def _sentence(error: ErrorDetails, source: str, keys: list[str]) -> str:
    key = ".".join(str(part) for part in error["loc"])
    if error["type"] == "extra_forbidden":
        known = f"; known are {', '.join(keys)}" if len(error["loc"]) == 1 else ""
        return f"{source}: unknown key '{key}'{known}"
    if error["type"] == "missing":
        return f"{source}: the key '{key}' is missing"
    message = error["msg"].removeprefix("Value error, ")
    allowed = message[0].lower() + message[1:]
    if not key:
        return f"{source}: {allowed}"
    return f"{source}: {key} = {error['input']!r} is not allowed: {allowed}"
