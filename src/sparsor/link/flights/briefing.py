"""What has to be known before a vehicle is armed: how far away it is, how long the way, how full the battery."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkError
from sparsor.geodesy.lengths import distance_m
from sparsor.link.flights.orders import command_long
from sparsor.link.flights.route import Route
from sparsor.link.missions.checks import position_of
from sparsor.mission import time_plan
from sparsor.mission.items import WAYPOINTS
from sparsor.vehicle import load_vehicle

if TYPE_CHECKING:
    from sparsor.link.connection import Connection
    from sparsor.link.vehicles import FoundVehicle
    from sparsor.mission import MissionPlan
    from sparsor.vehicle import Vehicle

TOO_FAR_M: Final = 5000.0  # from the vehicle to the plan's home or first waypoint: another place is meant
BESIDE_HOME_M: Final = 100.0
TOO_EMPTY: Final = 30  # percent
REQUEST_MESSAGE: Final = 512  # MAV_CMD
BATTERY_MESSAGES: Final = ("SYS_STATUS", "BATTERY_STATUS")
ANSWER_S: Final = 1.0
TRIES: Final = 3


@dataclass(frozen=True)
class Briefing:
    """What somebody should know who is asked whether to arm.

    Parameters
    ----------
    home_m, first_m : float or None
        From the vehicle to the plan's home and first waypoint; None where it does not say where it is.
    length_m, seconds, height_m : float
        Of the flight from home to home, about; height of the highest waypoint above home.
    battery_percent : int or None
        None where it does not say.
    warnings : tuple of str
    """

    home_m: float | None
    first_m: float | None
    length_m: float
    seconds: float
    height_m: float
    battery_percent: int | None
    warnings: tuple[str, ...]


def brief(
    plan: MissionPlan,
    connection: Connection,
    vehicle: FoundVehicle,
    *,
    profile: Vehicle | None = None,
    force: bool = False,
) -> Briefing:
    """Return what has to be known before a vehicle is armed, and refuse what must not fly.

    Parameters
    ----------
    plan : MissionPlan
    connection : Connection
    vehicle : FoundVehicle
    profile : Vehicle or None
        What the plan was made for, whose endurance tells what the battery is good for.
    force : bool
        Warn where it would be refused.

    Raises
    ------
    LinkError
        When the plan begins farther than 5 km from the vehicle, or its battery is below 30 %.
    LinkFailureError
        When the link is gone.
    """
    home_m, first_m = _distances(plan, position_of(vehicle, connection))
    battery = _battery(vehicle, connection)
    refusals = (*_too_far(home_m, first_m), *_too_empty(battery))
    if refusals and not force:
        raise LinkError(f"not started, nothing was sent. {' '.join(refusals)} --force starts all the same.")
    length_m, seconds, height_m = _flight(plan, profile or load_vehicle("quad"))
    warnings = (*refusals, *_beside_home(home_m), *_doubts(battery, seconds, profile))
    return Briefing(home_m, first_m, length_m, seconds, height_m, battery, warnings)


def _distances(plan: MissionPlan, place: tuple[float, float] | None) -> tuple[float | None, float | None]:
    if place is None:
        return None, None
    first = next((item for item in plan.items if item.command in WAYPOINTS), None)
    ends = [plan.home.place]
    ends += [(first.lon_deg, first.lat_deg)] if first is not None else []
    away = distance_m(*place, [lon for lon, _ in ends], [lat for _, lat in ends])
    return float(away[0]), float(away[-1])


def _too_far(home_m: float | None, first_m: float | None) -> tuple[str, ...]:
    places = (("home", home_m), ("first waypoint", first_m))
    return tuple(
        f"The plan's {what} lies {away_m / 1000:.1f} km from the vehicle, more than {TOO_FAR_M / 1000:g} km: is it the "
        "plan for this place?"
        for what, away_m in places
        if away_m is not None and away_m > TOO_FAR_M
    )


def _beside_home(home_m: float | None) -> tuple[str, ...]:
    """Say that heights above home are above another place: where a vehicle arms is its home."""
    if home_m is None or not BESIDE_HOME_M < home_m <= TOO_FAR_M:
        return ()
    return (
        f"The vehicle stands {home_m:.0f} m from the plan's home: the plan's heights will count from the ground where "
        "it takes off. Is it the plan for this place, of several homes or sorties the right one?",
    )


def _too_empty(percent: int | None) -> tuple[str, ...]:
    if percent is None or percent >= TOO_EMPTY:
        return ()
    return (f"The battery is at {percent} %, below {TOO_EMPTY} %: charge it first.",)


def _doubts(percent: int | None, seconds: float, profile: Vehicle | None) -> tuple[str, ...]:
    """Say that the battery is not known, or will not last."""
    if percent is None:
        return ("The vehicle does not say how full its battery is.",)
    if profile is None or percent / 100 * profile.endurance_s >= seconds:
        return ()
    lasts_min = percent / 100 * profile.endurance_s / 60
    return (
        f"The battery at {percent} % lasts for {lasts_min:.0f} min by the profile of the {profile.name}, the flight "
        f"takes {seconds / 60:.0f} min.",
    )


def _flight(plan: MissionPlan, profile: Vehicle) -> tuple[float, float, float]:
    """Return length, duration and greatest height of a flight from home; without wind."""
    route = Route(plan)
    heights = [item.altitude_m for item in plan.items if item.command in WAYPOINTS]
    height_m = max(heights, default=0.0)
    length_m = route.left_m(0, plan.home.lon_deg, plan.home.lat_deg)
    return length_m, time_plan(plan, profile).seconds, height_m


def _battery(vehicle: FoundVehicle, connection: Connection) -> int | None:
    """Ask for SYS_STATUS and BATTERY_STATUS (MAV_CMD_REQUEST_MESSAGE); percent left, None when neither says."""
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    numbers = [getattr(mavlink, f"MAVLINK_MSG_ID_{name}") for name in BATTERY_MESSAGES]
    with connection.inbox(*BATTERY_MESSAGES, system_id=vehicle.system_id) as inbox:
        for _ in range(TRIES):
            for number in numbers:
                connection.send(command_long(vehicle, REQUEST_MESSAGE, number))
            for answer in inbox.until(time.monotonic() + ANSWER_S):
                if (left := int(answer.message.battery_remaining)) >= 0:  # -1: not known
                    return left
    return None
