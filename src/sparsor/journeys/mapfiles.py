"""The files of a map: which are asked for, whether they may be written, writing all of them or none."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sparsor.core.files import write_files
from sparsor.errors import InputError
from sparsor.journeys.mapsummary import map_rows

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from sparsor.journeys.flown import FlownMission
    from sparsor.journeys.reconstructing import Reconstruction
    from sparsor.plot import MapPicture

SUFFIXES: Final = (".tif", ".nc", ".png", ".html", ".csv")
_SAME = {".tiff": ".tif", ".htm": ".html"}


def map_files(asked: Sequence[Path], mission: FlownMission, inputs: Sequence[Path], *, force: bool) -> tuple[Path, ...]:
    """Return the files that a map is written to: those asked for, else one of each kind beside the mission.

    Parameters
    ----------
    asked : sequence of Path
        Their suffixes say what goes into them.
    mission : FlownMission
    inputs : sequence of Path
        What is read; never written over.
    force : bool
        Whether files that are there are replaced.

    Raises
    ------
    InputError
        When a suffix is unknown, or a file is there or is read.
    """
    paths = tuple(asked) or tuple(mission.folder / f"{mission.name}{suffix}" for suffix in SUFFIXES)
    read = {path.resolve() for path in (*inputs, *mission.files)}
    for path in paths:
        if kind_of(path) not in SUFFIXES:
            raise InputError(f"'{path}': the end of the name says what goes into a file; give {', '.join(SUFFIXES)}")
        if path.resolve() in read:
            raise InputError(f"'{path}' is read for this map and would be written over: choose another file with -o")
    there = [str(path) for path in paths if path.exists()]
    if there and not force:
        raise InputError(f"{', '.join(there)}: there already; replace with --force, or choose other files with -o")
    return paths


def kind_of(path: Path) -> str:
    """Return the suffix that says what goes into a file.

    Examples
    --------
    >>> kind_of(Path("maps/doha.TIFF"))
    '.tif'
    """
    suffix = path.suffix.lower()
    return _SAME.get(suffix, suffix)


def write_map(made: Reconstruction, paths: Sequence[Path]) -> None:
    """Write the files of a map, all of them or none.

    Raises
    ------
    OutputError
        When one of them cannot be written.
    """
    files = _Files(made)
    home = paths[0].parent if len({path.parent for path in paths}) == 1 else None  # which an error names
    contents = {path.name if home else str(path): files.content(kind_of(path)) for path in paths}
    write_files(home or Path(), contents)


class _Files:
    """What goes into each kind of file."""

    def __init__(self, made: Reconstruction) -> None:
        self._made = made

    def content(self, kind: str) -> bytes:
        makers: dict[str, Callable[[], bytes]] = {
            ".tif": self._tif,
            ".nc": self._nc,
            ".png": self._png,
            ".html": self._html,
            ".csv": self._csv,
        }
        return makers[kind]()

    @cached_property
    def _picture(self) -> MapPicture:
        from sparsor.fieldmap.picture import map_picture

        made = self._made
        used = int(made.measured.used.sum())
        caption = (
            f"{used} samples in {made.measured.cells.size} cells; decoder {made.decoded.decoder}; expected error "
            f"{made.decoded.expected_relative_error:.2f} of the map's contrast (|s - s'| / |s - mean(s)|).",
            f"Readings: {made.readings.words}. Flown {made.field_map.facts['flown']}.",
        )
        return map_picture(made.field_map, made.flown, caption)

    def _tif(self) -> bytes:
        from sparsor.fieldmap.geotiff import map_geotiff

        return map_geotiff(self._made.field_map)

    def _nc(self) -> bytes:
        from sparsor.fieldmap.netcdf import map_netcdf

        return map_netcdf(self._made.field_map)

    def _png(self) -> bytes:
        from sparsor.plot import reconstruction_png

        return reconstruction_png(self._picture)

    def _html(self) -> bytes:
        from sparsor.fieldmap.report import Report, report_html
        from sparsor.plot import map_png, uncertainty_png

        made = self._made
        bare = replace(self._picture, caption=())  # the page says it in letters that a telephone can show
        return report_html(
            Report(
                field_map=made.field_map,
                samples=made.flown,
                map_png=map_png(bare),
                uncertainty_png=uncertainty_png(bare),
                summary=map_rows(made),
                warnings=made.warnings,
            )
        )

    def _csv(self) -> bytes:
        from sparsor.fieldmap.samples_csv import samples_csv

        return samples_csv(self._made.flown)
