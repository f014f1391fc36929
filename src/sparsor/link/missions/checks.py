"""Whether a plan may be sent to the vehicle that was found."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkError
from sparsor.geodesy.lengths import distance_m
from sparsor.link.flights.orders import command_long
from sparsor.mission import judged_faults
from sparsor.mission.items import FRAME_RELATIVE, WAYPOINTS

if TYPE_CHECKING:
    from sparsor.link.connection import Connection
    from sparsor.link.vehicles import FoundVehicle
    from sparsor.mission import MissionPlan

GENERIC: Final = 0  # MAV_AUTOPILOT_GENERIC and MAV_TYPE_GENERIC: the plan does not say
FAR_M: Final = 500.0
POSITION_S: Final = 1.0
TRIES: Final = 4
# MAV_TYPE that fly alike.
COPTERS: Final = frozenset({2, 3, 4, 13, 14, 15})
PLANES: Final = frozenset({1})
VTOLS: Final = frozenset(range(19, 26))
ROVERS: Final = frozenset({10, 11})  # boats among them
CLASSES: Final = (COPTERS, PLANES, VTOLS, ROVERS)


def check_plan(plan: MissionPlan, vehicle: FoundVehicle, *, force: bool = False) -> tuple[str, ...]:
    """Refuse a plan that this vehicle must not get; return sentences about what has to be known.

    Raises
    ------
    LinkError
        When the plan is for another autopilot, the vehicle is armed (unless forced) or the plan has a serious fault.
    """
    if vehicle.autopilot is None:
        raise LinkError(f"{vehicle.words}: plans can be sent to ArduPilot and PX4 only")
    if plan.firmware_type not in (GENERIC, vehicle.firmware_type):
        raise LinkError(
            f"the plan is for {plan.autopilot_title}, the vehicle is {vehicle.words}. Make the plan again with "
            f"--autopilot {vehicle.autopilot.name}"
        )
    if vehicle.armed and not force:
        raise LinkError(f"the vehicle is armed ({vehicle.words}): disarm it, or give --force to send the plan anyway")
    faults = judged_faults(plan)
    serious = [fault.sentence for fault in faults if fault.serious]
    serious += [
        f"The pattern '{pattern.kind}' has no items in the file: only QGroundControl can work them out."
        for pattern in plan.complex_items
        if not pattern.items
    ]
    if serious:
        raise LinkError("the plan is not sent. " + " ".join(serious))
    known = [fault.sentence for fault in faults]
    return (*plan.warnings, *known, *_other_kind(plan, vehicle), *_forced(vehicle))


def far_from_home(plan: MissionPlan, vehicle: FoundVehicle, connection: Connection) -> tuple[str, ...]:
    """Say whether the plan's home lies far from where the vehicle is, or that it does not say where it is.

    Raises
    ------
    LinkFailureError
        When the link is gone.
    """
    place = position_of(vehicle, connection)
    if place is None:
        return ("The vehicle does not say where it is: whether home is near could not be checked.",)
    away_m = float(distance_m(plan.home.lon_deg, plan.home.lat_deg, [place[0]], [place[1]])[0])
    if away_m < FAR_M:
        return ()
    return (f"The plan's home lies {away_m / 1000:.1f} km from the vehicle.",)


def above_the_fence(plan: MissionPlan, ceiling_m: float | None) -> tuple[str, ...]:
    """Say which waypoints lie above the vehicle's own altitude fence (FENCE_ALT_MAX), metres above home."""
    heights = [item.altitude_m for item in plan.items if item.command in WAYPOINTS and item.frame == FRAME_RELATIVE]
    if ceiling_m is None or not heights or max(heights) < ceiling_m:
        return ()
    return (f"The highest waypoint is {max(heights):g} m above home, the vehicle's altitude fence at {ceiling_m:g} m.",)


def position_of(vehicle: FoundVehicle, connection: Connection) -> tuple[float, float] | None:
    """Ask where a vehicle is; return longitude and latitude in degrees, None when it does not say.

    Raises
    ------
    LinkFailureError
        When the link is gone.
    """
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    asked = command_long(vehicle, mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)
    with connection.inbox("GLOBAL_POSITION_INT", system_id=vehicle.system_id) as inbox:
        for _ in range(TRIES):
            connection.send(asked)
            for answer in inbox.until(time.monotonic() + POSITION_S):
                lon_e7, lat_e7 = answer.message.lon, answer.message.lat
                if (lon_e7, lat_e7) != (0, 0):  # no fix yet: it may come
                    return lon_e7 / 1e7, lat_e7 / 1e7
    return None


def _other_kind(plan: MissionPlan, vehicle: FoundVehicle) -> tuple[str, ...]:
    alike = next((kinds for kinds in CLASSES if plan.vehicle_type in kinds), None)
    if alike is None or vehicle.vehicle_type in alike:
        return ()
    return (f"The plan is for another kind of vehicle (MAV_TYPE {plan.vehicle_type}) than this {vehicle.words}.",)


def _forced(vehicle: FoundVehicle) -> tuple[str, ...]:
    return ("The vehicle is armed: it may act on the new plan at once.",) if vehicle.armed else ()
