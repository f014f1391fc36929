"""The items that each kind of vehicle needs, from the ground and back.

As QGroundControl writes them (TakeoffMissionItem, SpeedSection, FixedWingLandingComplexItem, VTOLLandingComplexItem);
docs/mission-items.md has the tables.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
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
from sparsor.mission.triggers import CAMERA
from sparsor.vehicle import approach_m, climb_out_m

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.mission.items import MissionItem
    from sparsor.mission.triggers import Trigger
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


@dataclass(frozen=True)
class Visit:
    """A place on the way between take-off and landing.

    Parameters
    ----------
    lon_deg, lat_deg : float
    altitude_m : float
        Above home.
    hold_s : float
    stop : bool
        Whether something is measured there; else it is only passed.
    """

    lon_deg: float
    lat_deg: float
    altitude_m: float
    hold_s: float = 0.0
    stop: bool = True

    @property
    def place(self) -> Point:
        """Longitude and latitude."""
        return self.lon_deg, self.lat_deg


@dataclass(frozen=True)
class Ascent:
    """The heights above home at which a flight begins and ends, metres.

    Parameters
    ----------
    take_off_m : float
        That the take-off climbs to.
    home_m : float
        Of the waypoint over home before a vertical landing.
    circle_m : float
        Of the circle before the last approach of a plane or a VTOL.
    """

    take_off_m: float
    home_m: float
    circle_m: float


def flight_items(
    visits: Sequence[Visit],
    home: Point,
    *,
    vehicle: Vehicle,
    autopilot: Autopilot,
    ascent: Ascent,
    speed_m_s: float,
    ends: Ends | None = None,
    triggers: Sequence[Trigger] = (),
) -> tuple[tuple[MissionItem, ...], tuple[int, ...]]:
    """Return the items of a flight, and the indices of those that are only passed.

    Parameters
    ----------
    visits : sequence of Visit
        Stops, and the points passed on the way to the first one, between them and home from the last.
    home : tuple of float
    vehicle : Vehicle
    autopilot : Autopilot
    ascent : Ascent
    speed_m_s : float
    ends : Ends, optional
        Of what circles, see `ends_of`.
    triggers : sequence of Trigger
        Switched on and off at the stops that are waited at; a camera after the first stop and after the last.
    """
    radius_m = vehicle.acceptance_radius_m
    if not autopilot.waypoint_radius:
        # ArduCopter does not store a radius, ArduRover neither; ArduPlane does.
        radius_m = min(radius_m, MOST_ARDUPILOT_RADIUS_M) if vehicle.circles else 0.0

    def visited(visit: Visit) -> MissionItem:
        if vehicle.circles and visit.hold_s > 0:
            return loiter(*visit.place, visit.altitude_m, visit.hold_s, vehicle.turn_radius_m, autopilot)
        return waypoint(*visit.place, visit.altitude_m, visit.hold_s, radius_m, autopilot)

    speed = change_speed(speed_m_s, AIR_SPEED if vehicle.circles else GROUND_SPEED)
    before, after = _around(home, vehicle, autopilot, ascent, ends)
    over_home = () if vehicle.circles else (visited(Visit(*home, ascent.home_m, stop=False)),)
    survey: list[MissionItem] = []
    passing: list[int] = []
    switched = [one for one in triggers if one.kind != CAMERA]
    along = [one for one in triggers if one.kind == CAMERA]
    stop, last = 0, sum(visit.stop for visit in visits)
    for visit in visits:
        stop += visit.stop
        if not visit.stop:
            passing.append(len(before) + 1 + len(survey))
        if switched and visit.stop and visit.hold_s > 0:
            arrival = visited(replace(visit, hold_s=0.0))
            survey += [arrival, *(one.item(on=True, stop=stop) for one in switched)]
            survey += [visited(visit), *(one.item(on=False, stop=stop) for one in switched)]
        else:
            survey.append(visited(visit))
        if visit.stop and stop in (1, last):
            survey += [one.item(on=stop < last, stop=stop) for one in along]
    return (*before, speed, *survey, *over_home, *after), tuple(passing)


def _around(
    home: Point, vehicle: Vehicle, autopilot: Autopilot, ascent: Ascent, ends: Ends | None
) -> tuple[tuple[MissionItem, ...], tuple[MissionItem, ...]]:
    """Return the items before and after what is flown at the flight's height."""
    if not vehicle.flies:
        return (), ()
    if not vehicle.circles:
        return (take_off(*home, ascent.take_off_m, autopilot),), (land(*home, autopilot),)
    assert ends is not None
    circle = loiter_to_altitude(*ends.circle, ascent.circle_m, vehicle.turn_radius_m)
    if vehicle.lifts:
        first = take_off(*home, ascent.take_off_m, autopilot, command=NAV_VTOL_TAKEOFF)
        last = land(*home, autopilot, command=NAV_VTOL_LAND)
    else:
        pitch_deg = 0.0 if autopilot.waypoint_radius else TAKE_OFF_PITCH_DEG
        first = take_off(*ends.climb_out, ascent.take_off_m, autopilot, pitch_deg=pitch_deg)
        last = land(*home, autopilot)
    return (first,), (land_start(), circle, last)


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
