"""Fields of many files and time steps, read one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.core.progress import Progress, silent
from sparsor.errors import EmptyFieldError
from sparsor.prior.learning import TrainingMaps, maps_of_fields
from sparsor.prior.netcdf import time_steps
from sparsor.prior.reading import is_netcdf, read_field
from sparsor.prior.windows import MapSet, ground_windows

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from sparsor.prior.field import Field

ALL = "all"


@dataclass(frozen=True)
class FieldFile:
    """A file and how to read it.

    Parameters
    ----------
    path : Path
    variable, time, box, colormap, value_range
        As `sparsor.prior.reading.read_field` takes them; the time "all" stands for every time step of a NetCDF file.
    """

    path: Path
    variable: str | None = None
    time: str | None = None
    box: tuple[float, float, float, float] | None = None
    colormap: str | None = None
    value_range: tuple[float, float] | None = None

    def steps(self) -> Sequence[str | int | None]:
        """Return the time steps to read, one by one."""
        if self.time != ALL or not is_netcdf(self.path):
            return (self.time,)
        count = time_steps(self.path, self.variable)
        return (None,) if count is None else range(count)

    def read(self, step: str | int | None) -> Field:
        """Return the field of one step; a large one stays on file."""
        return read_field(
            self.path,
            variable=self.variable,
            time=step,
            box=self.box,
            colormap=self.colormap,
            value_range=self.value_range,
            lazily=True,
        )

    def first(self) -> Field:
        """Return the field of the first step that has values: the others lie on the same pixels.

        Raises
        ------
        FieldError
            When there is none, or it cannot be read.
        """
        steps = self.steps()
        for step in steps[:-1]:
            try:
                return self.read(step)
            except EmptyFieldError:
                continue
        return self.read(steps[-1])

    def source(self, field: Field) -> str:
        """Return where a field of the file comes from, for all of its steps."""
        count = len(self.steps())
        return field.source if count == 1 else f"{field.source.rpartition(', ')[0]}, {count} time steps"


@dataclass
class Cut:
    """How the cutting of windows went.

    Parameters
    ----------
    maps, dropped, filled : int
        Windows cut, left out for their gaps, kept with gaps filled.
    empty : int
        Time steps left out because there is no window without large gaps.
    """

    maps: int = 0
    dropped: int = 0
    filled: int = 0
    empty: int = 0

    @property
    def words(self) -> tuple[str, ...]:
        """What has to be said of it."""
        if not self.empty:
            return ()
        return (f"{self.empty} time steps were left out: too many gaps in all of their windows.",)

    def add(self, windows: MapSet) -> None:
        """Count the windows of one field."""
        self.maps += len(windows.maps)
        self.dropped += windows.dropped
        self.filled += windows.filled


def maps_of_files(
    files: Sequence[FieldFile], window_m: tuple[float, float], shape: tuple[int, int], progress: Progress = silent
) -> tuple[TrainingMaps, Cut]:
    """Return the maps of all steps of all files; no more than one field is held at a time.

    Raises
    ------
    FieldError, ModelError
        When a field cannot be read, fields do not go together, or there is nothing to learn from.
    """
    cut = Cut()
    steps = [(file, step) for file in files for step in file.steps()]

    def each() -> Iterator[tuple[Field, MapSet]]:
        for done, (file, step) in enumerate(steps, start=1):
            try:
                field = file.read(step)
                windows = ground_windows(field, *window_m, shape)
            except EmptyFieldError:
                if file.time != ALL or (done == len(steps) and not cut.maps):
                    raise
                cut.empty += 1
                continue
            cut.add(windows)
            progress("cutting windows", done, len(steps))
            yield field, windows

    return maps_of_fields(each(), shape, progress, len(steps)), cut
