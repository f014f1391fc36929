"""How long the legs between cells take, in the wind."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sparsor.geodesy.lengths import distance_m
from sparsor.geodesy.plane import LocalPlane
from sparsor.vehicle import SteadyWind, Vehicle, ground_speed_m_s, turn_seconds

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.geodesy import Grid
    from sparsor.journeys.preparing import Place

DETOUR_SHARE = 1e-3  # the plane's metres differ from the geodesic's by less
DETOUR_TURNS = 4
NO_WAY_M = 1e8


def leg_seconds_between(
    grid: Grid, length_m: NDArray[np.float64], vehicle: Vehicle, speed_m_s: float, wind: SteadyWind
) -> NDArray[np.float64]:
    """Return the seconds of the legs between all cells, (N, N), the same in both directions.

    The search knows no direction. Of a plane both directions count half: what the wind gives and takes adds up to
    nothing over a flight that comes home, by the wind triangle. A multirotor gains nothing with the wind, so the slower
    direction counts. A plane's turn at the end of a leg is counted as half a circle, the most it can be.
    """
    if wind.speed_m_s == 0 or not vehicle.flies:
        seconds = length_m / speed_m_s
    else:
        columns = grid.shape[1]
        row, column = np.divmod(np.arange(grid.size), columns)
        lat = grid.box.north_deg - (np.arange(grid.shape[0]) + 0.5) * (grid.box.height_deg / grid.shape[0])
        middle = (lat[row][:, None] + lat[row]) / 2
        east = (column - column[:, None]) * (grid.box.width_deg / columns) * np.cos(np.radians(middle))
        north = (row[:, None] - row) * (grid.box.height_deg / grid.shape[0])
        seconds = both_ways(length_m, np.degrees(np.arctan2(east, north)), vehicle, speed_m_s, wind)
    turning_s = turn_seconds(vehicle, math.pi, speed_m_s)
    return np.where(length_m > 0, seconds + turning_s, 0.0) if turning_s else seconds


def home_seconds(
    place: Place, home: tuple[float, float], vehicle: Vehicle, speed_m_s: float, wind: SteadyWind
) -> NDArray[np.float64]:
    """Return the seconds between home and each cell, (N,), as `leg_seconds_between` counts them.

    A way past a keep-out counts as if it were flown against the wind, which is the most it takes.
    """
    lon, lat = place.grid.centres_deg()
    length_m = distance_m(*home, lon, lat)
    east, north = LocalPlane(*home).metres(lon, lat).T
    turning_s = turn_seconds(vehicle, math.pi, speed_m_s)
    straight_s = both_ways(length_m, np.degrees(np.arctan2(east, north)), vehicle, speed_m_s, wind) + turning_s
    if place.zones is None:
        return straight_s
    way_m = place.zones.lengths_m(home, lon, lat)
    round_about = way_m > length_m * (1.0 + DETOUR_SHARE)
    against_m_s = speed_m_s - (wind.speed_m_s if vehicle.flies else 0.0)
    farthest = np.isfinite(way_m)
    # A cell without a way home is as far as no budget reaches.
    slow_s = np.where(farthest, way_m, NO_WAY_M) / against_m_s + DETOUR_TURNS * turning_s
    return np.where(round_about, slow_s, straight_s)


def both_ways(
    length_m: NDArray[np.float64],
    course_deg: NDArray[np.float64],
    vehicle: Vehicle,
    speed_m_s: float,
    wind: SteadyWind,
) -> NDArray[np.float64]:
    """Return the seconds of legs whichever way they are flown, see `leg_seconds_between`."""
    there = length_m / ground_speed_m_s(vehicle, speed_m_s, course_deg, wind)
    back = length_m / ground_speed_m_s(vehicle, speed_m_s, course_deg + 180.0, wind)
    return (there + back) / 2 if vehicle.circles else np.maximum(there, back)
