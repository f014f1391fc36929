"""Rasters that are read piece by piece: as much is in memory as is looked at, however large the file."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Iterator

TILE = 256  # pixels a side at least
_KEPT_PIXELS = 8_000_000  # of the tiles read last: 64 MB

LAZY_PIXELS = 2_000_000  # what is smaller is as well read at once: 16 MB

Reader = Callable[[slice, slice], NDArray[np.float64]]


@dataclass(frozen=True)
class OnFile:
    """Values as they lie in a file.

    Parameters
    ----------
    shape : tuple of int
        Rows and columns.
    read : callable
        Returns the values at rows and columns given as slices; gaps are NaN.
    block : tuple of int
        Rows and columns that are packed together in the file, and so are best read together.
    """

    shape: tuple[int, int]
    read: Reader
    block: tuple[int, int] = (TILE, TILE)


@dataclass(frozen=True)
class LazyRaster:
    """Values of a raster on file.

    It is cut like an array, ``raster[top:bottom, left:right]``, and gives arrays; tiles that were read last are kept,
    as windows overlap.

    Parameters
    ----------
    read : callable
        Returns the values at rows and columns of the file, given as slices; gaps are NaN.
    rows, columns : array of int64
        Which rows and columns of the file the raster has, in order: files run either way and begin anywhere.
    block : tuple of int
        See `OnFile`.
    tiles : dict
        Tiles by their row and column.
    """

    read: Reader
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    block: tuple[int, int] = (TILE, TILE)
    tiles: OrderedDict[tuple[int, int], NDArray[np.float64]] = field(default_factory=OrderedDict, repr=False)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.rows.size, self.columns.size

    def west_part(self, columns: int) -> LazyRaster:
        """Return the part of the first columns."""
        return replace(self, columns=self.columns[:columns], tiles=OrderedDict())

    def __getitem__(self, place: tuple[slice, slice]) -> NDArray[np.float64]:
        (top, bottom, _), (left, right, _) = (part.indices(size) for part, size in zip(place, self.shape, strict=True))
        block = np.empty((max(bottom - top, 0), max(right - left, 0)))
        height, width = self._tile_shape
        for row in range(top // height, -(-bottom // height)):
            for column in range(left // width, -(-right // width)):
                tile = self._tile(row, column)
                rows, columns = _meeting(row, height, top, bottom), _meeting(column, width, left, right)
                inside = tile[_moved(rows, -row * height), _moved(columns, -column * width)]
                block[_moved(rows, -top), _moved(columns, -left)] = inside
        return block

    @property
    def _tile_shape(self) -> tuple[int, int]:
        """Whole blocks, of `TILE` pixels a side at least."""
        height, width = (side * -(-TILE // side) for side in self.block)
        return height, width

    def _tile(self, row: int, column: int) -> NDArray[np.float64]:
        height, width = self._tile_shape
        tile = self.tiles.pop((row, column), None)
        if tile is None:
            rows = self.rows[row * height : (row + 1) * height]
            columns = self.columns[column * width : (column + 1) * width]
            tile = np.vstack([np.hstack([self._run(down, along) for along in _runs(columns)]) for down in _runs(rows)])
        self.tiles[row, column] = tile
        while len(self.tiles) > max(1, _KEPT_PIXELS // (height * width)):
            self.tiles.popitem(last=False)
        return tile

    def _run(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the values at rows and columns that follow each other in the file, forwards or backwards."""
        parts, steps = [], []
        for index in (rows, columns):
            parts.append(slice(int(index.min()), int(index.max()) + 1))
            steps.append(-1 if index[0] > index[-1] else 1)
        values = self.read(parts[0], parts[1])[:: steps[0], :: steps[1]]
        return np.where(np.isfinite(values), values, np.nan)


def _runs(index: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Yield the parts of an index that lie side by side in the file."""
    yield from np.split(index, np.flatnonzero(np.abs(np.diff(index)) != 1) + 1)


def _meeting(tile: int, side: int, first: int, last: int) -> slice:
    return slice(max(tile * side, first), min((tile + 1) * side, last))


def _moved(part: slice, by: int) -> slice:
    return slice(part.start + by, part.stop + by)
