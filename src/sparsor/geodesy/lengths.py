"""Geodesic lengths on WGS 84; the only module that asks pyproj."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import AreaError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from pyproj import Geod


@cache
def wgs84() -> Geod:
    """Return the WGS 84 ellipsoid's geodesic solver."""
    from pyproj import Geod

    return Geod(ellps="WGS84")


def distance_m(lon0: ArrayLike, lat0: ArrayLike, lon1: ArrayLike, lat1: ArrayLike) -> NDArray[np.float64]:
    """Return geodesic distances between pairs of points, metres.

    Parameters
    ----------
    lon0, lat0, lon1, lat1 : array_like
        Degrees; broadcast against each other.

    Examples
    --------
    >>> float(distance_m(0, 0, 0, 1).round(3))  # one degree of the meridian at the equator
    110574.389
    """
    arrays = (np.asarray(value, dtype=np.float64) for value in (lon0, lat0, lon1, lat1))
    from_lon, from_lat, to_lon, to_lat = np.broadcast_arrays(*arrays)
    _, _, metres = wgs84().inv(from_lon.ravel(), from_lat.ravel(), to_lon.ravel(), to_lat.ravel())
    return np.asarray(metres, dtype=np.float64).reshape(from_lon.shape)


def path_length_m(lon_deg: ArrayLike, lat_deg: ArrayLike) -> float:
    """Return the geodesic length of an open path through points in order, metres."""
    lon = np.asarray(lon_deg, dtype=np.float64)
    lat = np.asarray(lat_deg, dtype=np.float64)
    return float(distance_m(lon[:-1], lat[:-1], lon[1:], lat[1:]).sum())


def offset_deg(
    lon_deg: ArrayLike, lat_deg: ArrayLike, east_m: ArrayLike, north_m: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the points reached by going a distance east and north along one geodesic, degrees.

    Parameters
    ----------
    lon_deg, lat_deg : array_like
        Starting points.
    east_m, north_m : array_like
        Components of the displacement at the start, metres.
    """
    arrays = (np.asarray(value, dtype=np.float64) for value in (lon_deg, lat_deg, east_m, north_m))
    lon, lat, east, north = np.broadcast_arrays(*arrays)
    azimuth = np.degrees(np.arctan2(east, north))
    end_lon, end_lat, _ = wgs84().fwd(lon.ravel(), lat.ravel(), azimuth.ravel(), np.hypot(east, north).ravel())
    return np.asarray(end_lon).reshape(lon.shape), np.asarray(end_lat).reshape(lon.shape)


def to_wgs84(x: ArrayLike, y: ArrayLike, crs: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return longitudes and latitudes of points given in another reference system, degrees.

    Parameters
    ----------
    x, y : array_like (n,)
        Coordinates, first east then north (or longitude then latitude) whatever the axis order of `crs`.
        Points that have no place on the globe come back as infinities.
    crs : str
        Anything that pyproj understands: "EPSG:32639", WKT.

    Raises
    ------
    AreaError
        When `crs` is not understood.
    """
    from pyproj import Transformer
    from pyproj.exceptions import CRSError

    try:
        lon, lat = Transformer.from_crs(crs, "EPSG:4326", always_xy=True).transform(x, y)
    except CRSError as error:
        raise AreaError(f"the reference system is not understood ({error})") from error
    return np.asarray(lon, dtype=np.float64), np.asarray(lat, dtype=np.float64)
