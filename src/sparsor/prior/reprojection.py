"""A raster in any CRS brought to longitude and latitude."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import FieldError
from sparsor.geodesy.box import MAX_LATITUDE_DEG
from sparsor.prior.field import check_pixel_count, field_on_axes
from sparsor.prior.raster import OnFile
from sparsor.prior.resampling import bilinear_at

if TYPE_CHECKING:
    from pathlib import Path

    from affine import Affine
    from numpy.typing import NDArray
    from rasterio.crs import CRS

    from sparsor.prior.field import Field

WGS84 = "EPSG:4326"
POINTS_AT_ONCE = 1_000_000


@dataclass(frozen=True)
class Band:
    """One band as it is in the file: values with NaN gaps, its CRS, and pixel (column, row) -> CRS."""

    values: NDArray[np.float64] | OnFile
    crs: CRS
    transform: Affine
    unit: str
    source: str


def is_lon_lat(band: Band) -> bool:
    """Whether the pixels lie along meridians and parallels of WGS 84, to a tenth of a pixel."""
    step = band.transform
    if not band.crs.is_geographic or step.b != 0 or step.d != 0:
        return False
    rows, columns = band.values.shape
    lon, lat = _lon_lat_of(band, np.array([columns / 2]), np.array([rows / 2]))
    east = (lon[0] - (step.a * columns / 2 + step.c) + 180.0) % 360.0 - 180.0
    north = lat[0] - (step.e * rows / 2 + step.f)
    return bool(abs(east) <= 0.1 * abs(step.a) and abs(north) <= 0.1 * abs(step.e))


def reprojected(band: Band, path: Path) -> Field:
    """Return the band as a field, resampled (bilinear) to pixels of the size that its own have in its middle.

    Raises
    ------
    FieldError
        When the CRS has no way to longitude and latitude there, or the field would be too large.
    """
    assert not isinstance(band.values, OnFile), "each pixel takes its value from anywhere in the file"
    lon_deg, lat_deg = _target(band, path)
    check_pixel_count(lat_deg.size, lon_deg.size, band.source)
    values = np.empty((lat_deg.size, lon_deg.size))
    at_once = max(1, POINTS_AT_ONCE // lon_deg.size)
    # Every pixel is transformed: GDAL's warper interpolates places, and lost half of a sinusoidal world.
    for first in range(0, lat_deg.size, at_once):
        rows = slice(first, first + at_once)
        lon, lat = np.meshgrid(lon_deg, lat_deg[rows])
        values[rows] = bilinear_at(band.values, *_pixels_of(band, lon, lat))
    size = f"{lon_deg.size} x {lat_deg.size}"
    note = f"{path.name}: resampled from its CRS to {size} pixels of longitude and latitude"
    return field_on_axes(values, lon_deg, lat_deg, unit=band.unit, source=band.source, notes=(note,))


def _target(band: Band, path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the pixel centres of the target, longitudes and latitudes."""
    rows, columns = band.values.shape
    places = np.meshgrid(np.linspace(0, columns, 41), np.linspace(0, rows, 41))
    all_lon, all_lat = _lon_lat_of(band, *places)
    middle = (np.array([0.0, 1.0, 0.0]) + columns / 2, np.array([0.0, 0.0, 1.0]) + rows / 2)
    lon, lat = _lon_lat_of(band, *middle)
    width = math.hypot(*((lon[1:] - lon[0] + 180.0) % 360.0 - 180.0))
    height = math.hypot(*(lat[1:] - lat[0]))
    if not (width > 0 and height > 0 and math.isfinite(width + height)):
        raise FieldError(f"{path}: its CRS cannot be brought to longitude and latitude; try gdalwarp -t_srs EPSG:4326")
    # Longitudes are taken from the middle of the raster, so that one across the antimeridian stays whole.
    all_lon = lon[0] + (all_lon - lon[0] + 180.0) % 360.0 - 180.0
    west, east = float(np.nanmin(all_lon)), float(np.nanmax(all_lon))
    south, north = float(np.nanmin(all_lat)), float(np.nanmax(all_lat))
    if abs(lat[0]) > MAX_LATITUDE_DEG:
        # Round a pole a pixel in the middle spans any longitude: the size at the rim counts.
        width = 360.0 / math.ceil(360.0 / height * math.cos(math.radians(min(abs(south), abs(north)))))
        west, east = -180.0, 180.0
    across, down = (max(2, math.ceil(span - 1e-6)) for span in ((east - west) / width, (north - south) / height))
    lon_deg = np.asarray(west + (np.arange(across) + 0.5) * width)
    lat_deg = np.asarray(north - (np.arange(down) + 0.5) * height)
    return lon_deg, lat_deg


def _lon_lat_of(
    band: Band, column: NDArray[np.float64], row: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return longitudes and latitudes of places in pixels; NaN where the CRS reaches none."""
    step = band.transform
    x = step.a * column + step.b * row + step.c
    y = step.d * column + step.e * row + step.f
    return _transformed(band.crs, WGS84, x, y)


def _pixels_of(
    band: Band, lon: NDArray[np.float64], lat: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return fractional rows and columns of points, centres at whole numbers; NaN where there are none."""
    x, y = _transformed(WGS84, band.crs, lon, lat)
    step = ~band.transform
    column = step.a * x + step.b * y + step.c
    return step.d * x + step.e * y + step.f - 0.5, column - 0.5


def _transformed(
    source: CRS | str, target: CRS | str, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    from rasterio.warp import transform

    ends = (np.asarray(axis, dtype=np.float64) for axis in transform(source, target, x.ravel(), y.ravel()))
    first, second = (np.where(np.isfinite(end), end, np.nan).reshape(x.shape) for end in ends)
    return first, second
