"""How long flying takes: small sums that the budget and the summary share.

The model is a vehicle that flies legs at one speed and comes to rest at each stop with a hold. Wind, and the
rounding of corners that are flown through, are left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sparsor.vehicle.profile import Vehicle


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
    upper bound where a leg is shorter than v^2 / a).
    """
    if hold_s <= 0:
        return 0.0
    return hold_s + _speed(vehicle, speed_m_s) / vehicle.acceleration_m_s2


def takeoff_seconds(vehicle: Vehicle, altitude_m: float) -> float:
    """Return the time to climb to `altitude_m` above home, seconds."""
    return altitude_m / vehicle.climb_m_s


def landing_seconds(vehicle: Vehicle, altitude_m: float) -> float:
    """Return the time to descend from `altitude_m` above home to the ground, seconds.

    The last metres are slow on both autopilots (ArduPilot LAND_SPEED below LAND_ALT_LOW, PX4 MPC_LAND_SPEED).
    """
    slow_m = min(altitude_m, vehicle.touchdown_height_m)
    slow_m_s = min(vehicle.touchdown_m_s, vehicle.descent_m_s)
    return (altitude_m - slow_m) / vehicle.descent_m_s + slow_m / slow_m_s


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
    """Return the time from take-off to landing, seconds.

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
        + start_and_end
        + landing_seconds(vehicle, altitude_m)
    )


def usable_seconds(vehicle: Vehicle) -> float:
    """Return the endurance without the reserve: what a flyable mission stays within, seconds."""
    return vehicle.endurance_s * (1.0 - vehicle.reserve_fraction)


def _speed(vehicle: Vehicle, speed_m_s: float | None) -> float:
    return vehicle.cruise_m_s if speed_m_s is None else speed_m_s
