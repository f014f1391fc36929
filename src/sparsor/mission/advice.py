"""What the person who flies a new plan should know about it, in sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.geodesy.lengths import distance_m
from sparsor.mission.items import NAV_LOITER_TO_ALT

if TYPE_CHECKING:
    from sparsor.mission.following import Ground
    from sparsor.mission.plan import MissionPlan
    from sparsor.vehicle import Autopilot, Vehicle

# PX4 refuses a take-off below its acceptance radius plus one metre; NAV_ACC_RAD is 10 m by default (newer
# versions compare with the altitude's own radius, 0.8 m).
PX4_LOW_TAKE_OFF_M = 11.0
# PX4 refuses a first waypoint farther away than MIS_DIST_1WP.
PX4_FIRST_WAYPOINT_M = 900.0


def build_warnings(
    plan: MissionPlan,
    vehicle: Vehicle,
    autopilot: Autopilot,
    wanted_hold_s: float,
    altitude_m: float,
    ground: Ground | None,
) -> tuple[str, ...]:
    """Return the warnings about a plan that was just built; `altitude_m` is above home, or above `ground`."""
    found = [
        _home_altitude(plan),
        _ceiling(vehicle, altitude_m, "home" if ground is None else "the ground"),
        _speed(plan, vehicle),
        _hold(plan, autopilot, wanted_hold_s),
        _antimeridian(plan),
        _circles(plan, vehicle, autopilot),
    ]
    if autopilot.name == "px4" and vehicle.flies:
        found += [_px4_take_off(plan), _px4_first_waypoint(plan)]
    return tuple(sentence for sentence in found if sentence)


def _home_altitude(plan: MissionPlan) -> str:
    if plan.home.altitude_known:
        return ""
    return (
        "The altitude of home above sea level is not known and is written as 0; the flight itself is "
        "relative to home, but .waypoints and map files need it: give --home-altitude."
    )


def _ceiling(vehicle: Vehicle, altitude_m: float, above: str) -> str:
    if altitude_m <= vehicle.ceiling_m:
        return ""
    return (
        f"The flight is {altitude_m:g} m above {above}, beyond the ceiling of {vehicle.ceiling_m:g} m in the "
        "vehicle profile; find out what is allowed where you fly."
    )


def _speed(plan: MissionPlan, vehicle: Vehicle) -> str:
    if plan.hover_m_s <= vehicle.cruise_m_s:
        return ""
    return (
        f"The speed of {plan.hover_m_s:g} m/s is above the vehicle's cruise speed of {vehicle.cruise_m_s:g} "
        "m/s: its endurance will be shorter than the profile says, and the autopilot may not fly it."
    )


def _hold(plan: MissionPlan, autopilot: Autopilot, wanted_s: float) -> str:
    written_s = max(stop.hold_s for stop in plan.stops)
    if written_s == wanted_s:
        return ""
    return f"{autopilot.title} holds for whole seconds: {wanted_s:g} s at each stop is written as {written_s:g} s."


def _circles(plan: MissionPlan, vehicle: Vehicle, autopilot: Autopilot) -> str:
    """Say what the vehicle's own parameters have to be for a plane's circles and landing."""
    if not vehicle.circles:
        return ""
    radius = "NAV_LOITER_RAD" if autopilot.waypoint_radius else "WP_LOITER_RAD"
    said = f"The vehicle turns and circles with a radius of {vehicle.turn_radius_m:g} m here: set {radius} to that."
    if not autopilot.waypoint_radius:
        said += " It does not arm with a landing sequence (DO_LAND_START) in the mission until RTL_AUTOLAND is set."
    approach = next(item for item in plan.items if item.command == NAV_LOITER_TO_ALT)
    return (
        f"{said} It comes in from {approach.altitude_m:g} m above home, from the circle at {approach.lon_deg:.5f} E "
        f"{approach.lat_deg:.5f} N: look whether the ground under that approach is free."
    )


def _antimeridian(plan: MissionPlan) -> str:
    lon_deg = plan.fences[0].lon_deg
    if max(lon_deg) - min(lon_deg) <= 180:
        return ""
    return (
        "The fence crosses the antimeridian, which the polygon fences of the autopilots do not: do not "
        "enable it, and watch the flight instead."
    )


def _px4_take_off(plan: MissionPlan) -> str:
    altitude_m = plan.items[0].altitude_m
    if altitude_m >= PX4_LOW_TAKE_OFF_M:
        return ""
    return (
        f"Some versions of PX4 refuse a take-off to {altitude_m:g} m: with NAV_ACC_RAD at its default they "
        f"ask for {PX4_LOW_TAKE_OFF_M:g} m."
    )


def _px4_first_waypoint(plan: MissionPlan) -> str:
    first = plan.stops[0]
    away_m = float(distance_m(plan.home.lon_deg, plan.home.lat_deg, first.lon_deg, first.lat_deg))
    if away_m <= PX4_FIRST_WAYPOINT_M:
        return ""
    return (
        f"The first stop is {away_m:.0f} m from home; PX4 refuses a first waypoint beyond MIS_DIST_1WP, "
        f"{PX4_FIRST_WAYPOINT_M:g} m in some versions: raise it there or move home."
    )
