"""How long flying takes: small sums that the budget and the summary share.

The model is a vehicle that flies legs at one speed and comes to rest, or circles, at each stop with a hold. The
rounding of corners that a multirotor flies through is left out. `sparsor.mission.timing` times a plan item by item, in
wind.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sparsor.vehicle.profile import Vehicle

# QGroundControl's landing patterns begin at 40 m too.
APPROACH_UP_M = 40.0


def leg_seconds(vehicle: Vehicle, length_m: float, speed_m_s: float | None = None) -> float:
    """Return the time to fly `length_m` metres of legs at `speed_m_s` (default: cruise), seconds.

    Examples
    --------
    >>> from sparsor.vehicle import load_vehicle
    >>> leg_seconds(load_vehicle("quad"), 600.0)
    60.0
    """
    return length_m / _speed(vehicle, speed_m_s)


def stop_seconds(vehicle: Vehicle, hold_s: float, speed_m_s: float | None = None) -> float:
    """Return what one stop adds to the time of the legs: nothing without a hold, seconds.

    Braking from speed v and speeding up again at acceleration a takes v / a longer than flying through (an
    upper bound where a leg is shorter than v^2 / a). What circles takes half a circle to get into its wait and out.
    """
    if hold_s <= 0:
        return 0.0
    speed = _speed(vehicle, speed_m_s)
    return hold_s + (turn_seconds(vehicle, math.pi, speed) if vehicle.circles else speed / vehicle.acceleration_m_s2)


def turn_seconds(vehicle: Vehicle, angle_rad: float, speed_m_s: float | None = None) -> float:
    """Return what turning by an angle at the end of a leg adds to the time of the legs, seconds.

    The arc: what circles cannot turn on the spot, and comes back to the next leg from beside it.
    """
    return vehicle.turn_radius_m * angle_rad / _speed(vehicle, speed_m_s) if vehicle.circles else 0.0


def takeoff_seconds(vehicle: Vehicle, altitude_m: float) -> float:
    """Return the time to climb to `altitude_m` above home, with a VTOL's transition, seconds."""
    return altitude_m / vehicle.climb_m_s + vehicle.transition_s if vehicle.flies else 0.0


def landing_seconds(vehicle: Vehicle, altitude_m: float) -> float:
    """Return the time to descend from `altitude_m` above home to the ground, seconds.

    The last metres are slow on both autopilots (ArduPilot LAND_SPEED below LAND_ALT_LOW, PX4 MPC_LAND_SPEED). A plane
    glides down along its approach, which is a leg; what drives or swims is down.
    """
    if not vehicle.lifts:
        return 0.0
    slow_m = min(altitude_m, vehicle.touchdown_height_m)
    slow_m_s = min(vehicle.touchdown_m_s, vehicle.descent_m_s)
    return (altitude_m - slow_m) / vehicle.descent_m_s + slow_m / slow_m_s + vehicle.transition_s


def approach_up_m(altitude_m: float) -> float:
    """Return the height above home at which a plane's or a VTOL's last approach begins."""
    return min(altitude_m, APPROACH_UP_M)


def approach_m(vehicle: Vehicle, altitude_m: float) -> float:
    """Return how long the last approach of a plane or a VTOL is, by its glide slope; two turns' room at least."""
    glide_m = approach_up_m(altitude_m) / math.tan(math.radians(vehicle.glide_deg))
    return max(glide_m, 2.0 * vehicle.turn_radius_m)


def climb_out_m(vehicle: Vehicle, altitude_m: float) -> float:
    """Return how far a plane gets while it climbs to its altitude; 0 for what lifts off."""
    return 0.0 if vehicle.lifts else altitude_m * vehicle.cruise_m_s / vehicle.climb_m_s


def pattern_seconds(vehicle: Vehicle, altitude_m: float, speed_m_s: float | None = None) -> float:
    """Return the most that the climb out and the approach of a plane or a VTOL add to the straight ways, seconds."""
    if not vehicle.circles:
        return 0.0
    speed = _speed(vehicle, speed_m_s)
    way_m = 2.0 * (approach_m(vehicle, altitude_m) + vehicle.turn_radius_m) + climb_out_m(vehicle, altitude_m)
    sink_s = (altitude_m - approach_up_m(altitude_m)) / vehicle.descent_m_s
    return way_m / speed + turn_seconds(vehicle, 5.0 * math.pi, speed) + sink_s


def flight_seconds(
    vehicle: Vehicle,
    *,
    path_length_m: float,
    transit_m: float,
    stops: int,
    hold_s: ArrayLike,
    altitude_m: float,
    speed_m_s: float | None = None,
) -> float:
    """Return the time from take-off to landing without wind, seconds; of a plane and a VTOL not less than that.

    Parameters
    ----------
    vehicle : Vehicle
        Whose speeds count.
    path_length_m : float
        Length of the open path over the stops, metres.
    transit_m : float
        Home to the first stop plus last stop to home, metres.
    stops : int
        Number of stops.
    hold_s : float or array_like (stops,)
        Hold at all stops, or at each, as it is written into the plan (ArduPilot: whole seconds), seconds.
    altitude_m : float
        Above home.
    speed_m_s : float, optional
        Along legs; default the vehicle's cruise speed.
    """
    # The flight itself also begins and ends at rest over home: one more speeding up and braking.
    start_and_end = _speed(vehicle, speed_m_s) / vehicle.acceleration_m_s2
    return (
        takeoff_seconds(vehicle, altitude_m)
        + leg_seconds(vehicle, path_length_m + transit_m, speed_m_s)
        + sum(stop_seconds(vehicle, float(hold), speed_m_s) for hold in np.broadcast_to(hold_s, (stops,)))
        + turn_seconds(vehicle, math.pi * stops, speed_m_s)
        + start_and_end
        + pattern_seconds(vehicle, altitude_m, speed_m_s)
        + landing_seconds(vehicle, altitude_m)
    )


def usable_seconds(vehicle: Vehicle) -> float:
    """Return the endurance without the reserve: what a flyable mission stays within, seconds."""
    return vehicle.endurance_s * (1.0 - vehicle.reserve_fraction)


def _speed(vehicle: Vehicle, speed_m_s: float | None) -> float:
    return vehicle.cruise_m_s if speed_m_s is None else speed_m_s
