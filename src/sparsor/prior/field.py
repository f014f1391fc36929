"""A field of values over a regular longitude-latitude raster."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import EmptyFieldError, FieldError
from sparsor.prior.raster import LazyRaster, OnFile

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

MAX_PIXELS = 60_000_000


@dataclass(frozen=True)
class Field:
    """Values on a raster that is regular in degrees.

    Parameters
    ----------
    values : array of float64 (rows, columns), or LazyRaster
        Row 0 is the northmost; gaps are NaN. Lazy values are read as windows are cut from them.
    lon_deg : array of float64 (columns,)
        Pixel centres, ascending by a constant step; may run beyond 180 where the raster crosses the
        antimeridian.
    lat_deg : array of float64 (rows,)
        Pixel centres, descending by a constant step.
    unit : str
        Of the values, as the file states it; ``""`` when it does not.
    source : str
        Where the values come from, for provenance.
    notes : tuple of str
        What was assumed or lost when reading, one sentence each, to be said aloud.

    Raises
    ------
    FieldError
        When shapes disagree, a coordinate is not regular, or there is not one finite value.
    """

    values: NDArray[np.float64] | LazyRaster
    lon_deg: NDArray[np.float64]
    lat_deg: NDArray[np.float64]
    unit: str
    source: str
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        rows, columns = self.lat_deg.size, self.lon_deg.size
        if self.values.shape != (rows, columns):
            raise FieldError(
                f"{self.source}: values of shape {self.values.shape} do not fit {rows} latitudes and "
                f"{columns} longitudes"
            )
        if rows < 2 or columns < 2:
            raise FieldError(f"{self.source}: a field of {rows} x {columns} pixels is too small; 2 x 2 is the least")
        _check_regular(self.lon_deg, "longitudes", 1, self.source)
        _check_regular(self.lat_deg, "latitudes", -1, self.source)
        # Whether a lazy raster is empty its windows will tell.
        if isinstance(self.values, np.ndarray) and not np.isfinite(self.values).any():
            raise EmptyFieldError(
                f"{self.source}: the field is empty: not one of its {self.values.size} values is finite; "
                "give a raster with data, and check its no-data value"
            )

    @property
    def pixel_deg(self) -> tuple[float, float]:
        """Width and height of a pixel, degrees."""
        width = (self.lon_deg[-1] - self.lon_deg[0]) / (self.lon_deg.size - 1)
        height = (self.lat_deg[0] - self.lat_deg[-1]) / (self.lat_deg.size - 1)
        return float(width), float(height)

    @property
    def edges_deg(self) -> tuple[float, float, float, float]:
        """West, south, east, north outer edges of the outer pixels, degrees."""
        half_width, half_height = (side / 2 for side in self.pixel_deg)
        return (
            float(self.lon_deg[0]) - half_width,
            float(self.lat_deg[-1]) - half_height,
            float(self.lon_deg[-1]) + half_width,
            float(self.lat_deg[0]) + half_height,
        )

    def west_of(self, pixels: float) -> Field:
        """Return the part west of a line, `pixels` from the west edge; pixels on the line are left out."""
        columns = int(pixels + 1e-6)
        values = self.values
        values = values.west_part(columns) if isinstance(values, LazyRaster) else values[:, :columns]
        return replace(self, values=values, lon_deg=self.lon_deg[:columns])

    @property
    def gap_fraction(self) -> float:
        """Share of the pixels without a finite value."""
        return float(1.0 - np.isfinite(self.in_memory).mean())

    @property
    def in_memory(self) -> NDArray[np.float64]:
        """All values.

        Raises
        ------
        FieldError
            When there are too many.
        """
        if isinstance(self.values, LazyRaster):
            check_pixel_count(*self.values.shape, self.source)
        return self.values[:, :]


def field_on_axes(
    values: ArrayLike | OnFile,
    lon_deg: ArrayLike,
    lat_deg: ArrayLike,
    *,
    unit: str,
    source: str,
    notes: tuple[str, ...] = (),
) -> Field:
    """Return the field of values on axes as files have them: either direction, -180..180 or 0..360.

    Parameters
    ----------
    values : array_like (rows, columns), or OnFile
        Infinite values become gaps.
    lon_deg : array_like (columns,)
        Pixel centres, west to east or east to west; the seam may lie anywhere.
    lat_deg : array_like (rows,)
        Pixel centres, north to south or south to north.
    unit, source, notes
        As in `Field`.

    Raises
    ------
    FieldError
        When the axes are not regular, leave -90..90, or the values are all gaps.

    Examples
    --------
    >>> field = field_on_axes([[1, 2], [3, 4]], [200, 201], [10, 11], unit="ppb", source="example")
    >>> field.lon_deg.tolist(), field.lat_deg.tolist(), field.values.tolist()
    ([-160.0, -159.0], [11.0, 10.0], [[3.0, 4.0], [1.0, 2.0]])
    """
    lon = np.unwrap(np.asarray(lon_deg, dtype=np.float64), period=360.0)
    lat = np.asarray(lat_deg, dtype=np.float64)
    if not (np.isfinite(lon).all() and np.isfinite(lat).all() and np.abs(lat).max(initial=0.0) <= 90.001):
        raise FieldError(
            f"{source}: its latitudes or longitudes are not degrees (latitudes of -90..90 are); "
            "reproject it first, e.g. with gdalwarp -t_srs EPSG:4326"
        )
    rows, columns = np.arange(lat.size), np.arange(lon.size)
    if lon.size > 1 and lon[0] > lon[-1]:
        columns, lon = columns[::-1], lon[::-1]
    if lat.size > 1 and lat[0] < lat[-1]:
        rows, lat = rows[::-1], lat[::-1]
    columns, lon = _from_antimeridian(columns, lon)
    if isinstance(values, OnFile):
        return Field(LazyRaster(values.read, rows, columns, values.block), lon.copy(), lat.copy(), unit, source, notes)
    array = np.asarray(values, dtype=np.float64)
    array = np.where(np.isfinite(array), array, np.nan)
    if array.shape == (rows.size, np.asarray(lon_deg).size):  # else the field says that they do not fit
        array = np.ascontiguousarray(array[np.ix_(rows, columns)])
    return Field(array, lon.copy(), lat.copy(), unit, source, notes)


def check_pixel_count(rows: int, columns: int, source: str) -> None:
    """Refuse a raster that would not fit into memory, before it is read.

    Raises
    ------
    FieldError
        Above `MAX_PIXELS`.
    """
    if rows * columns > MAX_PIXELS:
        raise FieldError(
            f"{source}: {columns} x {rows} pixels are more than the {MAX_PIXELS // 1_000_000} million that "
            "are read at once; cut out the part around your box first, e.g. with "
            "gdal_translate -projwin W N E S"
        )


def _from_antimeridian(
    columns: NDArray[np.int64], lon: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Begin in -180..180; a raster all round the world begins at its first pixel east of -180."""
    if lon.size < 2:
        return columns, lon
    step = (lon[-1] - lon[0]) / (lon.size - 1)
    round_the_world = round(360.0 / step) if step > 0 else 0
    if lon.size >= round_the_world > 1 and abs(round_the_world * step - 360.0) < step / 2:
        columns, lon = columns[:round_the_world], lon[:round_the_world]  # some files repeat the first column
        first = int(np.argmin((lon + 180.0 + step * 1e-6) % 360.0))
        columns = np.roll(columns, -first)
        lon = lon - lon[0] + (lon[first] + 180.0 + step * 1e-6) % 360.0 - 180.0 - step * 1e-6
        return columns, lon
    turns = np.floor((lon[0] + 180.0 + step * 1e-6) / 360.0)
    # A turn back only when the raster begins beyond the antimeridian: 170..190 stays as it is.
    return columns, lon - 360.0 * turns


def _check_regular(coordinate: NDArray[np.float64], name: str, sign: int, source: str) -> None:
    steps = np.diff(coordinate) * sign
    mean = steps.mean()
    # Files often store coordinates in single precision: 1e-3 of a step is far below a pixel.
    if not (mean > 0 and np.abs(steps - mean).max() <= 1e-3 * mean + 4e-5):
        raise FieldError(
            f"{source}: {name} are not evenly spaced (steps of {steps.min():g} to {steps.max():g} degrees); "
            "resample the field to a regular longitude-latitude raster first, e.g. with gdalwarp"
        )
