"""Areas: polygons inside a box, and the grid's cells inside them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from sparsor.errors import AreaError, BoxError
from sparsor.geodesy.box import BoundingBox
from sparsor.geodesy.vectors import read_polygons

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray
    from shapely import LinearRing, MultiPolygon, Polygon

    from sparsor.geodesy.grid import Grid


@dataclass(frozen=True)
class Area:
    """A polygon, perhaps of several parts and with holes, and the box around it (WGS 84).

    Parameters
    ----------
    box : BoundingBox
        The least box that holds the polygon.
    polygon : shapely Polygon or MultiPolygon
        Longitudes and latitudes in degrees. Longitudes begin at the box's west side and run on above 180
        where the area crosses the antimeridian.
    name : str
        The feature's name, or else the file's.
    source : str
        The file it was read from, as given.
    """

    box: BoundingBox
    polygon: Polygon | MultiPolygon
    name: str
    source: str

    @property
    def is_box(self) -> bool:
        """Whether the area is nothing but its box."""
        west, south, east, north = self.polygon.bounds
        return self.polygon.area >= (east - west) * (north - south) * (1 - 1e-9)


def read_area(path: Path) -> Area:
    """Read the polygons of a vector file as one area.

    Every polygon of every layer counts; points and lines beside them do not. Coordinates in another reference
    system are brought to WGS 84. An edge that spans more than 180 degrees of longitude is taken to cross the
    antimeridian, and parts that were cut apart there, as RFC 7946 wants it, are joined again.

    Parameters
    ----------
    path : Path
        GeoJSON, KML, KMZ, or anything else that GDAL reads as vectors.

    Raises
    ------
    AreaError
        When the file is missing, is not a vector file or holds no polygon; when a polygon crosses itself or
        leaves the globe; when the area is too small or too large for a bounding box.
    """
    import shapely

    found = read_polygons(path)
    for _, part in found:
        _check_range(path, part)
    parts = _side_by_side([_unwrapped(path, part) for _, part in found])
    polygon = cast("Polygon | MultiPolygon", shapely.union_all(parts))
    names = {name for name, _ in found}
    name = names.pop() if len(names) == 1 else ""
    return Area(_box_around(path, polygon), polygon, name or path.stem, str(path))


def cells_inside(grid: Grid, area: Area) -> NDArray[np.bool_]:
    """Return which cells of a grid have their centre in an area or on its edge.

    Returns
    -------
    array of bool (N,)
        In the order of the grid's cells.

    Raises
    ------
    AreaError
        When the area holds no cell centre.
    """
    import shapely

    lon, lat = grid.centres_deg()
    lon = np.where(lon < area.box.west_deg, lon + 360.0, lon)
    shapely.prepare(area.polygon)
    inside = np.asarray(shapely.intersects_xy(area.polygon, lon, lat), dtype=np.bool_)
    if not inside.any():
        raise AreaError(
            f"the area '{area.name}' ({area.source}) holds no cell centre of the {grid.shape[0]} x "
            f"{grid.shape[1]} grid: it is thinner than a cell or lies elsewhere; draw it wider"
        )
    return inside


def _check_range(path: Path, polygon: Polygon) -> None:
    import shapely

    points = shapely.get_coordinates(polygon)
    lon, lat = points.T
    # 0..360 is in use as well as -180..180; NaN is in neither.
    wrong = np.flatnonzero(~((np.abs(lat) <= 90.0) & (lon >= -180.0) & (lon <= 360.0)))
    if wrong.size:
        lon_deg, lat_deg = points[wrong[0]]
        raise AreaError(
            f"'{path}' has a point at longitude {lon_deg:g}, latitude {lat_deg:g}; longitudes are -180..180 "
            "and come first, latitudes -90..90; a file in another reference system has to name it"
        )


def _unwrapped(path: Path, polygon: Polygon) -> Polygon:
    """Return the polygon with longitudes that run on across the antimeridian, the west side in -180..180."""
    import shapely

    shell, *holes = (_unwrapped_ring(path, ring) for ring in (polygon.exterior, *polygon.interiors))
    west = shell[:, 0].min()
    shell[:, 0] -= 360.0 * np.floor((west + 180.0) / 360.0)
    for hole in holes:
        hole[:, 0] += 360.0 * np.round((shell[:, 0].mean() - hole[:, 0].mean()) / 360.0)
    whole = shapely.Polygon(shell, holes)
    if not whole.is_valid:
        reason = shapely.is_valid_reason(whole)
        fault = "crosses itself" if "intersection" in reason.lower() else "is no polygon"
        raise AreaError(f"'{path}' holds a polygon that {fault} ({reason}): put its corners in order, or cut it in two")
    return whole


def _unwrapped_ring(path: Path, ring: LinearRing) -> NDArray[np.float64]:
    import shapely

    points = shapely.get_coordinates(ring)
    # Whole turns, not np.unwrap: its sums are rounded, and then a ring no longer ends where it began.
    turns = -np.cumsum(np.round(np.diff(points[:, 0], prepend=points[0, 0]) / 360.0))
    points[:, 0] += 360.0 * turns
    if turns[-1] != 0:
        raise AreaError(f"'{path}' holds a polygon that goes round a pole; grids do not work there")
    return points


def _side_by_side(parts: list[Polygon]) -> list[Polygon]:
    """Return the parts moved by whole turns so that together they span the fewest degrees of longitude."""
    import shapely
    from shapely.affinity import translate

    west, _, east, _ = shapely.bounds(parts).T

    def turns(start: float) -> NDArray[np.float64]:
        return np.where(west < start, 360.0, 0.0)

    start = min(sorted(west), key=lambda start: (east + turns(start)).max() - start)
    return [translate(part, xoff=move) for part, move in zip(parts, turns(start), strict=True)]


def _box_around(path: Path, polygon: Polygon | MultiPolygon) -> BoundingBox:
    west, south, east, north = polygon.bounds
    if east - west > 180.0:
        raise AreaError(f"the area of '{path}' spans {east - west:g} degrees of longitude; the most is 3000 km")
    try:
        return BoundingBox(west, south, east - 360.0 if east > 180.0 else east, north)
    except BoxError as error:
        raise AreaError(f"the area of '{path}' cannot be used: {error}") from error
