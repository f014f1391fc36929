"""How windows of one size on the ground lie over a field."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import FieldError
from sparsor.geodesy.box import MAX_LATITUDE_DEG
from sparsor.geodesy.lengths import distance_m, offset_deg

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from sparsor.prior.field import Field

# Lengths are sums of rounded geodesics: a window of exactly 32 pixels may come out a hair narrower.
EDGE = 1e-6


@dataclass(frozen=True)
class Lattice:
    """Rows of windows: their parallels, and how the windows of each row lie along it.

    Parameters
    ----------
    north_deg, south_deg, width_deg : array of float64 (rows,)
        Edges of the windows of a row, and their width.
    step_deg : array of float64 (rows,)
        From a window of the row to the next.
    share : array of int (rows,)
        How many windows of the row lie in one column.
    columns : array of int (rows,)
        Windows in the row; 0 where they are wider than the field.
    """

    north_deg: NDArray[np.float64]
    south_deg: NDArray[np.float64]
    width_deg: NDArray[np.float64]
    step_deg: NDArray[np.float64]
    share: NDArray[np.int64]
    columns: NDArray[np.int64]

    @property
    def count(self) -> int:
        """Windows in all rows."""
        return int(self.columns.sum())

    def frames(self, field: Field) -> Iterable[tuple[int, int, tuple[float, float, float, float]]]:
        """Yield row, column and top, bottom, left, right in pixels from the outer north-west corner."""
        width, height = field.pixel_deg
        rows, columns = field.values.shape
        north = field.edges_deg[3]
        for row in range(len(self.columns)):
            top = max((north - self.north_deg[row]) / height, 0.0)
            bottom = min((north - self.south_deg[row]) / height, float(rows))
            for index in range(self.columns[row]):
                left = index * self.step_deg[row] / width
                right = min(left + self.width_deg[row] / width, float(columns))
                yield row, int(index // self.share[row]), (top, bottom, left, right)


def lay_windows(field: Field, east_m: float, north_m: float, most: int | None = None, *, per_side: int = 4) -> Lattice:
    """Return windows over a field, a quarter of a side apart, or as much more as keeps them to `most`.

    Parameters
    ----------
    field : Field
        What the windows will be cut from.
    east_m, north_m : float
        Sides of a window, metres.
    most : int, optional
        Upper limit on their number.
    per_side : int
        Steps from window to window that make a side: 4 for a quarter of it.

    Returns
    -------
    Lattice
        Of no windows where none fits.
    """
    lattice = _lattice(field, east_m, north_m, stretch := 4 / per_side)
    if most is None or lattice.count <= most:
        return lattice
    stretch *= math.sqrt(lattice.count / most)
    while (lattice := _lattice(field, east_m, north_m, stretch)).count > most:
        stretch *= 1.02
    return lattice


def _lattice(field: Field, east_m: float, north_m: float, stretch: float) -> Lattice:
    """Lay windows a quarter of a side times `stretch` apart.

    Columns are bands of longitude at every latitude: they lie a quarter of the side apart where windows are
    widest in degrees. Where these are half as wide or less, several share a column. So windows four columns
    apart never overlap: either the western one starts its column, or it is at most two columns wide.
    """
    west, south, east, north = field.edges_deg
    top, bottom = min(north, MAX_LATITUDE_DEG), max(south, -MAX_LATITUDE_DEG)
    height_m = float(distance_m(0.0, bottom, 0.0, top)) if top > bottom else 0.0
    step_m = north_m / 4 * stretch
    rows = math.floor((height_m - north_m) / step_m + EDGE) + 1 if height_m >= north_m * (1 - EDGE) else 0
    down_m = np.arange(rows) * step_m
    _, north_deg = offset_deg(0.0, top, 0.0, -down_m)
    _, south_deg = offset_deg(0.0, top, 0.0, -(down_m + north_m))
    width_deg = east_m / _metres_per_degree_east((north_deg + south_deg) / 2)
    fits = width_deg <= (east - west) * (1 + EDGE)
    widest = width_deg[fits].max(initial=0.0)
    share = np.maximum(np.floor(widest / width_deg + EDGE), 1).astype(np.int64)
    step_deg = np.where(fits, widest / 4 * stretch / share, 1.0)
    columns = np.where(fits, np.floor((east - west - width_deg) / step_deg + EDGE) + 1, 0).astype(np.int64)
    return Lattice(north_deg, south_deg, width_deg, step_deg, share, np.maximum(columns, 0))


def resolved_scale(field: Field, east_m: float, north_m: float, shape: tuple[int, int]) -> float:
    """Return the factor on the sides at which each spans as many pixels as cells at every latitude.

    Up to 1, the window is resolved as it is.

    Raises
    ------
    FieldError
        When a side is not a positive length.
    """
    if not (0 < east_m < math.inf and 0 < north_m < math.inf):
        raise FieldError(f"a window of {east_m:g} m x {north_m:g} m has no size; give two positive lengths")
    pixel_east_m, pixel_north_m = _largest_pixel_m(field)
    return max(shape[1] * pixel_east_m / east_m, shape[0] * pixel_north_m / north_m)


def _largest_pixel_m(field: Field) -> tuple[float, float]:
    width, height = field.pixel_deg
    lat = np.clip(field.lat_deg, -MAX_LATITUDE_DEG, MAX_LATITUDE_DEG)
    east_m = width * _metres_per_degree_east(lat).max()
    north_m = distance_m(0.0, lat - height / 2, 0.0, lat + height / 2).max()
    return float(east_m), float(north_m)


def _metres_per_degree_east(lat_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    short = 0.01  # a geodesic this short is the parallel to 1e-9
    return distance_m(0.0, lat_deg, short, lat_deg) / short


def extent_m(field: Field) -> tuple[float, float]:
    """Return the field's width along its middle parallel and its height, metres."""
    west, south, east, north = field.edges_deg
    south, north = max(south, -90.0), min(north, 90.0)
    wide_m = (east - west) * float(_metres_per_degree_east(np.array([(south + north) / 2]))[0])
    return wide_m, float(distance_m(0.0, south, 0.0, north))
