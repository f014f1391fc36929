"""What a leg between two cells costs, and which cells it crosses.

The design never sees a longitude: it gets this table. A leg is a straight line in the grid, as autopilots fly
it between two waypoints.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


@dataclass(frozen=True)
class LegTable:
    """Costs of the legs between all pairs of cells.

    Parameters
    ----------
    shape : tuple of int
        Rows and columns of the grid.
    length : array of float64 (N, N)
        Length of each leg, symmetric; metres for missions, cell widths in the study.
    seconds : array of float64 (N, N)
        Time of flight of each leg.
    cell_unit : float
        What one cell unit is in the unit of `length`: the mean step of full coverage, so that a path of
        ``N - 1`` cell units is as long as full coverage. 1 where lengths are cell widths.
    allowed : array of bool (N,)
        Cells that may be visited.
    longest : float
        No path of legs that stay inside is longer.
    """

    shape: tuple[int, int]
    length: NDArray[np.float64]
    seconds: NDArray[np.float64]
    cell_unit: float
    allowed: NDArray[np.bool_]
    longest: float = np.inf

    @property
    def size(self) -> int:
        """Number of cells."""
        return self.shape[0] * self.shape[1]

    @property
    def passable(self) -> NDArray[np.bool_]:
        """Whether each leg stays on cells that may be flown, (N, N)."""
        rows, columns = self.shape
        open_cells = self.allowed.reshape(self.shape)
        table = np.ones((rows, columns, rows, columns), dtype=np.bool_)
        if not open_cells.all():
            for down in range(rows):
                for across in range(-columns + 1, columns):
                    _mark_offset(table, open_cells, down, across)
        return table.reshape(self.size, self.size)

    def kept_inside(self, barred: NDArray[np.bool_] | None = None) -> LegTable:
        """Return the table with every leg that may not be flown longer than any path of the others.

        Parameters
        ----------
        barred : array of bool (N, N), optional
            Legs that may not be flown beside those that leave the allowed cells, symmetric.
        """
        closed = ~self.passable if barred is None else ~self.passable | barred
        if not closed.any():
            return self
        longest = self.size * float(self.length.max())
        return replace(
            self,
            length=np.where(closed, 2 * longest, self.length),
            seconds=np.where(closed, 2 * self.size * self.seconds.max(), self.seconds),
            longest=longest,
        )

    def step(self, table: NDArray[np.float64]) -> float:
        """Return what a step of one cell costs by `length` or `seconds`: the side of a square as large as a cell."""
        # Legs out of the area cost more than all others: the least is that of a step inside.
        across, down = np.diagonal(table, 1).min(), np.diagonal(table, self.shape[1]).min()
        return float(np.sqrt(across * down))

    def leaves(self, stops: NDArray[np.int64]) -> bool:
        """Return whether a path over `stops` leaves the allowed cells; known after `kept_inside`."""
        return self.path_length(stops) > self.longest

    def path_length(self, stops: NDArray[np.int64]) -> float:
        """Return the length of the open path over `stops` in order, in the unit of `length`."""
        return float(self.length[stops[:-1], stops[1:]].sum())

    def path_seconds(self, stops: NDArray[np.int64]) -> float:
        """Return the time of flight along the open path over `stops`, without stopping."""
        return float(self.seconds[stops[:-1], stops[1:]].sum())

    def crossed(self, start: int, end: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the cells a leg passes over, in order, and the seconds spent in each.

        The first and last are the cells it starts and ends in.
        """
        columns = self.shape[1]
        row, column = divmod(start, columns)
        end_row, end_column = divmod(end, columns)
        rows_off, columns_off, share = _crossing(abs(end_row - row), abs(end_column - column))
        rows = row + (rows_off if end_row >= row else -rows_off)
        cells = rows * columns + column + (columns_off if end_column >= column else -columns_off)
        return cells, share * self.seconds[start, end]

    def cells_under(self, stops: Sequence[int] | NDArray[np.int64]) -> NDArray[np.int64]:
        """Return every cell that the path over `stops` passes over, ascending."""
        parts = [self.crossed(int(a), int(b))[0] for a, b in pairwise(stops)]
        return np.unique(np.concatenate([np.asarray(stops, dtype=np.int64), *parts]))


def unit_legs(shape: tuple[int, int] = (32, 32)) -> LegTable:
    """Return the table in cell units: Euclidean lengths on the grid, one cell a second, all cells allowed.

    Examples
    --------
    >>> legs = unit_legs((4, 4))
    >>> float(legs.length[0, 5])  # one step along the diagonal
    1.4142135623730951
    >>> cells, seconds = legs.crossed(0, 6)
    >>> cells.tolist(), seconds.round(3).tolist()
    ([0, 1, 5, 6], [0.559, 0.559, 0.559, 0.559])
    """
    row, column = np.divmod(np.arange(shape[0] * shape[1]), shape[1])
    length = np.hypot(row[:, None] - row, column[:, None] - column)
    return LegTable(shape, length, length, 1.0, np.ones(row.size, dtype=np.bool_))


def _mark_offset(table: NDArray[np.bool_], open_cells: NDArray[np.bool_], down: int, across: int) -> None:
    """Mark all legs of one offset, and the ways back, at once: they cross cells in the same pattern."""
    rows, columns = open_cells.shape
    first = max(0, -across)
    height, width = rows - down, columns - abs(across)
    clear = np.ones((height, width), dtype=np.bool_)
    rows_off, columns_off, _ = _crossing(down, abs(across))
    for row, column in zip(rows_off.tolist(), (columns_off * np.sign(across)).tolist(), strict=True):
        clear &= open_cells[row : row + height, first + column : first + column + width]
    row, column = np.indices((height, width))
    start, end = (row, column + first), (row + down, column + first + across)
    table[*start, *end] = clear
    table[*end, *start] = clear


@cache
def _crossing(rows: int, columns: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return row and column offsets of the cells under a leg, and each one's share of its length."""
    edges = [(np.arange(count) + 0.5) / count for count in (rows, columns) if count]
    # Rounding keeps a corner, where a row and a column edge meet, from becoming a sliver.
    along = np.unique(np.round(np.concatenate([[0.0], *edges, [1.0]]), 12))
    middle = (along[:-1] + along[1:]) / 2
    return (
        np.floor(middle * rows + 0.5).astype(np.int64),
        np.floor(middle * columns + 0.5).astype(np.int64),
        np.diff(along),
    )


def crossing_table(
    shape: tuple[int, int],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return the cells under the legs of every offset, one offset after the other, as compiled code needs them.

    Returns
    -------
    first : array of int64 (N + 1,)
        Where the cells of ``down`` rows and ``across`` columns begin: at ``first[down * columns + across]``.
    rows_off, columns_off : array of int64
    share : array of float64
        Of the leg's length in each cell.
    """
    parts = [_crossing(*divmod(offset, shape[1])) for offset in range(shape[0] * shape[1])]
    first = np.concatenate([[0], np.cumsum([part[2].size for part in parts])])
    rows_off, columns_off, share = (np.concatenate(column) for column in zip(*parts, strict=True))
    return first, rows_off, columns_off, share
