"""A flat map round home: metres east and north of it, good to a few centimetres over a mission's few kilometres."""

from __future__ import annotations

import math
from dataclasses import dataclass

# WGS 84: semi-major axis in metres and first eccentricity squared.
AXIS_M = 6_378_137.0
ECCENTRICITY2 = 6.694379990141e-3


@dataclass(frozen=True)
class FlatMap:
    """Metres round a point, by the ellipsoid's two radii of curvature there.

    Parameters
    ----------
    lon_deg, lat_deg : float
        The origin.

    Examples
    --------
    >>> here = FlatMap(179.999, 10.0)
    >>> east_m, north_m = here.metres(-179.999, 10.0)
    >>> round(east_m), north_m
    (219, 0.0)
    >>> [round(value, 6) for value in here.degrees(east_m, north_m)]
    [-179.999, 10.0]
    """

    lon_deg: float
    lat_deg: float

    def metres(self, lon_deg: float, lat_deg: float) -> tuple[float, float]:
        """Return metres east and north of the origin."""
        per_lon, per_lat = self._metres_per_deg()
        turn = (lon_deg - self.lon_deg + 180.0) % 360.0 - 180.0
        return turn * per_lon, (lat_deg - self.lat_deg) * per_lat

    def degrees(self, east_m: float, north_m: float) -> tuple[float, float]:
        """Return longitude and latitude."""
        per_lon, per_lat = self._metres_per_deg()
        lon = (self.lon_deg + east_m / per_lon + 180.0) % 360.0 - 180.0
        return lon, self.lat_deg + north_m / per_lat

    def _metres_per_deg(self) -> tuple[float, float]:
        sine = math.sin(math.radians(self.lat_deg))
        root = math.sqrt(1.0 - ECCENTRICITY2 * sine * sine)
        meridian = AXIS_M * (1.0 - ECCENTRICITY2) / root**3
        parallel = AXIS_M / root * math.cos(math.radians(self.lat_deg))
        return math.radians(parallel), math.radians(meridian)
