"""Which part of the world a mission's picture shows, and how large."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from sparsor.plot.picture import MissionPicture

MAP_WIDTH_IN = 4.45
MAP_HEIGHT_IN = 4.35
# A map much taller or wider than this is given surroundings instead of being drawn as a strip.
MAX_STRETCH = 1.45
MARGIN = 0.035
# What lies further out than this many box sides is not worth shrinking the map for.
REACH = 0.6


@dataclass(frozen=True)
class View:
    """The map's limits in degrees, longitudes running on across the antimeridian, and its size on paper."""

    west_deg: float
    south_deg: float
    east_deg: float
    north_deg: float
    box_west_deg: float
    box_width_deg: float
    width_in: float
    height_in: float
    m_per_deg_lon: float

    @property
    def m_per_inch(self) -> float:
        """Metres on the ground to an inch of the picture, along the box's middle parallel."""
        return (self.east_deg - self.west_deg) * self.m_per_deg_lon / self.width_in

    def unwrapped(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return points (n, 2) with the longitudes nearest to the box's middle meridian."""
        return unwrapped(points, self.box_west_deg + self.box_width_deg / 2)

    def inches(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return points (n, 2), degrees, as inches from the map's lower left corner."""
        span = (self.east_deg - self.west_deg, self.north_deg - self.south_deg)
        from_corner = self.unwrapped(points) - (self.west_deg, self.south_deg)
        return from_corner / span * (self.width_in, self.height_in)

    def degrees(self, inches: ArrayLike) -> NDArray[np.float64]:
        """Return the points (n, 2) that lie some inches from the map's lower left corner, degrees."""
        span = (self.east_deg - self.west_deg, self.north_deg - self.south_deg)
        return np.asarray(inches) / (self.width_in, self.height_in) * span + (self.west_deg, self.south_deg)

    def shows(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return which points (n, 2) lie on the map."""
        inches = self.inches(points)
        inside = (inches >= 0) & (inches <= (self.width_in, self.height_in))
        return np.asarray(inside.all(axis=1), dtype=np.bool_)


def unwrapped(points: ArrayLike, middle_deg: float) -> NDArray[np.float64]:
    """Return points (n, 2) with each longitude moved by whole turns to within 180 degrees of a meridian."""
    moved = np.array(points, dtype=np.float64)
    moved[:, 0] -= 360.0 * np.round((moved[:, 0] - middle_deg) / 360.0)
    return moved


def view_of(picture: MissionPicture) -> View:
    """Return the view that holds the box and what belongs to it.

    What lies up to `REACH` box sides away is shown too; the map gets the aspect of the ground at the box's
    middle parallel, and surroundings where the box alone would be a strip.
    """
    west, south, east, north = picture.box_deg
    width_deg, height_deg = (east - west) % 360.0, north - south
    per_lon, per_lat = picture.east_m / width_deg, picture.north_m / height_deg
    low, high = _extent_m(picture, west + width_deg / 2, np.array([per_lon, per_lat]))
    size = (high - low) * (1 + 2 * MARGIN)
    middle = (low + high) / 2
    aspect = float(np.clip(size[1] / size[0], *_aspects()))
    width_m = max(float(size[0]), float(size[1]) / aspect)
    width_in = min(MAP_WIDTH_IN, MAP_HEIGHT_IN / aspect)
    half = np.array([width_m, width_m * aspect]) / 2
    (left, bottom), (right, top) = (middle - half) / (per_lon, per_lat), (middle + half) / (per_lon, per_lat)
    return View(left, bottom, right, top, west, width_deg, width_in, width_in * aspect, per_lon)


def _aspects() -> tuple[float, float]:
    natural = MAP_HEIGHT_IN / MAP_WIDTH_IN
    return natural / MAX_STRETCH, natural * MAX_STRETCH


def _extent_m(
    picture: MissionPicture, middle_deg: float, per_degree: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the south-west and north-east corner of what is to be shown, in metres of the flat map."""
    half_deg = picture.east_m / per_degree[0] / 2
    low = np.array([middle_deg - half_deg, picture.box_deg[1]]) * per_degree
    high = np.array([middle_deg + half_deg, picture.box_deg[3]]) * per_degree
    reach = REACH * math.hypot(picture.east_m, picture.north_m)
    points = [unwrapped(points, middle_deg) * per_degree for _, points in picture.outlines() if len(points)]
    if not points:
        return low, high
    everything = np.concatenate(points)
    near = everything[np.all((everything >= low - reach) & (everything <= high + reach), axis=1)]
    shown = np.vstack((low, high, near))
    return shown.min(axis=0), shown.max(axis=0)
