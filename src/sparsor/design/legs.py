"""What a leg between two cells costs, and which cells it crosses.

The design never sees a longitude: it gets this table. A leg is a straight line in the grid, as autopilots fly
it between two waypoints.
"""

from __future__ import annotations

from dataclasses import dataclass
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
    """

    shape: tuple[int, int]
    length: NDArray[np.float64]
    seconds: NDArray[np.float64]
    cell_unit: float
    allowed: NDArray[np.bool_]

    @property
    def size(self) -> int:
        """Number of cells."""
        return self.shape[0] * self.shape[1]

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
