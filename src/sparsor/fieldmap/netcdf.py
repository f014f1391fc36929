"""The map as NetCDF after the CF conventions 1.11."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.fieldmap.fieldmap import FieldMap

WGS84 = {
    "grid_mapping_name": "latitude_longitude",
    "semi_major_axis": 6378137.0,
    "inverse_flattening": 298.257223563,
    "longitude_of_prime_meridian": 0.0,
}


def map_netcdf(field_map: FieldMap) -> bytes:
    """Return a NetCDF 4 file: the map with bounds of its cells, its standard deviation and the measured cells.

    The map's variable has the name of what was measured, the others that name with `_standard_deviation` and
    `_measured`; latitudes run southward. Global attributes say how the map was made.
    """
    import xarray as xr

    dataset = xr.Dataset(
        _variables(field_map),
        coords=_axes(field_map),
        attrs={
            "Conventions": "CF-1.11",
            "title": f"{field_map.quantity} over {field_map.name}, reconstructed from samples of a flight",
            **field_map.facts,
        },
    )
    packed = {name: {"zlib": True, "complevel": 6} for name in dataset.data_vars if dataset[name].ndim == 2}
    plain = {name: {"_FillValue": None} for name in (*dataset.coords, "lon_bnds", "lat_bnds", "crs")}
    stream = io.BytesIO()
    dataset.to_netcdf(stream, engine="h5netcdf", encoding={**plain, **packed})
    return stream.getvalue()


def variable_name(quantity: str) -> str:
    """Return a name for a quantity that CF allows: letters, digits and underscores, a letter first.

    Examples
    --------
    >>> variable_name("NO2S.NO2"), variable_name("2,5")
    ('NO2S_NO2', 'value_2_5')
    """
    name = re.sub(r"[^A-Za-z0-9]+", "_", quantity).strip("_")
    return name if re.match(r"[A-Za-z]", name) else f"value_{name}".rstrip("_")


def _variables(field_map: FieldMap) -> dict[str, Any]:
    from rasterio.crs import CRS

    layers = field_map.layers()
    name = variable_name(field_map.quantity)
    deviation, measured = f"{name}_standard_deviation", f"{name}_measured"
    dims, mapped = ("lat", "lon"), {"grid_mapping": "crs", "cell_methods": "area: mean"}
    lon_edges, lat_edges = layers.edges_deg()
    return {
        name: (
            dims,
            layers.values,
            {
                "long_name": f"mean {field_map.quantity} of the cell",
                "units": field_map.unit,
                "ancillary_variables": f"{deviation} {measured}",
                **mapped,
            },
        ),
        deviation: (
            dims,
            layers.standard_deviation,
            {"long_name": f"standard deviation of {name}", "units": field_map.unit, "grid_mapping": "crs"},
        ),
        measured: (
            dims,
            layers.measured.astype(np.int8),
            {
                "long_name": f"whether the flight measured {name} in the cell",
                "flag_values": np.array([0, 1], dtype=np.int8),
                "flag_meanings": "inferred measured",
                "grid_mapping": "crs",
            },
        ),
        "lon_bnds": (("lon", "bnds"), _bounds(lon_edges)),
        "lat_bnds": (("lat", "bnds"), _bounds(lat_edges)),
        "crs": ((), np.int32(0), {**WGS84, "crs_wkt": CRS.from_epsg(4326).to_wkt()}),
    }


def _axes(field_map: FieldMap) -> dict[str, Any]:
    lon_edges, lat_edges = field_map.layers().edges_deg()
    return {
        "lat": ("lat", _centres(lat_edges), _axis("latitude", "degrees_north", "Y", "lat_bnds")),
        "lon": ("lon", _centres(lon_edges), _axis("longitude", "degrees_east", "X", "lon_bnds")),
    }


def _axis(name: str, unit: str, letter: str, bounds: str) -> dict[str, str]:
    return {"standard_name": name, "long_name": name, "units": unit, "axis": letter, "bounds": bounds}


def _centres(edges: NDArray[np.float64]) -> NDArray[np.float64]:
    return (edges[:-1] + edges[1:]) / 2


def _bounds(edges: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.column_stack((edges[:-1], edges[1:]))
