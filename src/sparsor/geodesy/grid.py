"""The grid of cells over a bounding box, and the lengths between its cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import BoxError
from sparsor.geodesy.lengths import distance_m, path_length_m

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from sparsor.geodesy.box import BoundingBox


@dataclass(frozen=True)
class Grid:
    """Cells over a box, regular in degrees.

    Cell ``i = row * columns + column``; row 0 is the northmost, column 0 the westmost (method.md, Notation).

    Parameters
    ----------
    box : BoundingBox
        What the grid covers.
    shape : tuple of int
        Rows and columns, each 2 to 256.

    Raises
    ------
    BoxError
        When the shape is outside that range.

    Examples
    --------
    >>> from sparsor.geodesy import BoundingBox
    >>> grid = Grid(BoundingBox(51.0, 25.0, 51.32, 25.32))
    >>> lon, lat = grid.centres_deg(0)
    >>> round(float(lon), 9), round(float(lat), 9)  # half a cell inside the north-west corner
    (51.005, 25.315)
    >>> int(grid.cell_at(lon, lat))
    0
    """

    box: BoundingBox
    shape: tuple[int, int] = (32, 32)

    def __post_init__(self) -> None:
        if not all(2 <= side <= 256 for side in self.shape):
            raise BoxError(f"a grid of {self.shape[0]} x {self.shape[1]} cells: each side has to be 2..256")

    @property
    def size(self) -> int:
        """Number of cells."""
        return self.shape[0] * self.shape[1]

    def centres_deg(self, cells: ArrayLike | None = None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return longitudes and latitudes of cell centres, degrees, in the shape of `cells` (all: (N,)).

        Longitudes are in -180..180, also across the antimeridian.
        """
        index = np.arange(self.size) if cells is None else np.asarray(cells)
        row, column = np.divmod(index, self.shape[1])
        lon = self.box.west_deg + (column + 0.5) * (self.box.width_deg / self.shape[1])
        lat = self.box.north_deg - (row + 0.5) * (self.box.height_deg / self.shape[0])
        return np.where(lon > 180.0, lon - 360.0, lon), lat

    def position_of(self, lon_deg: ArrayLike, lat_deg: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return fractional row and column of points; cell centres lie at whole numbers.

        A point west of the box has a column below -0.5, one east of it a column above ``columns - 0.5``.
        """
        lon = np.asarray(lon_deg, dtype=np.float64)
        lat = np.asarray(lat_deg, dtype=np.float64)
        # Measured from the middle meridian, so that points just outside either side stay just outside.
        middle = self.box.west_deg + self.box.width_deg / 2
        east_of_middle = (lon - middle + 180.0) % 360.0 - 180.0
        column = (east_of_middle / self.box.width_deg + 0.5) * self.shape[1] - 0.5
        row = (self.box.north_deg - lat) / self.box.height_deg * self.shape[0] - 0.5
        return row, column

    def cell_at(self, lon_deg: ArrayLike, lat_deg: ArrayLike) -> NDArray[np.int64]:
        """Return the cell that holds each point, -1 for points outside the box."""
        row, column = self.position_of(lon_deg, lat_deg)
        whole_row = np.clip(np.floor(row + 0.5), 0, self.shape[0] - 1)
        whole_column = np.clip(np.floor(column + 0.5), 0, self.shape[1] - 1)
        edge = 1e-9  # points on the outer edge belong to the cell inside it
        inside = (np.abs(row - whole_row) <= 0.5 + edge) & (np.abs(column - whole_column) <= 0.5 + edge)
        cell = (whole_row * self.shape[1] + whole_column).astype(np.int64)
        return np.where(inside, cell, -1)

    def lengths_m(self) -> NDArray[np.float64]:
        """Return geodesic lengths between all cell centres, metres, (N, N).

        A length depends on the two rows and the number of columns between, so only that many are computed.
        """
        rows, columns = self.shape
        lat = self.box.north_deg - (np.arange(rows) + 0.5) * (self.box.height_deg / rows)
        apart = np.arange(columns) * (self.box.width_deg / columns)
        table = distance_m(0.0, lat[:, None, None], apart, lat[None, :, None])
        table = (table + table.transpose(1, 0, 2)) / 2  # the same to the last digit in both directions
        row, column = np.divmod(np.arange(self.size), columns)
        apart_columns = np.abs(column[:, None] - column[None, :])
        lengths: NDArray[np.float64] = table[row[:, None], row[None, :], apart_columns]
        return lengths

    def boustrophedon(self, allowed: NDArray[np.bool_] | None = None) -> NDArray[np.int64]:
        """Return the cells of full coverage in flight order: to and fro along the shorter side.

        Parameters
        ----------
        allowed : array of bool (N,), optional
            Cells that may be flown; all of them by default.
        """
        cells = np.arange(self.size).reshape(self.shape)
        if self.box.north_m < self.box.east_m * (1 - 1e-9):
            cells = cells.T
        cells = cells.copy()
        cells[1::2] = cells[1::2, ::-1]
        order = cells.ravel()
        return order if allowed is None else order[allowed[order]]

    def full_coverage_m(self, allowed: NDArray[np.bool_] | None = None) -> float:
        """Return the geodesic length of the boustrophedon over the allowed cells, metres."""
        return path_length_m(*self.centres_deg(self.boustrophedon(allowed)))
