"""Polygons of fewer corners that hold the one they stand for: never inward."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
import shapely

if TYPE_CHECKING:
    from shapely import Polygon

FIRST_STEP_M = 0.5
MITRE: Literal["mitre"] = "mitre"


def simplified_outward(polygon: Polygon, most: int) -> Polygon:
    """Return a polygon that holds another and has at most so many corners; the same where it has no more.

    Grown by a step and smoothed by as much, with steps that double; at last the convex hull, and the least rectangle
    around it. Holes are filled.

    Parameters
    ----------
    polygon : Polygon
        In metres.
    most : int
        Corners, 4 or more.
    """
    whole = shapely.Polygon(polygon.exterior)
    if corners(whole) <= most:
        return whole
    step_m, largest_m = FIRST_STEP_M, float(np.hypot(*np.ptp(shapely.get_coordinates(whole), axis=0)))
    hull = whole.convex_hull
    # Rounding may leave a corner of it a hair inside.
    box = shapely.oriented_envelope(whole).buffer(1e-3, join_style=MITRE)
    while step_m < 0.25 * largest_m:
        grown = whole.buffer(step_m, join_style=MITRE, mitre_limit=3.0)
        smooth = shapely.Polygon(shapely.get_parts(grown.simplify(step_m))[0].exterior)
        if corners(smooth) <= most and smooth.is_valid and smooth.covers(whole):
            return smooth if smooth.area < box.area else box
        step_m *= 1.5
    if isinstance(hull, shapely.Polygon) and corners(hull) <= most:
        return hull
    return box


def corners(polygon: Polygon) -> int:
    """Return how many corners a polygon has."""
    return len(polygon.exterior.coords) - 1
