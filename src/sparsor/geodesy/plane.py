"""A flat map round a point: metres east and north, good to a few centimetres over some kilometres."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# WGS 84: semi-major axis in metres and first eccentricity squared.
AXIS_M = 6_378_137.0
ECCENTRICITY2 = 6.694379990141e-3


@dataclass(frozen=True)
class LocalPlane:
    """Metres round a point, by the ellipsoid's two radii of curvature there.

    Straight lines on it are straight lines in longitude and latitude, which is how autopilots test fences.

    Parameters
    ----------
    lon_deg, lat_deg : float
        The origin.

    Examples
    --------
    >>> here = LocalPlane(179.999, 10.0)
    >>> here.metres(-179.999, 10.0).round().tolist()
    [219.0, 0.0]
    """

    lon_deg: float
    lat_deg: float

    def metres(self, lon_deg: ArrayLike, lat_deg: ArrayLike) -> NDArray[np.float64]:
        """Return metres east and north of the origin, (..., 2); longitudes the short way round."""
        lon, lat = np.asarray(lon_deg, dtype=np.float64), np.asarray(lat_deg, dtype=np.float64)
        turn = (lon - self.lon_deg + 180.0) % 360.0 - 180.0
        return np.stack(np.broadcast_arrays(turn, lat - self.lat_deg), axis=-1) * self.scale

    def degrees(self, metres: ArrayLike) -> NDArray[np.float64]:
        """Return longitudes (-180..180) and latitudes of places in metres, (..., 2)."""
        moved = np.asarray(metres, dtype=np.float64) / self.scale
        lon = (moved[..., 0] + self.lon_deg + 180.0) % 360.0 - 180.0
        return np.stack([lon, moved[..., 1] + self.lat_deg], axis=-1)

    @property
    def scale(self) -> NDArray[np.float64]:
        """Metres of a degree of longitude and of latitude, (2,)."""
        sine = math.sin(math.radians(self.lat_deg))
        root = math.sqrt(1.0 - ECCENTRICITY2 * sine * sine)
        meridian = AXIS_M * (1.0 - ECCENTRICITY2) / root**3
        parallel = AXIS_M / root * math.cos(math.radians(self.lat_deg))
        return np.radians([parallel, meridian])
