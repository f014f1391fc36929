"""The items that each kind of vehicle needs, from the ground and back.

As QGroundControl writes them (TakeoffMissionItem, SpeedSection, FixedWingLandingComplexItem, VTOLLandingComplexItem);
docs/mission-items.md has the tables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.geodesy.lengths import wgs84
from sparsor.mission.items import (
    AIR_SPEED,
    GROUND_SPEED,
    NAV_VTOL_LAND,
    NAV_VTOL_TAKEOFF,
    change_speed,
    land,
    land_start,
    loiter,
    loiter_to_altitude,
    take_off,
    waypoint,
)
from sparsor.vehicle import approach_m, approach_up_m, climb_out_m

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.mission.items import MissionItem
    from sparsor.vehicle import Autopilot, SteadyWind, Vehicle

Point = tuple[float, float]
# Items beside the stops: take-off, speed, way home and landing, or what stands for them.
BESIDE_STOPS = {"quad": 4, "plane": 5, "vtol": 5, "rover": 2, "boat": 2}
# QGroundControl's default pitch of a fixed wing's take-off; PX4 has it as a parameter (FW_TKO_PITCH_MIN).
TAKE_OFF_PITCH_DEG = 15.0
MOST_ARDUPILOT_RADIUS_M = 255.0  # one byte in a waypoint
DECIMALS = 7


@dataclass(frozen=True)
class Ends:
    """Where a plane or a VTOL leaves and comes back.

    Parameters
    ----------
    climb_out : tuple of float
        Longitude and latitude that the take-off climbs towards.
    circle : tuple of float
        Middle of the circle before the last approach.
    touch : tuple of float
        Where the last approach leaves the circle.
    """

    climb_out: Point
    circle: Point
    touch: Point


def flight_items(
    stops: Sequence[tuple[float, float, float]],
    home: Point,
    *,
    vehicle: Vehicle,
    autopilot: Autopilot,
    altitude_m: float,
    speed_m_s: float,
    ends: Ends | None = None,
    outbound: Sequence[Point] = (),
    homebound: Sequence[Point] = (),
) -> tuple[MissionItem, ...]:
    """Return the items of a flight.

    Parameters
    ----------
    stops : sequence of (longitude, latitude, hold)
    home : tuple of float
    vehicle : Vehicle
    autopilot : Autopilot
    altitude_m, speed_m_s : float
    ends : Ends, optional
        Of what circles, see `ends_of`.
    outbound, homebound : sequences of (longitude, latitude)
        Points passed on the way to the first stop and home from the last, round what is kept out of.
    """
    radius_m = vehicle.acceptance_radius_m
    if not autopilot.waypoint_radius:
        # ArduCopter does not store a radius, ArduRover neither; ArduPlane does.
        radius_m = min(radius_m, MOST_ARDUPILOT_RADIUS_M) if vehicle.circles else 0.0

    def passed(point: Point) -> MissionItem:
        return waypoint(*point, altitude_m, 0.0, radius_m, autopilot)

    def visited(lon_deg: float, lat_deg: float, hold_s: float) -> MissionItem:
        if vehicle.circles and hold_s > 0:
            return loiter(lon_deg, lat_deg, altitude_m, hold_s, vehicle.turn_radius_m, autopilot)
        return waypoint(lon_deg, lat_deg, altitude_m, hold_s, radius_m, autopilot)

    speed = change_speed(speed_m_s, AIR_SPEED if vehicle.circles else GROUND_SPEED)
    survey = (*map(passed, outbound), *(visited(*stop) for stop in stops), *map(passed, homebound))
    if not vehicle.flies:
        return (speed, *survey, passed(home))
    if not vehicle.circles:
        return (take_off(*home, altitude_m, autopilot), speed, *survey, passed(home), land(*home, autopilot))
    assert ends is not None
    circle = loiter_to_altitude(*ends.circle, approach_up_m(altitude_m), vehicle.turn_radius_m)
    if vehicle.lifts:
        first = take_off(*home, altitude_m, autopilot, command=NAV_VTOL_TAKEOFF)
        last = land(*home, autopilot, command=NAV_VTOL_LAND)
    else:
        pitch_deg = 0.0 if autopilot.waypoint_radius else TAKE_OFF_PITCH_DEG
        first = take_off(*ends.climb_out, altitude_m, autopilot, pitch_deg=pitch_deg)
        last = land(*home, autopilot)
    return (first, speed, *survey, land_start(), circle, last)


def ends_of(
    home: Point,
    first: Point,
    last: Point,
    *,
    vehicle: Vehicle,
    altitude_m: float,
    wind: SteadyWind,
    turned_deg: float = 0.0,
) -> Ends:
    """Return where a plane or a VTOL climbs out and where it circles before its last approach.

    Both against the wind; without wind, out towards the first place on the way and in from the last one.

    Parameters
    ----------
    home, first, last : tuple of float
        Longitudes and latitudes of home, of the first place flown to and of the last before the landing.
    vehicle : Vehicle
    altitude_m : float
    wind : SteadyWind
    turned_deg : float
        Turns both clockwise, to look for a free place.
    """
    out_deg = wind.from_deg if wind.speed_m_s > 0 else _azimuth_deg(home, first)
    in_from_deg = wind.from_deg + 180.0 if wind.speed_m_s > 0 else _azimuth_deg(home, last)
    out_deg, in_from_deg = out_deg + turned_deg, in_from_deg + turned_deg
    touch = _away(home, in_from_deg, approach_m(vehicle, altitude_m))
    # Clockwise round the middle, the way home leaves the circle with the middle on its right.
    circle = _away(touch, in_from_deg - 90.0, vehicle.turn_radius_m)
    return Ends(_away(home, out_deg, climb_out_m(vehicle, altitude_m)), circle, touch)


def room_of(ends: Ends, vehicle: Vehicle) -> list[Point]:
    """Return points whose hull holds the climb out, the circle and the last approach."""
    radius_m = vehicle.turn_radius_m / np.cos(np.radians(22.5))
    round_it = [_away(ends.circle, 22.5 + 45.0 * corner, float(radius_m)) for corner in range(8)]
    return [ends.touch, *round_it, *([] if vehicle.lifts else [ends.climb_out])]


def _azimuth_deg(start: Point, end: Point) -> float:
    azimuth_deg, _, length_m = wgs84().inv(*start, *end)
    return float(azimuth_deg) if length_m > 0 else 0.0


def _away(start: Point, azimuth_deg: float, length_m: float) -> Point:
    lon, lat, _ = wgs84().fwd(*start, azimuth_deg, length_m)
    return round(float(lon), DECIMALS), round(float(lat), DECIMALS)
