"""Land or sea alone: which side of a coastline may be flown over, with the coastline's accuracy as a margin."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
import shapely

from sparsor.geodesy.barred import Barred, widened
from sparsor.geodesy.zones import bulge_m

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from shapely.geometry.base import BaseGeometry

    from sparsor.geodesy.box import BoundingBox
    from sparsor.geodesy.land import Land
    from sparsor.geodesy.plane import LocalPlane

Side = Literal["land", "sea"]
OTHER: Final[dict[Side, Side]] = {"land": "sea", "sea": "land"}
SMOOTHED = 0.05  # of the margin: by so much it is larger than asked for, so that it has fewer corners
SMOOTHED_OF_BOX = 1e-4  # of the box's diagonal: the same, where cells are of kilometres
RADII = 1.005  # the ellipsoid's radii of curvature over the latitudes of any box, from those at its middle
SPARE_M = 100.0  # of what is added to the margin
METRES_PER_DEGREE = 110_000.0  # of latitude, at least


@dataclass(frozen=True)
class Shore(Barred):
    """The side of a coastline that is not flown over.

    Its `area` is the other side and the margin, cut some margins around the box.

    Parameters
    ----------
    side : str
        ``"land"`` or ``"sea"``: what may be flown over.
    land : geometry
        In the plane's metres, as the coastline has it.
    margin_m : float
        The accuracy of the coastline: nothing comes nearer to the other side.
    source : str
        Whose coastline it is.
    """

    side: Side
    land: BaseGeometry
    margin_m: float
    source: str

    def asked_for(self, lon_deg: ArrayLike, lat_deg: ArrayLike) -> NDArray[np.bool_]:
        """Return which places lie on the side that is asked for, by the coastline itself."""
        shapely.prepare(self.land)
        east, north = np.moveaxis(self.plane.metres(lon_deg, lat_deg), -1, 0)
        ashore = np.asarray(shapely.intersects_xy(self.land, east, north), dtype=np.bool_)
        return ashore if self.side == "land" else ~ashore

    def crosses_other_side(self, points: ArrayLike) -> bool:
        """Return whether a path of places, (n, 2), passes over the other side by the coastline itself."""
        way = shapely.LineString(self.plane.metres(*np.transpose(points)))
        return bool(self.land.intersects(way) if self.side == "sea" else not self.land.covers(way))


def reach_deg(box: BoundingBox, margin_m: float) -> tuple[float, float]:
    """Return how far around a box the land has to be known for its margin, degrees of longitude and latitude."""
    up = (3.0 * margin_m + SPARE_M) / METRES_PER_DEGREE
    farthest = max(abs(box.south_deg), abs(box.north_deg)) + up
    return up / math.cos(math.radians(farthest)), up


def shore_of(land: Land, side: Side, *, box: BoundingBox, plane: LocalPlane, margin_m: float) -> Shore:
    """Return the side that is not flown over.

    Parameters
    ----------
    land : Land
        In and around the box, as far as `reach_deg` says.
    side : str
        That is flown over.
    box : BoundingBox
    plane : LocalPlane
        Round the middle of the box.
    margin_m : float
        The coastline's accuracy: least distance of a leg from the other side.
    """
    # The plane's metres are those of its middle: nearer a pole a metre of it, east-west, is less than one.
    middle = math.cos(math.radians(plane.lat_deg))
    farthest = max(abs(box.south_deg), abs(box.north_deg))
    stretch = RADII * max(1.0, middle / math.cos(math.radians(farthest)))
    grown_m = (margin_m + bulge_m(float(np.hypot(box.east_m, box.north_m)), plane.lat_deg)) * stretch
    ground = shapely.transform(land.polygons, lambda points: plane.metres(*points.T))
    across, up = reach_deg(box, margin_m)
    west, south = plane.metres(box.west_deg - across, box.south_deg - up)
    east, north = -west, plane.metres(plane.lon_deg, box.north_deg + up)[1]
    frame = shapely.box(west, south, east, north)
    other = ground if side == "sea" else frame.difference(ground)
    step_m = max(SMOOTHED * grown_m, SMOOTHED_OF_BOX * float(np.hypot(box.east_m, box.north_m))) / 2
    # Each of the two simplifications moves an edge by a step at most: the two that are added hold what was there.
    coarse = shapely.make_valid(other.simplify(step_m))
    margin = widened(coarse, grown_m + 2 * step_m).simplify(step_m)
    return Shore(plane, margin.intersection(frame), side, ground, margin_m, land.source)
