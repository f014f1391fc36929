"""Finished pieces of a study, kept on disk: an interrupted study goes on where it was.

A piece is named by everything that decides it: field, settings, the versions of what computes it and of this program's
own source. So no piece is ever taken for another, and a piece that is there need not be made again.
"""

from __future__ import annotations

import hashlib
import io
import json
from contextlib import suppress
from functools import cache
from importlib import metadata, resources
from platform import python_version
from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.core.files import write_file

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from sparsor.prior.field import Field

_LIBRARIES = ("sparsor", "numpy", "scipy", "numba", "scikit-learn")
_STAGES = ("core", "prior", "design", "study")


class Store:
    """Pieces in a folder, one JSON file each.

    Parameters
    ----------
    folder : Path
        Made when the first piece is kept.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def get(self, key: Mapping[str, object]) -> Any | None:  # noqa: ANN401 # whatever JSON holds
        """Return a piece, or None where it is missing or damaged."""
        try:
            kept = json.loads(self._path(key).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return kept.get("piece") if isinstance(kept, dict) else None

    def put(self, key: Mapping[str, object], piece: object) -> Any:  # noqa: ANN401
        """Keep a piece and return it as it will be read again."""
        content = json.dumps({"key": _plain(key), "piece": piece}, default=_plain)
        write_file(self._path(key), content.encode())
        return json.loads(content)["piece"]

    def array(self, key: Mapping[str, object], made: Callable[[], NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return a kept array, or make and keep it."""
        path = self._path(key).with_suffix(".npy")
        with suppress(OSError, ValueError):
            return np.asarray(np.load(path, allow_pickle=False))
        stream = io.BytesIO()
        np.save(stream, array := made(), allow_pickle=False)
        write_file(path, stream.getvalue())
        return array

    def _path(self, key: Mapping[str, object]) -> Path:
        text = json.dumps(_plain({**key, "code": code_hash(), "versions": versions()}), sort_keys=True)
        return self.folder / f"{hashlib.sha256(text.encode()).hexdigest()[:24]}.json"


def field_hash(field: Field) -> str:
    """Return the SHA-256 of a field's values, places and unit, 16 hexadecimal digits."""
    digest = hashlib.sha256(field.unit.encode())
    for array in (field.in_memory, field.lon_deg, field.lat_deg):
        digest.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return digest.hexdigest()[:16]


@cache
def versions() -> dict[str, str]:
    """Return the versions of Python and of the libraries that decide the digits."""
    return {"python": python_version(), **{name: metadata.version(name) for name in _LIBRARIES}}


@cache
def code_hash() -> str:
    """Return the SHA-256 of the source of the stages that compute, 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for stage in _STAGES:
        with resources.as_file(resources.files("sparsor") / stage) as folder:
            for path in sorted(folder.rglob("*.py")):
                digest.update(path.relative_to(folder).as_posix().encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _plain(value: object) -> Any:  # noqa: ANN401
    """Return a value as JSON has it."""
    if isinstance(value, dict):
        return {str(name): _plain(one) for name, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value.item() if isinstance(value, np.generic) else value
