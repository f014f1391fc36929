"""Ground that may not be flown over, on a plane round the mission."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from shapely.geometry.base import BaseGeometry

    from sparsor.geodesy.plane import LocalPlane

QUARTER = 4  # sides of a quarter of a rounded margin


@dataclass(frozen=True)
class Barred:
    """Ground that no stop and no leg touches.

    Parameters
    ----------
    plane : LocalPlane
        In whose metres `area` is; straight lines there are straight in longitude and latitude.
    area : geometry
        With every margin.
    """

    plane: LocalPlane
    area: BaseGeometry

    def holds(self, lon_deg: ArrayLike, lat_deg: ArrayLike) -> NDArray[np.bool_]:
        """Return whether places lie on it."""
        east, north = np.moveaxis(self.plane.metres(lon_deg, lat_deg), -1, 0)
        return np.asarray(shapely.intersects_xy(self._prepared, east, north), dtype=np.bool_)

    def crossed(self, lon0: ArrayLike, lat0: ArrayLike, lon1: ArrayLike, lat1: ArrayLike) -> NDArray[np.bool_]:
        """Return whether legs cross it, (n,)."""
        ends = np.stack([self.plane.metres(lon0, lat0), self.plane.metres(lon1, lat1)], axis=-2)
        return np.asarray(shapely.intersects(self._prepared, shapely.linestrings(ends)), dtype=np.bool_)

    @cached_property
    def _prepared(self) -> BaseGeometry:
        shapely.prepare(self.area)
        return self.area


def widened(shape: BaseGeometry, margin_m: float) -> BaseGeometry:
    """Return a shape, in metres, grown by a margin at least; its corners are rounded by sides that lie outside of it.

    GEOS rounds the number of sides of a corner, so that a side may take one and a half times the angle asked for: the
    middle of a side is then nearer to the corner than its ends by the cosine of half of that.
    """
    return shape.buffer(margin_m / math.cos(1.5 * math.pi / (4 * QUARTER)), quad_segs=QUARTER)
