"""How the practice vehicle moves: a point with speed and acceleration limits, in the wind. Not flight dynamics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.link.practice.wind import Wind, WindSettings

if TYPE_CHECKING:
    from sparsor.vehicle import Vehicle

GRAVITY_M_S2 = 9.80665
# A profile has no highest airspeed: a multirotor that cruises at 10 m/s gets some 15 m/s out of its steepest lean, 30
# degrees on ArduCopter (ANGLE_MAX). Between them the lean's drag grows with the airspeed.
AIRSPEED_PER_CRUISE = 1.5
STEEPEST_RAD = math.radians(30.0)
# Brake a little earlier than the limit allows, so that a late turn towards the aim still fits under it.
BRAKING = 0.8
MOVING_M_S = 0.5


@dataclass(frozen=True)
class Aim:
    """Where to fly, metres east, north and up of home.

    Parameters
    ----------
    east_m, north_m, up_m : float
    speed_m_s : float
        Along the way.
    pass_m_s : float
        At the aim; 0 to stop there.
    landing : bool
        Descend to the ground, slowly at the end; `up_m` is not read.
    adrift : bool
        Do not know where it is: go level, with the wind.
    """

    east_m: float
    north_m: float
    up_m: float
    speed_m_s: float
    pass_m_s: float = 0.0
    landing: bool = False
    adrift: bool = False


class Motion:
    """Position and velocity of the vehicle, moved by `step`.

    Parameters
    ----------
    vehicle : Vehicle
        Its speeds and accelerations.
    wind : Wind, optional
        Default: none.

    Attributes
    ----------
    overpowered : bool
        Whether the wind takes it where it does not want to go.
    """

    def __init__(self, vehicle: Vehicle, wind: Wind | None = None) -> None:
        self.vehicle = vehicle
        self.wind = wind or Wind(WindSettings())
        self.overpowered = False
        self.east_m = self.north_m = self.up_m = 0.0
        self.east_m_s = self.north_m_s = self.up_m_s = 0.0
        self.heading_rad = 0.0
        self.roll_rad = self.pitch_rad = 0.0

    @property
    def ground_speed_m_s(self) -> float:
        """Horizontal speed."""
        return math.hypot(self.east_m_s, self.north_m_s)

    @property
    def course_rad(self) -> float:
        """Direction of the movement over the ground; the heading while there is hardly any."""
        if self.ground_speed_m_s < MOVING_M_S:
            return self.heading_rad
        return math.atan2(self.east_m_s, self.north_m_s) % (2.0 * math.pi)

    @property
    def airspeed_m_s(self) -> float:
        """Horizontal speed through the air."""
        return math.hypot(self.east_m_s - self.wind.east_m_s, self.north_m_s - self.wind.north_m_s)

    @property
    def most_airspeed_m_s(self) -> float:
        """Airspeed at the steepest lean."""
        return AIRSPEED_PER_CRUISE * self.vehicle.cruise_m_s

    def distance_m(self, east_m: float, north_m: float) -> float:
        """Return the horizontal distance to a place."""
        return math.hypot(east_m - self.east_m, north_m - self.north_m)

    def here(self, up_m: float | None = None) -> Aim:
        """Return the aim that stops where the vehicle is."""
        return Aim(self.east_m, self.north_m, self.up_m if up_m is None else up_m, 0.0)

    def rest(self) -> None:
        """Stand still, as on the ground."""
        self.east_m_s = self.north_m_s = self.up_m_s = self.roll_rad = self.pitch_rad = 0.0
        self.overpowered = False

    def step(self, aim: Aim, dt_s: float) -> None:
        """Move for `dt_s` seconds towards an aim."""
        self._level_step(aim, dt_s)
        self._vertical_step(aim, dt_s)

    def _level_step(self, aim: Aim, dt_s: float) -> None:
        most = self.vehicle.acceleration_m_s2
        east, north = aim.east_m - self.east_m, aim.north_m - self.north_m
        away = math.hypot(east, north)
        want = min(aim.speed_m_s, math.sqrt(aim.pass_m_s**2 + 2.0 * BRAKING * most * away))
        if aim.pass_m_s == 0.0:
            want = min(want, away / dt_s)
        along = (east / away, north / away) if away > 1e-9 else (0.0, 0.0)
        if want > MOVING_M_S:
            self.heading_rad = math.atan2(*along) % (2.0 * math.pi)
        want_east, want_north = self._reachable(along, want, max(self.most_airspeed_m_s, aim.speed_m_s))
        if aim.adrift:
            want_east, want_north = self.wind.east_m_s, self.wind.north_m_s
        change_east, change_north = want_east - self.east_m_s, want_north - self.north_m_s
        change = math.hypot(change_east, change_north)
        share = min(1.0, most * dt_s / change) if change > 1e-12 else 0.0
        self.east_m_s += share * change_east
        self.north_m_s += share * change_north
        self.east_m += self.east_m_s * dt_s
        self.north_m += self.north_m_s * dt_s
        self._lean(share * change_east / dt_s, share * change_north / dt_s)

    def _reachable(self, along: tuple[float, float], want: float, most: float) -> tuple[float, float]:
        """Return the velocity over the ground nearest to `want` along a unit vector at an airspeed up to `most`.

        Where it can, the vehicle keeps to its track and is late (the wind triangle); where even that is too much, it
        flies against the wind as fast as it can and is blown.
        """
        wind_east, wind_north = self.wind.east_m_s, self.wind.north_m_s
        air_east, air_north = want * along[0] - wind_east, want * along[1] - wind_north
        needed = math.hypot(air_east, air_north)
        self.overpowered = False
        if needed <= most:
            return want * along[0], want * along[1]
        tail, cross = wind_east * along[0] + wind_north * along[1], wind_east * along[1] - wind_north * along[0]
        late = tail + math.sqrt(most * most - cross * cross) if abs(cross) <= most else -1.0
        if 0.0 < late < want:
            return late * along[0], late * along[1]
        self.overpowered = True
        return wind_east + air_east * most / needed, wind_north + air_north * most / needed

    def _lean(self, east_m_s2: float, north_m_s2: float) -> None:
        """Lean as speeding up takes, and as the drag of the air that passes takes."""
        drag = GRAVITY_M_S2 * math.tan(STEEPEST_RAD) / self.most_airspeed_m_s
        east_m_s2 += drag * (self.east_m_s - self.wind.east_m_s)
        north_m_s2 += drag * (self.north_m_s - self.wind.north_m_s)
        sine, cosine = math.sin(self.heading_rad), math.cos(self.heading_rad)
        self.pitch_rad = -math.atan((north_m_s2 * cosine + east_m_s2 * sine) / GRAVITY_M_S2)
        self.roll_rad = math.atan((east_m_s2 * cosine - north_m_s2 * sine) / GRAVITY_M_S2)

    def _vertical_step(self, aim: Aim, dt_s: float) -> None:
        vehicle = self.vehicle
        if aim.landing:
            slow = self.up_m <= vehicle.touchdown_height_m
            want = -min(vehicle.touchdown_m_s, vehicle.descent_m_s) if slow else -vehicle.descent_m_s
        else:
            up = aim.up_m - self.up_m
            most = vehicle.climb_m_s if up > 0 else vehicle.descent_m_s
            want = math.copysign(
                min(most, math.sqrt(2.0 * BRAKING * vehicle.acceleration_m_s2 * abs(up)), abs(up) / dt_s), up
            )
        change = vehicle.acceleration_m_s2 * dt_s
        self.up_m_s += min(max(want - self.up_m_s, -change), change)
        self.up_m += self.up_m_s * dt_s
        # The ground is level, but for a vehicle that is sent below home: it may be over a valley.
        if self.up_m <= 0.0 and (aim.landing or aim.up_m >= 0.0):
            self.up_m, self.up_m_s = 0.0, max(self.up_m_s, 0.0)
