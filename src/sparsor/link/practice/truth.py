"""The field that the practice sensor flies through, and its file."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import FieldError
from sparsor.link.practice.place import FlatMap
from sparsor.prior.resampling import fill_gaps

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.prior.field import Field

SIDE_M = 8000.0
CELLS = 256
Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class RasterTruth:
    """A field on a raster as a truth to fly through: bilinear between cell centres, its edge beyond.

    Parameters
    ----------
    values : array of float64 (rows, columns)
        s; row 0 northmost.
    box : tuple of float
        West, south, east, north outer edges, degrees; east beyond 180 where it crosses the antimeridian.
    source : str
        Where the values come from, for the file.
    """

    values: NDArray[np.float64]
    box: Box
    source: str = ""

    def __call__(self, lon_deg: float, lat_deg: float) -> float:
        """Return s at a place."""
        west, south, east, north = self.box
        rows, columns = self.values.shape
        from_middle = (lon_deg - (west + east) / 2 + 180.0) % 360.0 - 180.0
        across = (from_middle / (east - west) + 0.5) * columns - 0.5
        down = (north - lat_deg) / (north - south) * rows - 0.5
        across = min(max(across, 0.0), columns - 1.000001)
        down = min(max(down, 0.0), rows - 1.000001)
        left, top = int(across), int(down)
        x, y = across - left, down - top
        corner = self.values[top : top + 2, left : left + 2]
        upper = corner[0, 0] * (1 - x) + corner[0, 1] * x
        lower = corner[1, 0] * (1 - x) + corner[1, 1] * x
        return float(upper * (1 - y) + lower * y)

    def covers(self, lon_deg: float, lat_deg: float) -> bool:
        """Return whether a place lies inside the box."""
        west, south, east, north = self.box
        from_middle = (lon_deg - (west + east) / 2 + 180.0) % 360.0 - 180.0
        return abs(from_middle) <= (east - west) / 2 and south <= lat_deg <= north


def built_in_truth(lon_deg: float, lat_deg: float, side_m: float = SIDE_M, cells: int = CELLS) -> RasterTruth:
    """Return the built-in synthetic field round a place, stretched so that s runs from 0 to 1 over it.

    Raises
    ------
    FieldError
        When the place is not in the built-in field's domain (the Gulf region).
    """
    around = FlatMap(lon_deg, lat_deg)
    west, south = around.degrees(-side_m / 2, -side_m / 2)
    east, north = around.degrees(side_m / 2, side_m / 2)
    return built_in_over((west, south, east, north), cells)


def built_in_over(box: Box, cells: int = CELLS) -> RasterTruth:
    """Return the built-in synthetic field over a box, stretched so that s runs from 0 to 1 over it.

    Raises
    ------
    FieldError
        When the box is not in the built-in field's domain (the Gulf region).
    """
    from sparsor.prior.synthetic import SyntheticField

    values = SyntheticField(0).on_raster(box, (cells, cells))
    return RasterTruth(_stretched(values, "the built-in field"), box, "the built-in synthetic field, seed 0")


def field_truth(field: Field, over: Box | None = None) -> RasterTruth:
    """Return a field as a truth, its values stretched so that s runs from 0 to 1 over all of it.

    Gaps are filled linearly from their rims, and beyond the outermost values by the nearest one.

    Parameters
    ----------
    field : Field
    over : tuple of float, optional
        West, south, east, north: lay the field over this box, as a pattern; default: where it lies. West greater
        than east crosses the antimeridian.

    Raises
    ------
    FieldError
        When the field has one value all over.
    """
    west, south, east, north = over or field.edges_deg
    source = f"{field.source}, laid over another box" if over else field.source
    box = (west, south, east + 360.0 if east < west else east, north)
    return RasterTruth(_stretched(fill_gaps(field.in_memory), field.source), box, source)


def truth_netcdf(truth: RasterTruth, low_ppb: float, high_ppb: float) -> bytes:
    """Return a truth as NetCDF that follows the CF conventions: what an ideal sensor reads, in ppb.

    Parameters
    ----------
    truth : RasterTruth
    low_ppb, high_ppb : float
        Reading where s is 0 and 1.
    """
    import xarray as xr

    west, south, east, north = truth.box
    rows, columns = truth.values.shape
    lon = west + (np.arange(columns) + 0.5) * (east - west) / columns
    lat = north - (np.arange(rows) + 0.5) * (north - south) / rows
    about = {
        "long_name": "what the practice sensor flies through",
        "units": "ppb",
        "actual_range": np.array([low_ppb, high_ppb], dtype=np.float32),
    }
    values = (low_ppb + (high_ppb - low_ppb) * truth.values).astype(np.float32)
    dataset = xr.Dataset(
        {"truth": (("lat", "lon"), values, about)},
        coords={
            "lat": ("lat", lat, {"units": "degrees_north", "standard_name": "latitude"}),
            "lon": ("lon", lon, {"units": "degrees_east", "standard_name": "longitude"}),
        },
        attrs={
            "Conventions": "CF-1.8",
            "title": "Truth of a practice flight",
            "source": f"{truth.source}; made up, not measured over this place",
            "history": f"made by sparsor simulate: {low_ppb:g} + {high_ppb - low_ppb:g} s, s the field's value over "
            "its own range",
        },
    )
    buffer = io.BytesIO()
    dataset.to_netcdf(buffer, engine="h5netcdf", encoding={"truth": {"zlib": True, "_FillValue": np.float32(np.nan)}})
    return buffer.getvalue()


def _stretched(values: NDArray[np.float64], source: str) -> NDArray[np.float64]:
    low, high = float(values.min()), float(values.max())
    if not high > low:
        raise FieldError(f"{source} has the same value, {low:g}, all over: there is nothing to map in it")
    stretched: NDArray[np.float64] = (values - low) / (high - low)
    return stretched
