"""A recorded file as a source of lines."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from sparsor.errors import InputError
from sparsor.link.sensing.lines import Line, nothing_for
from sparsor.link.sensing.readings import Reading, read_line

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from sparsor.link.sensing.readings import LineFormat


class ReplayedFile:
    """A recorded file, sent with the spacing it was recorded with.

    The times of the samples keep that spacing whatever the speed, as an autopilot's clock does that runs faster
    than the wall's.

    Parameters
    ----------
    path : Path
    form : LineFormat
    speed : float
        Recorded seconds a second.
    rate_hz : float, optional
        Lines a second, for a file without times.

    Raises
    ------
    InputError
        When the file cannot be read, has neither times nor a rate, or the speed is no speed.
    """

    live, waits = False, True

    def __init__(self, path: Path, form: LineFormat, *, speed: float = 1.0, rate_hz: float | None = None) -> None:
        try:
            text = path.read_text(encoding="utf-8-sig")
        except (OSError, UnicodeError) as error:
            raise InputError(f"cannot read '{path}': {getattr(error, 'strerror', None) or error}") from error
        if not (form.has_time or rate_hz):
            raise InputError(
                f"'{path}' is sent as it was recorded: say which column is the time, or how many lines a second"
            )
        if not 0 < speed < float("inf"):
            raise InputError(f"a replay speed of {speed:g}; it has to be above 0")
        self._speed = speed
        self._rows = [(line, read_line(form, line)) for line in text.splitlines() if line.strip()]
        self._interval_s = None if form.has_time else 1 / (rate_hz or 1)
        if not any(reading and reading.values for _, reading in self._rows):
            first = next((f"'{line}' ({reading.faults[0]})" for line, reading in self._rows if reading), "it is empty")
            raise InputError(f"no value was found in '{path}': {first}")

    def lines(self) -> Iterator[Line | None]:
        """Yield the file's lines when they are due."""
        begun_s = time.monotonic()
        for text, reading, at_s in self._timed():
            yield from nothing_for(begun_s + at_s / self._speed - time.monotonic())
            yield Line(text, reading, begun_s + at_s)

    def _timed(self) -> Iterator[tuple[str, Reading, float]]:
        """Yield lines, what they say, and their times after the first, which never decrease."""
        rows = ((text, reading) for text, reading in self._rows if reading is not None)
        first_s: float | None = None
        at_s = 0.0
        for count, (text, reading) in enumerate(rows):
            own_s = reading.time_s if self._interval_s is None else count * self._interval_s
            if own_s is None:  # the line could not be read
                yield text, reading, at_s
                continue
            first_s = own_s if first_s is None else first_s
            if own_s - first_s < at_s:
                yield text, Reading((), ("its time lies before that of a line above",)), at_s
                continue
            at_s = own_s - first_s
            yield text, reading, at_s
