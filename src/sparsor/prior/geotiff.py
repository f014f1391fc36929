"""Fields from GeoTIFF and every other raster that GDAL reads, brought to longitude and latitude."""

from __future__ import annotations

import math
import warnings
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import FieldError
from sparsor.prior.field import check_pixel_count, field_on_axes
from sparsor.prior.raster import LAZY_PIXELS, OnFile
from sparsor.prior.reprojection import Band, is_lon_lat, reprojected

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray
    from rasterio.io import DatasetReader

    from sparsor.prior.field import Field

# GDAL's own would keep a twentieth of the machine's memory; the tiles read last are kept by us.
GDAL_CACHE_MB = 32
PLACE_IT = "place it with --field-bbox W S E N, or write its CRS into it, e.g. with gdal_edit.py -a_srs EPSG:4326"


def read_geotiff(
    path: Path,
    *,
    variable: str | None = None,
    box: tuple[float, float, float, float] | None = None,
    lazily: bool = False,
) -> Field:
    """Return one band of a raster as a field.

    Parameters
    ----------
    path : Path
        Any raster with a CRS; a CRS other than longitude and latitude, a rotated or a south-up raster is
        resampled, bilinear, to pixels of the size that its own have in its middle.
    variable : str, optional
        Name (band description) or number, from 1, of the band; needed where there are several.
    box : tuple of float, optional
        West, south, east, north in degrees of the outer edges: places a raster that has no CRS.
    lazily : bool
        Leave a large raster on file until windows are cut from it. One that has to be resampled is read.

    Returns
    -------
    Field
        Scale and offset applied; no-data, masked and infinite values are gaps.

    Raises
    ------
    FieldError
        When GDAL cannot read it, it is not georeferenced, the band is unknown, or everything is a gap.
    """
    band = _read_band(path, variable, placed=box is not None, lazily=lazily)
    if box is not None:
        over = axes_over(box, band.values.shape, band.source)
        return field_on_axes(band.values, *over, unit=band.unit, source=band.source)
    with _gdal_errors(path):
        if not is_lon_lat(band):
            return reprojected(_read_band(path, variable, placed=False), path)
    rows, columns = band.values.shape
    lon_deg = band.transform.c + (np.arange(columns) + 0.5) * band.transform.a
    lat_deg = band.transform.f + (np.arange(rows) + 0.5) * band.transform.e
    return field_on_axes(band.values, lon_deg, lat_deg, unit=band.unit, source=band.source)


def axes_over(
    box: tuple[float, float, float, float], shape: tuple[int, ...], source: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return pixel centres, longitudes and latitudes, of a raster whose outer edges are the box's sides.

    Raises
    ------
    FieldError
        When the box is not one: a value that is not a number, out of range, or sides swapped.
    """
    west, south, east, north = box
    if not (all(map(math.isfinite, box)) and -90 <= south < north <= 90 and west != east):
        raise FieldError(
            f"{source}: --field-bbox {' '.join(f'{side:g}' for side in box)} is not a box; give west south "
            "east north in degrees, south below north"
        )
    if not (-360 <= west <= 360 and -360 <= east <= 360 and abs(east - west) <= 360):
        raise FieldError(f"{source}: --field-bbox: longitudes {west:g} and {east:g} have to be in -180..180")
    width = east - west if east > west else east - west + 360.0
    rows, columns = shape[:2]
    lon_deg = np.asarray(west + (np.arange(columns) + 0.5) * (width / columns))
    lat_deg = np.asarray(north - (np.arange(rows) + 0.5) * ((north - south) / rows))
    return lon_deg, lat_deg


@contextmanager
def _gdal_errors(path: Path) -> Iterator[None]:
    """Turn GDAL's own errors into ours."""
    from rasterio._err import (
        CPLE_BaseError,
    )  # not made public, and raised for CRSs that PROJ has no way between
    from rasterio.errors import CRSError, RasterioError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of rasters without georeferencing, which we say better ourselves
            yield
    except FieldError:
        raise
    except (CPLE_BaseError, RasterioError, CRSError, OSError, ValueError, MemoryError) as error:
        raise FieldError(
            f"{path}: cannot be read as a raster ({(str(error) or type(error).__name__)[:200]}); give a "
            "GeoTIFF, a NetCDF file, or a heatmap picture with --field-bbox"
        ) from error


def _read_band(path: Path, variable: str | None, *, placed: bool, lazily: bool = False) -> Band:
    import rasterio

    with _gdal_errors(path), rasterio.Env(GDAL_CACHEMAX=GDAL_CACHE_MB), ExitStack() as closing:
        dataset = closing.enter_context(rasterio.open(path))
        if not placed:
            _check_georeferenced(dataset, path)
        elif dataset.crs is not None:
            raise FieldError(f"{path} says itself where it lies; leave --field-bbox out")
        number = _band_number(dataset, variable, path)
        name = dataset.descriptions[number - 1] or f"band {number}"
        source = f"{path}" if dataset.count == 1 else f"{path}: {name}"
        about = (dataset.crs, dataset.transform, _unit_of(dataset, number), source)
        read = partial(_values, dataset, number, path)
        if lazily and dataset.height * dataset.width > LAZY_PIXELS:
            closing.pop_all()  # it stays open as long as the field is there
            return Band(OnFile((dataset.height, dataset.width), read), *about)
        check_pixel_count(dataset.height, dataset.width, str(path))
        return Band(read(slice(0, dataset.height), slice(0, dataset.width)), *about)


def _values(dataset: DatasetReader, number: int, path: Path, rows: slice, columns: slice) -> NDArray[np.float64]:
    """Return a part of a band; gaps are NaN."""
    import rasterio

    with _gdal_errors(path), rasterio.Env(GDAL_CACHEMAX=GDAL_CACHE_MB):
        masked = dataset.read(number, masked=True, window=((rows.start, rows.stop), (columns.start, columns.stop)))
    if masked.dtype.kind not in "iuf":
        raise FieldError(f"{path}: band {number} holds {masked.dtype} values; real numbers are needed")
    raw = np.where(np.ma.getmaskarray(masked), np.nan, masked.data.astype(np.float64))
    return np.asarray(raw * dataset.scales[number - 1] + dataset.offsets[number - 1])


def _check_georeferenced(dataset: DatasetReader, path: Path) -> None:
    if dataset.crs is None and (dataset.gcps[0] or dataset.rpcs):
        raise FieldError(
            f"{path} is placed by ground control points; bring it to longitude and latitude first: "
            "gdalwarp -t_srs EPSG:4326"
        )
    if dataset.crs is None:
        raise FieldError(f"{path} is not georeferenced: it has no CRS; {PLACE_IT}")
    if dataset.transform.is_identity or dataset.transform.is_degenerate:
        raise FieldError(f"{path} is not georeferenced: it has a CRS but no pixel size; {PLACE_IT}")


def _band_number(dataset: DatasetReader, variable: str | None, path: Path) -> int:
    names = [description or "" for description in dataset.descriptions]
    colours = [colour.name for colour in dataset.colorinterp]
    listed = ", ".join(f"{k} {name}".strip() for k, name in enumerate(names, start=1)) or "none"
    if variable is not None:
        wanted = variable.strip().lower()
        named = [k for k, name in enumerate(names, start=1) if name.lower() == wanted and wanted]
        if len(named) == 1:
            return named[0]
        if wanted.isdecimal() and 1 <= int(wanted) <= dataset.count:
            return int(wanted)
        raise FieldError(f"{path} has no band '{variable}'; its bands are: {listed}")
    data = [k for k, colour in enumerate(colours, start=1) if colour != "alpha"]
    if len(data) == 1:
        return data[0]
    if {"red", "green", "blue"} <= set(colours):
        raise FieldError(
            f"{path} is a coloured picture, not values; save it as PNG and give --field-bbox W S E N with "
            "--field-colormap NAME, or choose one band with --variable"
        )
    raise FieldError(f"{path} has {dataset.count} bands; choose one with --variable: {listed}")


def _unit_of(dataset: DatasetReader, number: int) -> str:
    tags = {key.lower(): text for key, text in (dataset.tags() | dataset.tags(number)).items()}
    stated = str(dataset.units[number - 1] or tags.get("units") or tags.get("unit") or "").strip()
    # "1" is the CF convention's word for no dimension; what follows it in brackets is prose.
    return "1" if stated.startswith("1 (") else stated
