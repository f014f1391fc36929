"""The coastline of the Gulf region, 40-64 E, 18-34 N; there is none elsewhere.

The data is GSHHG's, full resolution, LGPL-3.0-or-later: see data/README.md and scripts/make_coastline.py.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


class _Lines(NamedTuple):
    """All lines, and the box around each: (n, 4) of west, south, east, north in degrees."""

    lines: list[NDArray[np.float64]]
    bounds_deg: NDArray[np.float64]


def coastline(
    west_deg: float, south_deg: float, east_deg: float, north_deg: float
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return the pieces of coastline inside a box.

    Parameters
    ----------
    west_deg, south_deg, east_deg, north_deg : float
        The box, in degrees.

    Returns
    -------
    list of (array (n,), array (n,))
        Longitudes and latitudes of each piece, cut at the box's edges; an empty list where there is no coast
        or no data.

    Examples
    --------
    >>> len(coastline(0.0, 50.0, 5.0, 55.0))  # the data covers the Gulf, not the North Sea
    0
    """
    import shapely

    stored = _stored()
    west, south, east, north = stored.bounds_deg.T
    near = (west <= east_deg) & (east >= west_deg) & (south <= north_deg) & (north >= south_deg)
    rings = [shapely.LineString(stored.lines[index]) for index in np.flatnonzero(near)]
    inside = shapely.clip_by_rect(rings, west_deg, south_deg, east_deg, north_deg)
    pieces = [shapely.get_coordinates(part) for part in shapely.get_parts(inside)]
    return [(piece[:, 0].copy(), piece[:, 1].copy()) for piece in pieces if len(piece) > 1]


@cache
def _stored() -> _Lines:
    with (files("sparsor.plot") / "data" / "coastline.npz").open("rb") as stream:
        data = np.load(stream, allow_pickle=False)
        points = np.cumsum(data["differences"], axis=0) / int(data["steps_per_degree"])
        starts = data["offsets"]
    low = np.minimum.reduceat(points, starts[:-1])
    high = np.maximum.reduceat(points, starts[:-1])
    return _Lines(np.split(points, starts[1:-1]), np.hstack((low, high)))
