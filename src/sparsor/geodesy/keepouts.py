"""Keep-outs: polygons and circles that may not be flown over."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.errors import AreaError
from sparsor.geodesy.lengths import to_wgs84
from sparsor.geodesy.vectors import DEGREES, FORMATS

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

LARGEST_RADIUS_M = 200_000.0


@dataclass(frozen=True)
class KeepOut:
    """One keep-out.

    Parameters
    ----------
    name : str
        The feature's name, or else the file's and a number.
    lon_deg, lat_deg : tuple of float (n,)
        The corners of a polygon, three or more; or the middle of a circle.
    radius_m : float
        Of a circle; 0 for a polygon.
    """

    name: str
    lon_deg: tuple[float, ...]
    lat_deg: tuple[float, ...]
    radius_m: float = 0.0

    @property
    def is_circle(self) -> bool:
        """Whether it is a circle."""
        return self.radius_m > 0


def read_keep_outs(path: Path) -> list[KeepOut]:
    """Read the keep-outs of a vector file: polygons, and circles as points with a property ``radius_m``.

    A hole in a polygon is kept out of too: nobody gets there.

    Parameters
    ----------
    path : Path
        GeoJSON, KML, KMZ, or anything else that GDAL reads as vectors.

    Raises
    ------
    AreaError
        When the file is missing, no vector file, empty, or holds a line, a point without a radius, or a polygon that
        crosses itself or leaves the globe.
    """
    if not path.exists():
        raise AreaError(f"there is no keep-out file '{path}'; {FORMATS}")
    found: list[KeepOut] = []
    for name, radius, geometry, crs in _features(path):
        for part in _parts(geometry):
            title = name or f"{path.stem} {len(found) + 1}"
            found.append(_keep_out(path, title, radius, part, crs))
    if not found:
        raise AreaError(f"'{path}' is empty: a keep-out is a polygon, or a point with a radius_m")
    return found


def _features(path: Path) -> Iterator[tuple[str, float | None, BaseGeometry, str | None]]:
    """Yield name, radius, geometry and reference system of each feature of each layer."""
    import shapely
    from pyogrio import list_layers, raw
    from pyogrio.errors import DataLayerError, DataSourceError, FieldError, GeometryError
    from shapely.errors import GEOSException

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # GDAL's remarks; what matters here is checked here
            layers = [str(name) for name, kind in list_layers(path) if kind is not None]
            contents = [raw.read(path, layer=layer, force_2d=True) for layer in layers]
        for meta, _, geometries, columns in contents:
            fields = {str(field).lower(): column for field, column in zip(meta["fields"], columns, strict=True)}
            for row, wkb in enumerate(geometries):
                if wkb is not None:
                    name = fields["name"][row] if "name" in fields else None
                    radius = fields["radius_m"][row] if "radius_m" in fields else None
                    title = name.strip() if isinstance(name, str) else ""
                    yield title, _radius(path, title, radius), shapely.from_wkb(wkb), meta["crs"]
    except (DataSourceError, DataLayerError, FieldError, GeometryError, GEOSException, UnicodeError) as error:
        reason = str(error).partition("; It might help")[0].rstrip(".")
        raise AreaError(f"'{path}' cannot be read as a vector file ({reason}); {FORMATS}") from error


def _radius(path: Path, name: str, value: Any) -> float | None:  # noqa: ANN401 (whatever GDAL makes of the property)
    if value is None or value == "" or (isinstance(value, float) and math.isnan(value)):
        return None
    try:
        radius = float(value)
    except (TypeError, ValueError):
        radius = math.nan
    if not 0 < radius <= LARGEST_RADIUS_M:
        raise AreaError(f"'{path}': the radius_m of '{name}' is '{value}'; it has to be 0..{LARGEST_RADIUS_M:g} metres")
    return radius


def _parts(geometry: BaseGeometry) -> Iterator[BaseGeometry]:
    for part in getattr(geometry, "geoms", ()):
        yield from _parts(part)
    if not hasattr(geometry, "geoms") and not geometry.is_empty:
        yield geometry


def _keep_out(path: Path, name: str, radius: float | None, part: BaseGeometry, crs: str | None) -> KeepOut:
    import shapely

    if isinstance(part, shapely.Point) and radius is not None:
        points = _degrees(path, shapely.get_coordinates(part), crs)
        return KeepOut(name, (float(points[0, 0]),), (float(points[0, 1]),), radius)
    if not isinstance(part, shapely.Polygon):
        raise AreaError(
            f"'{path}': '{name}' is a {part.geom_type}; a keep-out is a polygon, or a point with a radius_m in metres"
        )
    if not part.exterior.is_simple or not shapely.Polygon(part.exterior).is_valid:
        raise AreaError(f"'{path}': '{name}' crosses itself; put its corners in order, or cut it in two")
    points = _degrees(path, shapely.get_coordinates(part.exterior)[:-1], crs)
    return KeepOut(name, tuple(points[:, 0].tolist()), tuple(points[:, 1].tolist()))


def _degrees(path: Path, points: NDArray[np.float64], crs: str | None) -> NDArray[np.float64]:
    if crs not in DEGREES:
        try:
            points = np.column_stack(to_wgs84(points[:, 0], points[:, 1], str(crs)))
        except AreaError as error:
            raise AreaError(f"'{path}': {error}") from error
    lon, lat = points.T
    if not np.all((np.abs(lat) <= 89.0) & (lon >= -180.0) & (lon <= 360.0)):
        raise AreaError(
            f"'{path}' has a point off the map; longitudes are -180..180 and come first, latitudes -89..89; a file in "
            "another reference system has to name it"
        )
    return np.column_stack([(lon + 180.0) % 360.0 - 180.0, lat])
