"""Profiles that people write: packaged ones by name, their own as TOML files, checked once."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Self, TypeVar

from pydantic import BaseModel, ConfigDict

from sparsor.core.tomlmodel import model_of_file, model_of_mapping, model_of_toml
from sparsor.errors import VehicleError

if TYPE_CHECKING:
    from collections.abc import Mapping


class Profile(BaseModel):
    """What every profile shares: its values are as TOML gives them, and none is unknown."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    @classmethod
    def from_mapping(cls, values: Mapping[str, object], source: str) -> Self:
        """Check the values of a profile.

        Parameters
        ----------
        values : mapping
            As TOML gives them.
        source : str
            Named in the errors.

        Raises
        ------
        VehicleError
            When a key is unknown or missing or a value is not allowed; names the first of them.
        """
        return model_of_mapping(cls, values, source, VehicleError)


P = TypeVar("P", bound=Profile)


def packaged_names(folder: str) -> list[str]:
    """Return the names of the profiles in a folder of this package, sorted."""
    entries = (resources.files("sparsor.vehicle") / folder).iterdir()
    return sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml"))


def load_profile(kind: type[P], what: str, folder: str, name_or_path: str | Path) -> P:
    """Return a packaged profile by name, or the one that a .toml file describes.

    Parameters
    ----------
    kind : type
    what : str
        What it is a profile of, for the errors: "vehicle".
    folder : str
        Of this package, where the packaged ones are.
    name_or_path : str or Path

    Raises
    ------
    VehicleError
        When the name is unknown, the file cannot be read, or a value in it is not allowed.
    """
    text, known = str(name_or_path), packaged_names(folder)
    if text.lower().endswith(".toml"):
        return model_of_file(kind, Path(text), f"{what} profile", VehicleError)
    if text in known:
        packaged = resources.files("sparsor.vehicle") / folder / f"{text}.toml"
        return model_of_toml(kind, packaged.read_bytes(), f"the packaged profile '{text}'", VehicleError)
    raise VehicleError(f"unknown {what} '{text}'; known are {', '.join(known)}, or give the path of a .toml file")
