"""Windows of a field: the maps that a model learns from."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import EmptyFieldError, FieldError
from sparsor.prior.lattice import EDGE, extent_m, lay_windows, resolved_scale
from sparsor.prior.resampling import cell_means, fill_gaps

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike, NDArray

    from sparsor.prior.field import Field
    from sparsor.prior.raster import LazyRaster

MAX_GAP_FRACTION = 0.05
LEAST_WINDOWS = 12
MOST_WINDOWS = 8192


@dataclass(frozen=True)
class MapSet:
    """Maps cut out of a field, all of one size.

    Parameters
    ----------
    maps : array of float64 (n, N)
        Cell means in the field's unit, row-major, row 0 northmost.
    window_m : tuple of float
        East and north side of each window on the ground, metres; NaN where only pixels are known.
    row, column : array of int (n,)
        Place of each window in the lattice of windows, from the north and from the west. Windows four or
        more columns apart share no ground, unless they were laid more densely than four a side.
    west : array of float64 (n,)
        West edge of each window, pixels from the field's.
    dropped : int
        Windows left out because more than 5 % of their pixels are gaps.
    filled : int
        Windows kept whose gaps, up to 5 %, were filled linearly.
    unit : str
        Of the maps.
    source : str
        Where the field came from.

    Raises
    ------
    FieldError
        When there is not one map, or the numbers of maps and places disagree.
    """

    maps: NDArray[np.float64]
    window_m: tuple[float, float]
    row: NDArray[np.int64]
    column: NDArray[np.int64]
    west: NDArray[np.float64]
    dropped: int
    filled: int
    unit: str
    source: str

    def __post_init__(self) -> None:
        if self.maps.ndim != 2 or not len(self.maps) == len(self.row) == len(self.column) == len(self.west):
            raise FieldError(
                f"{self.source}: maps of shape {self.maps.shape} do not fit {len(self.row)} window rows and "
                f"{len(self.column)} window columns"
            )
        if len(self.maps) == 0 and not self.dropped:
            raise FieldError(
                f"{self.source}: not one window of {_km(*self.window_m)} fits into it: ask for smaller ones, or leave "
                "this field out"
            )
        if len(self.maps) == 0:
            raise EmptyFieldError(
                f"{self.source}: no window without large gaps: {self.dropped} had more than "
                f"{MAX_GAP_FRACTION:.0%} of their pixels missing; give a field with fewer gaps"
            )


def pixel_windows(
    values: ArrayLike,
    *,
    window: int = 128,
    stride: int = 32,
    factor: int = 4,
    unit: str = "",
    source: str = "field",
) -> MapSet:
    """Return the windows of the study's protocol: squares of pixels, averaged over small squares.

    Parameters
    ----------
    values : array_like (rows, columns)
        Gaps are NaN.
    window, stride, factor : int
        Side of a window, step from window to window, and side of the squares that become a cell, pixels;
        `factor` divides `window`.
    unit, source : str
        Carried into the result.

    Returns
    -------
    MapSet
        Of ``(window / factor) ** 2`` cells a map.

    Raises
    ------
    FieldError
        When not one window fits or is free of large gaps, or the sizes do not fit each other.

    Examples
    --------
    >>> pixel_windows(np.zeros((994, 1390))).maps.shape  # 28 rows x 40 columns; method.md, Protocol
    (1120, 1024)
    """
    array = np.asarray(values, dtype=np.float64)
    if not (min(window, stride, factor) >= 1 and window % factor == 0):
        raise FieldError(f"windows of {window} pixels, stride {stride}, cannot be averaged over {factor} pixels")
    if min(array.shape) < window:
        raise FieldError(
            f"{source}: {array.shape[1]} x {array.shape[0]} pixels hold no window of {window} x {window}; "
            "resample the field to more pixels or take a smaller window"
        )
    tops = range(0, array.shape[0] - window + 1, stride)
    lefts = range(0, array.shape[1] - window + 1, stride)
    frames = (
        (row, column, (float(top), float(top + window), float(left), float(left + window)))
        for row, top in enumerate(tops)
        for column, left in enumerate(lefts)
    )
    side = window // factor
    return _cut(array, frames, (side, side), window_m=(math.nan, math.nan), unit=unit, source=source)


def ground_windows(
    field: Field, east_m: float, north_m: float, shape: tuple[int, int] = (32, 32), *, per_side: int = 4
) -> MapSet:
    """Return windows of one size on the ground (method.md, Ground scale).

    Rows of windows follow each other from the north by a quarter of the north side. A window is as many
    degrees wide as its side takes at its middle latitude. Columns lie a quarter of the side apart where
    windows are widest in degrees; where they are half as wide or less, two or more share a column, so that
    steps stay below half a side and a column is a band of longitude at every latitude. Steps grow where
    there would be more than `MOST_WINDOWS`.

    Parameters
    ----------
    field : Field
        What the windows are cut from.
    east_m, north_m : float
        Sides of a window, metres.
    shape : tuple of int
        Rows and columns of cells in a map.
    per_side : int
        Steps from window to window that make a side: more lay them more densely.

    Returns
    -------
    MapSet
        In the field's unit.

    Raises
    ------
    FieldError
        When a side spans fewer pixels than cells at some latitude (see `nearest_resolved_m`), when no window
        fits, or all of them have large gaps.
    """
    scale = resolved_scale(field, east_m, north_m, shape)
    if scale > 1.0 + EDGE:
        raise FieldError(
            f"{field.source}: windows of {_km(east_m, north_m)} span fewer than {shape[1]} x {shape[0]} "
            f"pixels; the least that this field resolves is {_km(east_m * scale, north_m * scale)}"
        )
    return _cut(
        field.values,
        lay_windows(field, east_m, north_m, most=MOST_WINDOWS, per_side=per_side).frames(field),
        shape,
        window_m=(east_m, north_m),
        unit=field.unit,
        source=field.source,
    )


def nearest_resolved_m(
    field: Field, east_m: float, north_m: float, shape: tuple[int, int] = (32, 32)
) -> tuple[float, float]:
    """Return the window size nearest to the one asked for that the field can give, aspect kept.

    It has to be resolved, at least as many native pixels a side as cells at every latitude of the field, and
    small enough for `LEAST_WINDOWS` windows.

    Parameters
    ----------
    field : Field
        What windows will be cut from.
    east_m, north_m : float
        Sides asked for, metres.
    shape : tuple of int
        Rows and columns of cells in a map.

    Returns
    -------
    tuple of float
        East and north side, metres: as asked for where the field gives that.

    Raises
    ------
    FieldError
        When the field is too small or too coarse for any size.
    """
    smallest = resolved_scale(field, east_m, north_m, shape)

    def enough(scale: float) -> bool:
        return lay_windows(field, scale * east_m, scale * north_m).count >= LEAST_WINDOWS

    if not enough(smallest):
        raise FieldError(_too_small(field, smallest * east_m, smallest * north_m, shape))
    if smallest >= 1.0 - EDGE or enough(1.0):
        scale = max(1.0, smallest)
        return scale * east_m, scale * north_m
    largest = 1.0
    for _ in range(40):
        middle = math.sqrt(smallest * largest)
        smallest, largest = (middle, largest) if enough(middle) else (smallest, middle)
    return smallest * east_m, smallest * north_m


def _cut(
    values: NDArray[np.float64] | LazyRaster,
    frames: Iterable[tuple[int, int, tuple[float, float, float, float]]],
    shape: tuple[int, int],
    *,
    window_m: tuple[float, float],
    unit: str,
    source: str,
) -> MapSet:
    maps: list[NDArray[np.float64]] = []
    places: list[tuple[int, int]] = []
    west: list[float] = []
    dropped = filled = 0
    for row, column, (top, bottom, left, right) in frames:
        row0, column0 = math.floor(top), math.floor(left)
        block = values[row0 : math.ceil(bottom), column0 : math.ceil(right)]
        gaps = np.count_nonzero(~np.isfinite(block))
        if gaps > MAX_GAP_FRACTION * block.size:
            dropped += 1
            continue
        if gaps:
            filled += 1
            block = fill_gaps(block)
        bounds = (top - row0, bottom - row0, left - column0, right - column0)
        maps.append(cell_means(block, bounds, shape).ravel())
        places.append((row, column))
        west.append(left)
    place = np.array(places, dtype=np.int64).reshape(-1, 2)
    stacked = np.array(maps).reshape(len(maps), shape[0] * shape[1])
    return MapSet(stacked, window_m, place[:, 0], place[:, 1], np.array(west), dropped, filled, unit, source)


def _too_small(field: Field, east_m: float, north_m: float, shape: tuple[int, int]) -> str:
    wide_m, high_m = extent_m(field)
    rows, columns = field.values.shape
    return (
        f"{field.source}: the field is too small or too coarse: {_km(wide_m, high_m)}, {columns} x {rows} "
        f"pixels. A window needs {shape[1]} x {shape[0]} of its pixels at least, which with the box's aspect "
        f"is {_km(east_m, north_m)}, and {LEAST_WINDOWS} such windows have to fit. "
        "Give a larger or a finer field, or leave --field out: the built-in prior resolves every size"
    )


def _km(east_m: float, north_m: float) -> str:
    return f"{east_m / 1000:.4g} x {north_m / 1000:.4g} km"
