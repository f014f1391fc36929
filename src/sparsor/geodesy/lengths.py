"""Geodesic lengths on WGS 84; the only module that asks pyproj."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import AreaError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from pyproj import Geod, Transformer


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


def from_wgs84(lon_deg: ArrayLike, lat_deg: ArrayLike, crs: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points in another reference system, first east then north; the way back of `to_wgs84`.

    Points that have no place there come back as infinities.
    """
    x, y = _to_level(crs).transform(np.asarray(lon_deg, dtype=np.float64), np.asarray(lat_deg, dtype=np.float64))
    return np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)


@cache
def _to_level(crs: str) -> Transformer:
    """Return what brings degrees to a system; of one with heights to its level part: they may need grids."""
    from pyproj import CRS, Transformer

    level = CRS.from_user_input(crs)
    level = level.sub_crs_list[0] if level.is_compound else level.to_2d()
    return Transformer.from_crs("EPSG:4326", level, always_xy=True)


def vertical_of(crs: str) -> tuple[str, float] | None:
    """Return the name of a reference system's heights and the metres of their unit; None where it says nothing of them.

    Examples
    --------
    >>> vertical_of("EPSG:4326") is None, vertical_of("EPSG:4326+5773")
    (True, ('EGM96 height', 1.0))
    """
    from pyproj import CRS

    known = CRS.from_user_input(crs)
    if known.is_compound:
        part = known.sub_crs_list[1]
        return part.name, float(part.axis_info[0].unit_conversion_factor)
    if len(known.axis_info) == 3:
        return f"above the ellipsoid of {known.name}", float(known.axis_info[2].unit_conversion_factor)
    return None


def line_deg(
    start: tuple[float, float], end: tuple[float, float], step_m: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return points along a geodesic, both ends among them, at most a step apart.

    Returns
    -------
    along_m, lon_deg, lat_deg : arrays of float64 (n,)
        n is 2 at least.
    """
    azimuth_deg, _, length_m = wgs84().inv(*start, *end)
    along_m = np.linspace(0.0, length_m, max(int(np.ceil(length_m / step_m)), 1) + 1)
    same = np.ones_like(along_m)
    lon, lat, _ = wgs84().fwd(start[0] * same, start[1] * same, azimuth_deg * same, along_m)
    return along_m, np.asarray(lon, dtype=np.float64), np.asarray(lat, dtype=np.float64)
