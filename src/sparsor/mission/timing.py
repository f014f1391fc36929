"""How long a plan takes, item by item, and what that takes out of the battery."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.geodesy.lengths import wgs84
from sparsor.mission.items import (
    DO_CHANGE_SPEED,
    FLOWN_TO,
    FRAME_RELATIVE,
    LANDINGS,
    NAV_DELAY,
    NAV_LOITER_TO_ALT,
    NAV_LOITER_TURNS,
    NAV_RETURN_TO_LAUNCH,
    POSITION_OPTIONAL,
    TAKE_OFFS,
)
from sparsor.vehicle import CALM, SteadyWind, Vehicle, ground_speed_m_s, landing_seconds, stop_seconds, turn_seconds

if TYPE_CHECKING:
    from sparsor.mission.items import MissionItem
    from sparsor.mission.plan import MissionPlan


@dataclass(frozen=True)
class FlightTime:
    """How long a flight takes.

    Parameters
    ----------
    seconds : float
        From take-off to landing.
    used_s : float
        Of the vehicle's endurance: the same where every phase takes the power of cruising.
    """

    seconds: float
    used_s: float


def time_plan(plan: MissionPlan, vehicle: Vehicle, wind: SteadyWind = CALM) -> FlightTime:
    """Return how long a plan takes, ours or anybody's; jumps are not followed.

    Legs are geodesics at the speed that the plan asks for (default: the vehicle's cruise speed). A leg that climbs or
    sinks takes as long as the slower of the two. An item above sea level or terrain counts as level with the one
    before.

    Parameters
    ----------
    plan : MissionPlan
    vehicle : Vehicle
    wind : SteadyWind
        Below the speed of what flies (`check_wind`).
    """
    watch = _Watch(plan, vehicle, wind)
    for item in plan.items:
        watch.fly(item)
    return FlightTime(watch.seconds, watch.used_s)


class _Watch:
    """A flight that is timed: where it is, how fast it goes, how long it has taken."""

    def __init__(self, plan: MissionPlan, vehicle: Vehicle, wind: SteadyWind) -> None:
        self._vehicle, self._wind = vehicle, wind
        self._home = plan.home.place
        self._at, self._up_m = self._home, 0.0
        self._speed_m_s = vehicle.cruise_m_s
        self._course_deg: float | None = None
        self.seconds = self.used_s = 0.0
        asked = next((item.params[1] for item in plan.items if item.command == DO_CHANGE_SPEED), 0.0)
        # The flight begins and ends at rest: one speeding up and one braking.
        self._add((asked if asked > 0 else vehicle.cruise_m_s) / vehicle.acceleration_m_s2)

    def fly(self, item: MissionItem) -> None:
        """Let an item pass."""
        if item.command == DO_CHANGE_SPEED and item.params[1] > 0:
            self._speed_m_s = item.params[1]
        elif item.command == NAV_DELAY:
            self._add(item.hold_s, self._vehicle.load("hover"))
        elif item.command == NAV_RETURN_TO_LAUNCH:
            self._go(self._home, self._up_m)
            self._land()
        elif item.command in TAKE_OFFS:
            self._take_off(item)
        elif item.command in FLOWN_TO:
            self._reach(item)

    def _take_off(self, item: MissionItem) -> None:
        if self._vehicle.flies and not self._vehicle.lifts:
            self._go(self._place(item), self._height(item))
            return
        self._at = self._place(item)
        rise_m = self._height(item) - self._up_m
        if self._vehicle.flies and rise_m > 0:
            self._add(rise_m / self._vehicle.climb_m_s, self._vehicle.load("climb"))
            self._up_m += rise_m
        self._add(self._vehicle.transition_s, self._vehicle.load("hover"))

    def _reach(self, item: MissionItem) -> None:
        vehicle = self._vehicle
        lands = item.command in LANDINGS
        # A vertical landing is flown to at the height it begins from; a plane sinks on the way.
        self._go(self._place(item), self._up_m if lands else self._height(item))
        if lands:
            self._land()
            return
        waits_s = stop_seconds(vehicle, item.hold_s, self._speed_m_s)
        self._add(waits_s, 1.0 if vehicle.circles else vehicle.load("hover"))
        if item.command == NAV_LOITER_TURNS:
            self._add(self._circles_s(max(item.params[0], 0.0)))
        if item.command == NAV_LOITER_TO_ALT:
            self._add(self._circles_s(1.0))

    def _go(self, to: tuple[float, float], up_m: float) -> None:
        """Fly a leg."""
        course_deg, _, length_m = wgs84().inv(*self._at, *to)
        rise_m, self._at, self._up_m = up_m - self._up_m, to, up_m
        rate = self._vehicle.climb_m_s if rise_m > 0 else self._vehicle.descent_m_s
        level_s = 0.0
        if length_m > 0:
            level_s = length_m / float(ground_speed_m_s(self._vehicle, self._speed_m_s, course_deg, self._wind))
            if self._course_deg is not None:
                turn = math.radians(abs((course_deg - self._course_deg + 180.0) % 360.0 - 180.0))
                self._add(turn_seconds(self._vehicle, turn, self._speed_m_s))
            self._course_deg = course_deg
        rise_s = abs(rise_m) / rate if self._vehicle.flies else 0.0
        self._add(rise_s, self._vehicle.load("climb" if rise_m > 0 else "descent"))
        self._add(max(level_s - rise_s, 0.0))

    def _land(self) -> None:
        down_s = landing_seconds(self._vehicle, max(self._up_m, 0.0))
        hover_s = min(self._vehicle.transition_s, down_s)
        self._add(hover_s, self._vehicle.load("hover"))
        self._add(down_s - hover_s, self._vehicle.load("descent"))
        self._up_m = 0.0

    def _circles_s(self, circles: float) -> float:
        radius_m = max(self._vehicle.turn_radius_m, 1.0)
        return circles * 2.0 * math.pi * radius_m / self._speed_m_s

    def _place(self, item: MissionItem) -> tuple[float, float]:
        # A place at 0/0 is read as "here", where it is not home's own.
        nowhere = item.command in POSITION_OPTIONAL and item.params[4:6] == (0.0, 0.0) != self._home
        here = not item.has_position or nowhere
        return self._at if here else (item.lon_deg, item.lat_deg)

    def _height(self, item: MissionItem) -> float:
        known = item.frame == FRAME_RELATIVE and not math.isnan(item.altitude_m)
        return item.altitude_m if known else self._up_m

    def _add(self, seconds: float, load: float = 1.0) -> None:
        self.seconds += seconds
        self.used_s += load * seconds
