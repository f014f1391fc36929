"""Ground that may not be flown over, on a plane round the mission."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from shapely.geometry.base import BaseGeometry

    from sparsor.geodesy.plane import LocalPlane


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
