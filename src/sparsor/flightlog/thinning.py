"""Rows of a long log that come block by block, without those that their neighbours tell as well.

A flight is held as it is. A log of many gigabytes would not fit: beyond some hundred thousand rows of a kind only those
are kept between which straight lines tell the others within a tolerance (the swing filter of Elmeleegy et al.,
Proceedings of the VLDB Endowment 2, 2009, but with rows of the log as the lines' ends).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.core.compiled import njit

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

WHOLE: Final = 1 << 18
"""So many rows of a kind are held as they are: six hours of a clock that is read twelve times a second."""
APART_S: Final = 4.9
"""Rows that are kept lie no farther apart than this when others lie between them: less than samples are put between."""
CLOCK_S: Final = 0.05
"""How far a clock may run past a reading that is left out."""
PLACE_DEG: Final = 1e-6
"""How far a track may pass a position that is left out, in longitude and in latitude: 0.11 m, as no receiver tells."""
PLACE_M: Final = 0.25
"""The same in altitude."""
_GROWTH = 1.1
Columns = tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class Course:
    """What lines are laid through.

    Parameters
    ----------
    along : array of float64 (n,)
        Along which the lines run: a time.
    across : array of float64 (n, d)
        What they have to meet.
    state : array of int64 (n,)
        No line goes from one state to another.
    """

    along: NDArray[np.float64]
    across: NDArray[np.float64]
    state: NDArray[np.int64]


class Rows:
    """Rows of several arrays side by side, all of them kept."""

    def __init__(self) -> None:
        self._columns: list[np.ndarray] = []  # longer than what is in them
        self._size = 0

    def add(self, *columns: np.ndarray) -> None:
        """Take the next rows, the same columns each time."""
        size = self._size + columns[0].size
        if not self._columns:
            self._columns = [np.array(column) for column in columns]
        elif size > self._columns[0].shape[0]:
            for own in self._columns:  # where they are if the system can: no second copy of gigabytes
                own.resize((int(_GROWTH * size), *own.shape[1:]), refcheck=False)
        for own, new in zip(self._columns, columns, strict=True):
            own[self._size : size] = new
        self._size = size

    def joined(self) -> Columns:
        """Give the columns away, or nothing when no row came."""
        columns, self._columns = self._columns, []
        for own in columns:
            own.resize((self._size, *own.shape[1:]), refcheck=False)
        self._size = 0
        return tuple(columns)


class ChangedRows(Rows):
    """The rows whose last column differs from that of the row before."""

    def add(self, *columns: np.ndarray) -> None:
        """Take the next rows, the same columns each time."""
        key = columns[-1]
        if key.size == 0:
            return
        changed = np.ones(key.size, dtype=np.bool_)
        changed[1:] = key[1:] != key[:-1]
        if self._size:
            changed[0] = self._columns[-1][self._size - 1] != key[0]
        if changed.any():
            super().add(*(column[changed] for column in columns))


class ThinnedRows(Rows):
    """All rows of a short log, and of a long one those that lines between them need.

    Parameters
    ----------
    measure : callable
        Given the columns, returns their course.
    within : tuple of float
        How far a line may pass a row that is left out, in each of the measure's `across`.
    apart : float
        How far rows that are kept may lie apart, unless none lies between them, in the measure's `along`.
    whole : int
        So many rows are kept as they are.
    """

    def __init__(
        self, measure: Callable[..., Course], within: tuple[float, ...], apart: float, whole: int = WHOLE
    ) -> None:
        super().__init__()
        self._measure, self._within, self._apart, self._whole = measure, np.array(within), apart, whole
        self._thinner: _Thinner | None = None

    def add(self, *columns: np.ndarray) -> None:
        """Take the next rows, the same columns each time."""
        if columns[0].size == 0:
            return
        if self._thinner is not None:
            super().add(*self._thinner.kept(columns))
            return
        super().add(*columns)
        if self._size > self._whole:
            self._thinner = _Thinner(self._measure, self._within, self._apart)
            super().add(*self._thinner.kept(super().joined()))

    def joined(self) -> Columns:
        """Give the columns away and, as one more, how many rows each row stands for."""
        if self._thinner is not None:
            super().add(*self._thinner.last())
            return super().joined()
        columns = super().joined()
        return (*columns, np.ones(columns[0].size, dtype=np.int32)) if columns else ()


class _Thinner:
    """Decides on each row when the next ones are known; what it has not decided yet it gives back with those."""

    def __init__(self, measure: Callable[..., Course], within: NDArray[np.float64], apart: float) -> None:
        self._measure, self._within, self._apart = measure, within, apart
        self._open: Columns = ()  # the anchor, and the row that may be the line's end
        self._cone = np.zeros((2, within.size))
        self._since = 0

    def kept(self, columns: Columns) -> Columns:
        """Return the rows that are needed among those that came so far, and what each stands for."""
        known = self._open[0].size if self._open else 0
        if known:
            columns = tuple(np.concatenate(pair) for pair in zip(self._open, columns, strict=True))
        course = self._measure(*columns)
        rows = np.empty(columns[0].size, dtype=np.int64)
        stands = np.empty(columns[0].size, dtype=np.int32)
        count, anchor, end, self._since = _lines(
            course.along,
            course.across,
            course.state,
            known,
            self._within,
            self._apart,
            self._cone,
            self._since,
            rows,
            stands,
        )
        self._open = tuple(column[[anchor] if end == anchor else [anchor, end]] for column in columns)
        return (*(column[rows[:count]] for column in columns), stands[:count])

    def last(self) -> Columns:
        """Return the row that is still open, if any: nothing follows."""
        rows = slice(1, None)
        columns = tuple(column[rows] for column in self._open)
        return (*columns, np.full(columns[0].size, self._since, dtype=np.int32))


@njit(cache=True, nogil=True)
def _lines(
    along: NDArray[np.float64],
    across: NDArray[np.float64],
    state: NDArray[np.int64],
    known: int,
    within: NDArray[np.float64],
    apart: float,
    cone: NDArray[np.float64],
    since: int,
    rows: NDArray[np.int64],
    stands: NDArray[np.int32],
) -> tuple[int, int, int, int]:
    """Fill `rows` with those that are kept; return how many, the anchor, the line's end, and how many lie behind it.

    The first `known` rows are anchor and end of before; an anchor is in `rows` already when it is one. `cone` holds the
    lowest and the highest slope with which a line from the anchor meets everything behind it.
    """
    count = 0
    anchor = 0
    end = known - 1 if known else 0
    if known == 0:
        rows[0], stands[0], count = 0, 1, 1
    size = within.size
    for row in range(max(known, 1), along.size):
        while True:  # at most twice: with the line so far, and with a new one that begins at its end
            length = along[row] - along[anchor]
            meets = 0 < length <= apart and along[row] >= along[end] and state[row] == state[anchor]
            repeats = length == 0 and end == anchor and state[row] == state[anchor]
            part = 1.0 / length if meets else 1.0
            for place in range(size):
                rise = across[row, place] - across[anchor, place]
                slope = rise * part
                if end != anchor and not cone[0, place] <= slope <= cone[1, place]:
                    meets = False
                if not abs(rise) <= within[place]:
                    repeats = False
            if meets or end == anchor:
                break
            rows[count], stands[count] = end, since
            count += 1
            anchor, since = end, 0
        if meets:
            for place in range(size):
                rise = across[row, place] - across[anchor, place]
                low, high = (rise - within[place]) * part, (rise + within[place]) * part
                if end == anchor or low > cone[0, place]:
                    cone[0, place] = low
                if end == anchor or high < cone[1, place]:
                    cone[1, place] = high
            end = row
            since += 1
        elif repeats:
            since += 1
        else:
            rows[count], stands[count] = row, since + 1
            count += 1
            anchor, end, since = row, row, 0
    return count, anchor, end, since
