"""The inclusion fence around a flight."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from shapely import MultiPoint, area, get_coordinates, orient_polygons, polygons

from sparsor.errors import MissionError
from sparsor.geodesy.box import wrap_longitude
from sparsor.geodesy.lengths import distance_m, wgs84
from sparsor.mission.plan import Fence

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# Least lengths of a degree on WGS 84: of latitude, at the equator; of longitude, times cos(latitude).
LAT_DEGREE_M = 110_574.0
LON_DEGREE_M = 111_319.0
# Fits every board's store of fence points, PX4's small ones too, with room for fences of the pilot's own.
MAX_CORNERS = 16
# A side is dropped anyway where that adds less than this share of the area: a fence of few corners is read.
MERGE_SHARE = 1e-3
# Corners are written to 1e-7 degrees, about a centimetre.
ROUNDING_M = 0.05
# A geodesic of this length leaves its chord in the longitude-latitude plane by well under the margin.
SEGMENT_M = 2000.0


def fence_around(lon_deg: ArrayLike, lat_deg: ArrayLike, margin_m: float, max_corners: int = MAX_CORNERS) -> Fence:
    """Return the inclusion fence around a path, with a margin everywhere.

    The convex hull of the path grown by the margin, in the longitude-latitude plane, which is where both
    autopilots test it. Corners run counter-clockwise. A path across the antimeridian gives corners on both
    sides of it.

    Parameters
    ----------
    lon_deg, lat_deg : array_like (n,)
        The path in flight order, home included; one point is enough.
    margin_m : float
        Least geodesic distance between the path and the fence, metres; 1 or above.
    max_corners : int
        Most corners, 5 or above. A finer hull loses corners outwards, never inwards.

    Raises
    ------
    MissionError
        When the margin is below 1 m, or when the fence would reach a pole or round the world.

    Examples
    --------
    >>> fence = fence_around([51.5, 51.53], [25.27, 25.30], margin_m=50)
    >>> len(fence.lon_deg) <= 16, min(fence.lon_deg) < 51.4995, max(fence.lat_deg) > 25.3004
    (True, True, True)
    """
    if not (math.isfinite(margin_m) and margin_m >= 1):
        raise MissionError(f"a fence margin of {margin_m:g} m; allowed is 1 m or more")
    lon, lat = _along_path(np.asarray(lon_deg, dtype=np.float64), np.asarray(lat_deg, dtype=np.float64))
    origin = float(lon[0])
    lon = (lon - origin + 180.0) % 360.0 - 180.0  # degrees east of the first point, across the antimeridian too
    grown_m = margin_m + ROUNDING_M
    highest_deg = float(np.abs(lat).max()) + 2 * grown_m / LAT_DEGREE_M
    if highest_deg >= 90 or float(np.ptp(lon)) > 170:
        raise MissionError("a fence cannot reach over a pole or round the world; fly a smaller area")
    # Where a degree of longitude is shortest, so that the margin holds wherever it is longer.
    scale = np.array([LON_DEGREE_M * math.cos(math.radians(highest_deg)), LAT_DEGREE_M])
    corners = _drop_corners(_grown_hull(np.column_stack([lon, lat]) * scale, grown_m), max_corners) / scale
    return Fence(
        tuple(round(wrap_longitude(float(east) + origin), 7) for east in corners[:, 0]),
        tuple(round(float(north), 7) for north in corners[:, 1]),
    )


def _along_path(lon: NDArray[np.float64], lat: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Add points along the long legs: a geodesic bulges out of the straight line between its ends."""
    points = [np.array([lon, lat])]
    lengths = distance_m(lon[:-1], lat[:-1], lon[1:], lat[1:])
    for leg in np.flatnonzero(lengths > SEGMENT_M):
        between = math.ceil(lengths[leg] / SEGMENT_M) - 1
        ends = (float(lon[leg]), float(lat[leg]), float(lon[leg + 1]), float(lat[leg + 1]))
        points.append(np.array(wgs84().npts(*ends, between)).T)
    together = np.concatenate(points, axis=1)
    return together[0], together[1]


def _grown_hull(points_m: NDArray[np.float64], margin_m: float) -> NDArray[np.float64]:
    """Return the corners of hull + octagon around a circle of the margin, counter-clockwise, (n, 2)."""
    angle = np.radians(22.5 + 45.0 * np.arange(8))
    octagon = np.column_stack([np.cos(angle), np.sin(angle)]) * (margin_m / math.cos(math.radians(22.5)))
    # The hull of a sum is the sum of the hulls; it works for one point and for points in a line alike.
    hull = MultiPoint((points_m[:, None, :] + octagon).reshape(-1, 2)).convex_hull
    return get_coordinates(orient_polygons(hull))[:-1]


def _drop_corners(corners: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    """Replace sides by the meeting point of their neighbours, the least added area first, down to `most`.

    A convex polygon of five or more corners always has such a side, so no other shape is ever needed.
    """
    small = MERGE_SHARE * float(area(polygons(corners)))
    while len(corners) > 4:
        added = [_meeting(corners, side) for side in range(len(corners))]
        side = min(range(len(corners)), key=lambda index: added[index][0])
        if len(corners) <= most and added[side][0] > small:
            break
        kept = np.delete(corners, (side + 1) % len(corners), axis=0)
        kept[side if side + 1 < len(corners) else side - 1] = added[side][1]
        corners = kept
    return corners


def _meeting(corners: NDArray[np.float64], side: int) -> tuple[float, NDArray[np.float64]]:
    """Return the area added by drawing out the neighbours of a side until they meet, and where they do."""
    before, start, end, after = (corners[(side + step) % len(corners)] for step in (-1, 0, 1, 2))
    first, second, base = start - before, end - after, end - start
    turn = float(first[0] * second[1] - first[1] * second[0])
    if turn >= 0:  # they run apart, or alongside
        return math.inf, start
    reach = float(base[0] * second[1] - base[1] * second[0]) / turn
    point = start + reach * first
    return abs(float(base[0] * (point - start)[1] - base[1] * (point - start)[0])) / 2, point
