"""Polygons from GeoJSON, KML and the other vector files that GDAL reads."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.errors import AreaError
from sparsor.geodesy.lengths import to_wgs84

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

FORMATS = "give GeoJSON, KML, KMZ or another vector format that GDAL reads"
_A = {"area": "an area", "coastline": "a coastline"}
DEGREES = (None, "EPSG:4326", "OGC:CRS84")


def read_polygons(path: Path, what: str = "area") -> list[tuple[str, Polygon]]:
    """Read every polygon of every layer of a vector file.

    Parameters
    ----------
    path : Path
        The file; points and lines in it are passed over.
    what : str
        What the file is called when something is wrong with it.

    Returns
    -------
    list of (str, Polygon)
        The name of the feature ("" when it has none) and one simple polygon, in degrees of WGS 84 and
        otherwise as it stands in the file. A multipolygon gives as many entries as it has parts.

    Raises
    ------
    AreaError
        When the file is missing, is not a vector file, is empty or holds no polygon.
    """
    if not path.exists():
        raise AreaError(f"there is no {what} file '{path}'; {FORMATS}")
    from shapely import Polygon

    parts = [
        (name, part, crs)
        for name, geometry, crs in _features(path)
        for part in _simple_parts(geometry)
        if not part.is_empty
    ]
    if not parts:
        raise AreaError(f"'{path}' is empty: it holds no geometry; {_A[what]} needs a polygon")
    polygons = [(name, _in_wgs84(path, part, crs)) for name, part, crs in parts if isinstance(part, Polygon)]
    if not polygons:
        kinds = " and ".join(sorted({part.geom_type for _, part, _ in parts}))
        raise AreaError(f"'{path}' holds nothing but {kinds} geometry; {_A[what]} needs a polygon")
    return polygons


def _features(path: Path) -> Iterator[tuple[str, BaseGeometry, str | None]]:
    """Yield the name, geometry and reference system of each feature of each layer (a KML folder is one)."""
    from pyogrio import list_layers, raw
    from pyogrio.errors import DataLayerError, DataSourceError, FieldError, GeometryError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # GDAL's remarks; what matters here is checked here
            layers = [str(name) for name, kind in list_layers(path) if kind is not None]
            contents = [raw.read(path, layer=layer, force_2d=True) for layer in layers]
    except (DataSourceError, DataLayerError, FieldError, GeometryError, UnicodeError) as error:
        reason = str(error).partition("; It might help")[0].rstrip(".")
        raise AreaError(f"'{path}' cannot be read as a vector file ({reason}); {FORMATS}") from error
    for meta, _, geometries, columns in contents:
        names = _names(meta, columns, len(geometries))
        for name, geometry in zip(names, geometries, strict=True):
            if geometry is not None:
                yield name, _decoded(path, geometry), meta["crs"]


def _names(meta: dict[str, Any], columns: Iterable[NDArray[Any]], count: int) -> list[str]:
    for field, column in zip(meta["fields"], columns, strict=True):
        if field.lower() == "name":
            return [value.strip() if isinstance(value, str) else "" for value in column]
    return [""] * count


def _decoded(path: Path, geometry: bytes) -> BaseGeometry:
    import shapely
    from shapely.errors import GEOSException

    try:
        return shapely.from_wkb(geometry)
    except GEOSException as error:
        raise AreaError(
            f"'{path}' holds a damaged polygon ({error}): a ring has at least three corners and ends where it began"
        ) from error


def _simple_parts(geometry: BaseGeometry) -> Iterator[BaseGeometry]:
    for part in getattr(geometry, "geoms", ()):
        yield from _simple_parts(part)
    if not hasattr(geometry, "geoms"):
        yield geometry


def _in_wgs84(path: Path, polygon: Polygon, crs: str | None) -> Polygon:
    import shapely

    if crs in DEGREES:
        return polygon
    west, south, east, north = polygon.bounds
    # A straight edge there is a curved one in degrees: points on the way keep it in its place.
    dense = shapely.segmentize(polygon, max(east - west, north - south) / 16)

    def degrees(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.column_stack(to_wgs84(points[:, 0], points[:, 1], str(crs)))

    try:
        return shapely.transform(dense, degrees)
    except AreaError as error:
        raise AreaError(f"'{path}': {error}") from error
