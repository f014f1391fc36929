"""The height of the ground, from a digital elevation model on file."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import TerrainError
from sparsor.geodesy.lengths import distance_m, from_wgs84, offset_deg, to_wgs84, vertical_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray
    from rasterio.io import DatasetReader

# What rasters call their unit of height.
METRES_OF = {
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("ft", "foot", "feet", "international foot"), 0.3048),
    **dict.fromkeys(
        ("us-ft", "us survey foot", "us survey feet", "ussurveyfoot", "ftus", "us_survey_foot"), 1200 / 3937
    ),
}
LOWEST_M, HIGHEST_M = -500.0, 9000.0  # the Dead Sea's shore, Mount Everest
MOST_PIXELS = 60_000_000
SPARE_PIXELS = 4
UNEVEN = 1.01  # the sides of pixels are those at the corners of what is read; a map's scale may have its least between
SIDE_POINTS = 9  # along each side of what is read, when it is brought to the raster's own system


@dataclass(frozen=True, eq=False)
class Terrain:
    """A part of a digital elevation model.

    Between the centres of its pixels the ground is bilinear.

    Parameters
    ----------
    path : Path
    heights_m : array of float32 (rows, columns)
        NaN where nothing is known.
    to_pixel : array of float64 (2, 3)
        From east and north in the raster's system (and 1) to the column and the row of pixel centres in `heights_m`.
    crs : str
        The raster's system, WKT.
    middle : float or None
        Longitude, as the raster counts them, that others are brought to within half a turn of; None of a system in
        metres.
    pixel_m : tuple of float
        Width and height of a pixel, the least in this part.
    vertical : str or None
        What the file says that its heights are above.
    unit_said : bool
        Whether it says their unit; metres otherwise.
    """

    path: Path
    heights_m: NDArray[np.float32]
    to_pixel: NDArray[np.float64]
    crs: str
    middle: float | None
    pixel_m: tuple[float, float]
    vertical: str | None
    unit_said: bool
    highest: dict[tuple[int, int], NDArray[np.float32]] = field(default_factory=dict, repr=False)

    @property
    def step_m(self) -> float:
        """How far apart points along a leg lie: the shorter side of a pixel."""
        return min(self.pixel_m)

    def ground_m(self, lon_deg: ArrayLike, lat_deg: ArrayLike) -> NDArray[np.float64]:
        """Return the height of the ground at points, metres; NaN where it is not known."""
        column, row = self._pixels(lon_deg, lat_deg)
        left, top = np.floor(column), np.floor(row)
        along, down = column - left, row - top
        rows, columns = self.heights_m.shape
        known = (left >= 0) & (top >= 0) & (left < columns - 1) & (top < rows - 1)
        i, j = np.where(known, top, 0).astype(np.int64), np.where(known, left, 0).astype(np.int64)
        z = self.heights_m
        upper = z[i, j] * (1 - along) + z[i, j + 1] * along
        lower = z[i + 1, j] * (1 - along) + z[i + 1, j + 1] * along
        return np.where(known, upper * (1 - down) + lower * down, np.nan)

    def highest_m(self, lon_deg: ArrayLike, lat_deg: ArrayLike, reach_m: float = 0.0) -> NDArray[np.float64]:
        """Return the highest ground within a distance of points, metres; infinite where some of it is not known.

        What is within less of a point is within more of it, and of any other point by what lies between the two: so
        what was planned with more to spare is never found wanting. Half the spacing of points along a line misses
        nothing between them.
        """
        column, row = self._pixels(lon_deg, lat_deg)
        half_width, half_height = (UNEVEN * reach_m / side for side in self.pixel_m)
        # All pixel centres that the ground there lies between; two windows of one size, which overlap, have them all.
        left, right = np.floor(column - half_width), np.ceil(column + half_width)
        top, bottom = np.floor(row - half_height), np.ceil(row + half_height)
        rows, columns = self.heights_m.shape
        known = (left >= 0) & (top >= 0) & (right < columns) & (bottom < rows)
        height, width = math.ceil(2 * half_height) + 1, math.ceil(2 * half_width) + 1
        peaks = self._peaks(height, width)
        found = np.full(known.shape, -np.inf)
        for i in (top, bottom - height + 1):
            for j in (left, right - width + 1):
                at = np.where(known, i, 0).astype(np.int64), np.where(known, j, 0).astype(np.int64)
                found = np.maximum(found, peaks[at])
        return np.where(known, found, np.inf)

    def _peaks(self, height: int, width: int) -> NDArray[np.float32]:
        """Return the highest pixels of the windows that begin at each pixel."""
        if (height, width) not in self.highest:
            from scipy.ndimage import maximum_filter1d

            peaks = np.where(np.isnan(self.heights_m), np.float32(np.inf), self.heights_m)
            for axis, size in ((0, height), (1, width)):
                peaks = maximum_filter1d(peaks, size, axis=axis, mode="constant", cval=np.inf, origin=-(size // 2))
            self.highest[height, width] = peaks
        return self.highest[height, width]

    def _pixels(self, lon_deg: ArrayLike, lat_deg: ArrayLike) -> NDArray[np.float64]:
        x, y = from_wgs84(lon_deg, lat_deg, self.crs)
        if self.middle is not None:
            x = _near(x, self.middle)
        (a, b, c), (d, e, f) = self.to_pixel
        found = np.stack([a * x + b * y + c, d * x + e * y + f])
        return np.where(np.isfinite(found), found, -1e9)


def read_terrain(path: Path, lon_deg: ArrayLike, lat_deg: ArrayLike, margin_m: float) -> Terrain:
    """Read the part of a digital elevation model round some places.

    Parameters
    ----------
    path : Path
        A raster of one band in any reference system; rotated ones too.
    lon_deg, lat_deg : array_like (n,)
        Places that it is wanted for, degrees.
    margin_m : float
        And how far round them.

    Raises
    ------
    TerrainError
        When it cannot be read, is not georeferenced, covers none of it, has several bands or too many pixels, or when
        its heights are none: in a unit that is not known, or beyond what there is on Earth.
    """
    if not path.exists():
        raise TerrainError(f"there is no terrain file '{path}'; give a digital elevation model (GeoTIFF)")
    import rasterio
    from rasterio._err import CPLE_BaseError  # not made public
    from rasterio.errors import CRSError, RasterioError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of rasters without georeferencing, which is said better below
            with rasterio.open(path) as dataset:
                return _part(dataset, path, *_round(lon_deg, lat_deg, margin_m))
    except (CPLE_BaseError, RasterioError, CRSError, OSError, MemoryError) as error:
        raise TerrainError(
            f"'{path}' cannot be read as a terrain file ({(str(error) or type(error).__name__)[:200]}); give a digital "
            "elevation model (GeoTIFF)"
        ) from error


def _round(lon_deg: ArrayLike, lat_deg: ArrayLike, margin_m: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points all over the box round places, with a margin; longitudes may leave -180..180."""
    lat = np.asarray(lat_deg, dtype=np.float64).ravel()
    lon = np.asarray(lon_deg, dtype=np.float64).ravel()
    lon = _near(lon, float(lon[0]))
    corners_lon = np.repeat([lon.min(), lon.max()], 4)
    corners_lat = np.tile(np.repeat([lat.min(), lat.max()], 2), 2)
    east = np.repeat([-margin_m, margin_m], 4)
    north = np.tile([-margin_m, margin_m], 4)
    grown_lon, grown_lat = offset_deg(corners_lon, corners_lat, east, north)
    grown_lon = _near(grown_lon, float(lon[0]))
    side_lon = np.linspace(grown_lon.min(), grown_lon.max(), SIDE_POINTS)
    side_lat = np.linspace(grown_lat.min(), grown_lat.max(), SIDE_POINTS)
    over_lon, over_lat = np.meshgrid(side_lon, side_lat)
    return over_lon.ravel(), over_lat.ravel()


def _part(dataset: DatasetReader, path: Path, lon: NDArray[np.float64], lat: NDArray[np.float64]) -> Terrain:
    if dataset.crs is None or dataset.transform.is_identity or dataset.transform.is_degenerate:
        raise TerrainError(
            f"'{path}' does not say where it lies: it lacks a reference system or a pixel size; give one that has both"
        )
    if dataset.count != 1:
        raise TerrainError(f"'{path}' has {dataset.count} bands; a digital elevation model has one, of heights")
    crs = dataset.crs.to_wkt()
    factor, vertical, unit_said = _unit(dataset, path, crs)
    x, y = from_wgs84(lon, lat, crs)
    middle = _middle(dataset, float(np.median(x))) if dataset.crs.is_geographic else None
    if middle is not None:
        x = _near(x, middle)
    inverse = ~dataset.transform
    column, row = inverse.a * x + inverse.b * y + inverse.c, inverse.d * x + inverse.e * y + inverse.f
    placed = np.isfinite(column) & np.isfinite(row)
    ends = [
        (max(math.floor(side[placed].min()) - SPARE_PIXELS, 0), min(math.ceil(side[placed].max()) + SPARE_PIXELS, size))
        if placed.any()
        else (0, 0)
        for side, size in ((row, dataset.height), (column, dataset.width))
    ]
    (top, bottom), (left, right) = ends
    if bottom - top < 2 or right - left < 2:
        raise TerrainError(
            f"'{path}' does not cover the flight, round {np.median(lon):.4f} {np.median(lat):.4f}: give the elevation "
            "model of that place"
        )
    if (bottom - top) * (right - left) > MOST_PIXELS:
        raise TerrainError(
            f"'{path}' has {(bottom - top) * (right - left) / 1e6:.0f} million pixels round the flight; "
            f"{MOST_PIXELS / 1e6:.0f} are read at most: give a coarser one (gdalwarp -tr, with -r max)"
        )
    band = dataset.read(1, masked=True, window=((top, bottom), (left, right)))
    if band.dtype.kind not in "iuf":
        raise TerrainError(f"'{path}' holds {band.dtype} values; heights are real numbers")
    raw = np.where(np.ma.getmaskarray(band), np.nan, band.data.astype(np.float64))
    heights = (raw * dataset.scales[0] + dataset.offsets[0]) * factor
    heights[~np.isfinite(heights)] = np.nan
    _check_heights(heights, path)
    to_pixel = np.array(
        [
            [inverse.a, inverse.b, inverse.c - left - 0.5],
            [inverse.d, inverse.e, inverse.f - top - 0.5],
        ]
    )
    corners = [(column, row) for column in (left, right - 1) for row in (top, bottom - 1)]
    return Terrain(
        path=path,
        heights_m=heights.astype(np.float32),
        to_pixel=to_pixel,
        crs=crs,
        middle=middle,
        pixel_m=_pixel_m(dataset, corners, crs),
        vertical=vertical,
        unit_said=unit_said,
    )


def _unit(dataset: DatasetReader, path: Path, crs: str) -> tuple[float, str | None, bool]:
    """Return the metres of the unit of heights, what they are above, and whether either was said."""
    heights = vertical_of(crs)
    tags = {key.lower(): text for key, text in (dataset.tags() | dataset.tags(1)).items()}
    stated = str(dataset.units[0] or tags.get("units") or tags.get("unit") or "").strip()
    if not stated:
        return (1.0, None, False) if heights is None else (heights[1], heights[0], True)
    factor = METRES_OF.get(stated.lower())
    if factor is None:
        raise TerrainError(f"'{path}' holds heights in '{stated}', which is not known; give metres or feet")
    if heights is not None and not math.isclose(heights[1], factor, rel_tol=1e-9):
        raise TerrainError(
            f"'{path}' says of its heights that they are in '{stated}', and by its reference system ({heights[0]}) in "
            f"a unit of {heights[1]:g} m: one of them is wrong"
        )
    return factor, None if heights is None else heights[0], True


def _check_heights(heights_m: NDArray[np.float64], path: Path) -> None:
    if np.isnan(heights_m).all():
        raise TerrainError(f"'{path}' knows no height round the flight: all of it is without data there")
    low, high = float(np.nanmin(heights_m)), float(np.nanmax(heights_m))
    if low < LOWEST_M or high > HIGHEST_M:
        raise TerrainError(
            f"'{path}' holds heights of {low:g} to {high:g} m, beyond those of the ground on Earth: is it an elevation "
            "model, and is its value for no data written into it (gdal_edit.py -a_nodata)?"
        )


def _middle(dataset: DatasetReader, x: float) -> float:
    """Return a longitude as the raster counts it: some begin at 0, some at -180."""
    bounds = dataset.bounds
    centre = float(bounds.left + bounds.right) / 2
    return centre + (x - centre + 180.0) % 360.0 - 180.0


def _pixel_m(dataset: DatasetReader, places: Sequence[tuple[float, float]], crs: str) -> tuple[float, float]:
    """Return the least width and height of pixels at some places (column, row), metres."""
    sides = []
    for column, row in places:
        corners = [dataset.transform * one for one in ((column, row), (column + 1, row), (column, row + 1))]
        lon, lat = to_wgs84([x for x, _ in corners], [y for _, y in corners], crs)
        sides.append(distance_m(lon[0], lat[0], lon[1:], lat[1:]))
    width, height = np.min(sides, axis=0)
    if not (np.isfinite(sides).all() and min(width, height) > 0):
        raise TerrainError(f"'{dataset.name}' has no pixel size in metres where it is flown")
    return float(width), float(height)


def _near(lon_deg: NDArray[np.float64], middle_deg: float) -> NDArray[np.float64]:
    return np.asarray(middle_deg + (lon_deg - middle_deg + 180.0) % 360.0 - 180.0)
