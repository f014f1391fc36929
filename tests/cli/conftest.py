"""The commands run in this process, in a folder of their own; a small field to learn from."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin
from threadpoolctl import threadpool_limits

from sparsor.cli import main

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

COMMANDS = {
    "sparsor": main.main,
    "generate-mission": main.generate_mission,
    "reconstruct-map": main.reconstruct_map,
}
WEST, NORTH, PIXEL_DEG, SIDE = 51.0, 26.0, 0.01, 88


@dataclass(frozen=True)
class Ran:
    code: int
    out: str
    err: str

    @property
    def result(self) -> dict[str, Any]:
        """The one JSON object on stdout; anything else there is an error."""
        return json.loads(self.out)

    @property
    def said(self) -> str:
        """Stderr on one line, without the frame that typer draws around its own messages."""
        return " ".join(self.err.translate(str.maketrans("", "", "│╭╮╰╯─")).split())


class Console:
    BOX = ("51.50", "25.27", "51.53", "25.30")
    FIELD_BOX = ("51.40", "25.30", "51.75", "25.63")  # about as small as the small field resolves

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self._monkeypatch, self._capsys = monkeypatch, capsys

    def __call__(self, command: str, *words: object) -> Ran:
        self._capsys.readouterr()
        self._monkeypatch.setattr(sys, "argv", [command, *map(str, words)])
        try:
            COMMANDS[command]()
        except SystemExit as end:
            code = end.code
        else:
            raise AssertionError("a console command ends with an exit code")
        assert isinstance(code, int)
        return Ran(code, *self._capsys.readouterr())

    def mission(self, *options: object, box: tuple[str, ...] | None = BOX, iterations: int = 30) -> Ran:
        """Run `generate-mission` over a small box, with few iterations."""
        where = () if box is None else ("--bbox", *box)
        return self("generate-mission", *where, "--iterations", iterations, *options)


@pytest.fixture
def console(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, cache: Path
) -> Console:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SPARSOR_CACHE_DIR", str(cache))
    monkeypatch.setenv("COLUMNS", "240")
    return Console(monkeypatch, capsys)


@pytest.fixture(scope="session", autouse=True)
def one_blas_thread() -> Iterator[None]:
    """Several test processes, each with a thread a core that spins, are slower than one thread each."""
    with threadpool_limits(1):
        yield


@pytest.fixture
def no_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests that do not look at preview.png: drawing takes longer than planning."""
    monkeypatch.setattr("sparsor.journeys.preview.preview_png", lambda _mission: b"no picture")


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where models learned on the way go: never the user's own cache."""
    return tmp_path_factory.mktemp("cache")


def write_geotiff(path: Path, values: Any, **profile: Any) -> Path:
    values = np.asarray(values, dtype=np.float32)
    placed = {"crs": "EPSG:4326", "transform": from_origin(WEST, NORTH, PIXEL_DEG, PIXEL_DEG), **profile}
    height, width = values.shape
    with rasterio.open(path, "w", driver="GTiff", height=height, width=width, count=1, dtype="float32", **placed) as f:
        f.write(values, 1)
    return path


@pytest.fixture(scope="session")
def geotiff() -> Any:
    return write_geotiff


@pytest.fixture(scope="session")
def smooth_field(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A raster of 0.88 x 0.88 degrees: round hills of 10 km on a plain."""
    rng = np.random.default_rng(5)
    row, column = np.mgrid[:SIDE, :SIDE]
    values = np.full((SIDE, SIDE), 5.0)
    for top, left, height in zip(*rng.uniform(-10, SIDE + 10, (2, 40)), rng.uniform(0.5, 2, 40), strict=True):
        values += height * np.exp(-((row - top) ** 2 + (column - left) ** 2) / (2 * 10.0**2))
    return write_geotiff(tmp_path_factory.mktemp("fields") / "smooth.tif", values)


@pytest.fixture
def tree(tmp_path: Path) -> Any:
    """What lies in the test's folder: path to contents (None for a folder)."""

    def look(folder: Path = tmp_path) -> dict[str, bytes | None]:
        return {
            path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else None
            for path in sorted(folder.rglob("*"))
        }

    return look
