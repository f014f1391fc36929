"""Land: the packaged coastline of the Gulf region, or polygons from a file, cut to a box."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from importlib.resources import files
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sparsor.errors import AreaError
from sparsor.geodesy.vectors import read_polygons

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from sparsor.geodesy.box import BoundingBox

# Of the World Vector Shoreline, which GSHHG's shorelines are: "90% of all identifiable shoreline features be located
# within 500 meters ... of their true geographic positions". See data/README.md.
PACKAGED_ACCURACY_M = 500.0
PACKAGED = "GSHHG 2.3.6, full resolution, LGPL-3.0-or-later"


class _Stored(NamedTuple):
    """The packaged land: polygons, and the region that they cover, degrees."""

    polygons: NDArray[Any]
    region_deg: tuple[float, float, float, float]


@dataclass(frozen=True)
class Land:
    """The land in and around a box.

    Parameters
    ----------
    polygons : geometry
        Degrees; longitudes begin west of the box and run on across the antimeridian. Cut at `reach_deg` around the box.
    source : str
        Whose coastline it is, for people.
    """

    polygons: BaseGeometry
    source: str


def packaged_land(box: BoundingBox, reach_deg: tuple[float, float]) -> Land:
    """Return the packaged land in and around a box.

    Parameters
    ----------
    box : BoundingBox
    reach_deg : tuple of float
        How far around it, in longitude and in latitude.

    Raises
    ------
    AreaError
        When the box or what is around it leaves the region that there is a coastline of.
    """
    stored = _stored()
    west, south, east, north = stored.region_deg
    across, up = reach_deg
    inside = (
        box.west_deg < box.east_deg
        and box.west_deg - across >= west
        and box.east_deg + across <= east
        and box.south_deg - up >= south
        and box.north_deg + up <= north
    )
    if not inside:
        sides = " ".join(f"{side:g}" for side in box.as_tuple())
        raise AreaError(
            f"the packaged coastline is that of {west:g}..{east:g} E, {south:g}..{north:g} N; the box {sides} and "
            f"{across:.2g} x {up:.2g} degrees around it are not wholly within: give --coastline FILE, polygons of land "
            "such as GSHHG's or OpenStreetMap's"
        )
    return Land(_cut(stored.polygons, box, reach_deg), PACKAGED)


def land_of_file(path: Path, box: BoundingBox, reach_deg: tuple[float, float]) -> Land:
    """Return the polygons of a vector file, as land, in and around a box.

    Raises
    ------
    AreaError
        When the file is missing, no vector file, or holds no polygon; when a polygon at the box crosses itself.
    """
    import shapely

    found = np.array([polygon for _, polygon in read_polygons(path, "coastline")], dtype=object)
    near = _near(found, box, reach_deg)
    if not shapely.is_valid(near).all():
        reason = shapely.is_valid_reason(near[~shapely.is_valid(near)])[0]
        raise AreaError(
            f"'{path}' holds a polygon that crosses itself or is none ({reason}): mend it, as ogr2ogr -makevalid does"
        )
    return Land(_cut(near, box, reach_deg), path.name)


def _frame(box: BoundingBox, reach_deg: tuple[float, float]) -> tuple[float, float, float, float]:
    across, up = reach_deg
    west = box.west_deg - across
    return west, box.south_deg - up, west + box.width_deg + 2 * across, box.north_deg + up


def _near(polygons: NDArray[Any], box: BoundingBox, reach_deg: tuple[float, float]) -> NDArray[Any]:
    """Return the polygons that reach into the frame round a box, moved by whole turns to where they do."""
    import shapely

    west, south, east, north = _frame(box, reach_deg)
    bounds = shapely.bounds(polygons)
    found: list[NDArray[Any]] = []
    for turn in (-360.0, 0.0, 360.0):
        hit = (bounds[:, 0] + turn <= east) & (bounds[:, 2] + turn >= west)
        hit &= (bounds[:, 1] <= north) & (bounds[:, 3] >= south)
        moved = np.array([turn, 0.0])
        found.append(shapely.transform(polygons[hit], partial(np.add, moved)))
    return np.concatenate(found)


def _cut(polygons: NDArray[Any], box: BoundingBox, reach_deg: tuple[float, float]) -> BaseGeometry:
    import shapely

    near = _near(polygons, box, reach_deg)
    return shapely.union_all(shapely.clip_by_rect(near, *_frame(box, reach_deg)))


@cache
def _stored() -> _Stored:
    import shapely

    with (files("sparsor.geodesy") / "data" / "land.npz").open("rb") as stream:
        data = np.load(stream, allow_pickle=False)
        points = np.cumsum(data["differences"], axis=0) / int(data["steps_per_degree"])
        offsets = data["offsets"]
        west, south, east, north = (float(side) for side in data["region_deg"])
    index = np.repeat(np.arange(offsets.size - 1), np.diff(offsets))
    rings = shapely.linearrings(points, indices=index)
    return _Stored(np.asarray(shapely.polygons(rings), dtype=object), (west, south, east, north))
