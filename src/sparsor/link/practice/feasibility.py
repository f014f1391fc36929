"""What PX4 looks at before it flies a mission that it has taken.

Source: PX4 v1.15 MissionFeasibility/FeasibilityChecker.cpp and mission_feasibility_checker.cpp. A mission without a
take-off passes, and gets one by itself, unless MIS_TKO_LAND_REQ says otherwise. Not looked at: MIS_DIST_WPS, gates
and what concerns planes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sparsor.link.practice.navigator import target_of
from sparsor.mission.items import FLOWN_TO, LANDINGS, TAKE_OFFS

if TYPE_CHECKING:
    from sparsor.link.practice.state import FlightState
    from sparsor.link.practice.storage import StoredItem

# Taken in an upload and not flown: CONDITION_DELAY, CONDITION_DISTANCE.
NOT_FLOWN = frozenset({112, 114})


def feasibility_fault(flight: FlightState, items: list[StoredItem]) -> str | None:
    """Return why PX4 rejects a mission, in its words; None when it flies it."""
    for number, item in enumerate(items, start=1):
        if item.command in NOT_FLOWN:
            return f"Mission rejected: item {number}: unsupported cmd: {item.command}"
    if items[0].command in LANDINGS and flight.landed:
        return "Mission rejected: starts with landing"
    return _place_fault(flight, items) or _take_off_fault(flight, items) or _required(flight, items)


def _place_fault(flight: FlightState, items: list[StoredItem]) -> str | None:
    most_m, is_first = flight.parameters["MIS_DIST_1WP"], True
    for number, item in enumerate(items, start=1):
        target = target_of(item, flight.place, flight.home_amsl_m)
        if target is None:
            continue
        away_m = math.hypot(*target[:2])
        if is_first and 0 < most_m <= away_m:
            return f"First waypoint too far away: {int(away_m)}m, {int(most_m)} max"
        is_first = False
        if flight.fence.shuts_out(*target):
            return f"Geofence violation for waypoint {number}"
    return None


def _take_off_fault(flight: FlightState, items: list[StoredItem]) -> str | None:
    placed = [item for item in items if item.command in FLOWN_TO]
    for number, item in enumerate(placed):
        if item.command not in TAKE_OFFS:
            continue
        target = target_of(item, flight.place, flight.home_amsl_m)
        if (target[2] if target else item.z) - 1.0 < flight.parameters["NAV_ACC_RAD"]:
            return "Mission rejected: Takeoff altitude too low!"
        if number > 0:
            return "Mission rejected: takeoff not first waypoint item"
    return None


def _required(flight: FlightState, items: list[StoredItem]) -> str | None:
    takes_off = any(item.command in TAKE_OFFS for item in items)
    lands = any(item.command in LANDINGS for item in items)
    missing = {
        1: (not takes_off, "Takeoff waypoint required."),
        2: (not lands, "Landing waypoint/pattern required."),
        3: (not (takes_off and lands), "Takeoff or Landing item missing."),
        4: (takes_off != lands, f"Add {'Landing' if takes_off else 'Takeoff'} item or remove"),
    }
    fails, text = missing.get(int(flight.parameters["MIS_TKO_LAND_REQ"]), (False, ""))
    return f"Mission rejected: {text}" if fails else None
