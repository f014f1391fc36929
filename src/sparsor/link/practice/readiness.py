"""Why the practice autopilot does not arm, and why it does not fly a mission, in the words of the real ones.

Source: ArduPilot's AP_Arming.cpp, AC_Fence.cpp and mode_auto.cpp, and AP_Mission.cpp (starts_with_takeoff_cmd);
PX4 v1.15 Commander.cpp.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.link.practice.feasibility import feasibility_fault
from sparsor.link.practice.flavour import Mode
from sparsor.link.practice.storage import MISSION
from sparsor.mission.items import NAV_DELAY, TAKE_OFFS

if TYPE_CHECKING:
    from sparsor.link.practice.state import FlightState

# ArduPilot arms a little before it has the position that AUTO wants.
ARMS_AT = 0.8
PILOTED = (Mode.MANUAL, Mode.HOLD, Mode.GUIDED)
# Commands up to NAV_LAST steer the vehicle, and a few later ones (MAV_CMD; AP_Mission::is_nav_cmd).
NAV_LAST, LATER_NAV = 95, frozenset({213, 42702, 42703})


def arming_fault(flight: FlightState) -> str | None:
    """Return the arming check that fails, None when all pass."""
    waiting = flight.time_s < flight.ready_s * (1.0 if flight.flavour.is_px4 else ARMS_AT)
    outside = flight.fence.outside(flight.motion)
    if flight.flavour.is_px4:
        if waiting or outside or (flight.mode is Mode.MISSION and mission_fault(flight)):
            return "Arming denied: Resolve system health failures first"
        return None
    if flight.parameters["ARMING_CHECK"] and waiting:
        return "PreArm: Need Position Estimate" if flight.has_fix else "PreArm: GPS 1: Bad fix"
    if flight.parameters["ARMING_CHECK"] and outside:
        return "PreArm: vehicle outside fence"
    # A copter only when told to; planes and rovers always (Mode::allows_arming of each).
    allowed = flight.vehicle.kind != "quad" or int(flight.parameters["AUTO_OPTIONS"]) & 1
    in_auto = flight.mode is Mode.MISSION and allowed
    if flight.mode not in PILOTED and not in_auto:
        return f"Arm: {flight.flavour.mode_title(flight.mode)} mode not armable"
    return None


def mission_fault(flight: FlightState) -> str | None:
    """Return why the stored mission is not flown now, None when it is."""
    items = flight.store.items[MISSION]
    if flight.flavour.is_px4:
        if flight.time_s < flight.ready_s or not items:
            return "Switching to Mission is currently not available"
        return feasibility_fault(flight, items)
    failed = "Mode change to AUTO failed: "
    if flight.time_s < flight.ready_s:
        return failed + "requires position"
    if len(items) < 2:
        return failed + "no mission"
    # Armed on the ground a copter wants a take-off first, after delays at most (AUTO_OPTIONS bit 1 aside).
    steering = [item.command for item in items[1:] if item.command <= NAV_LAST or item.command in LATER_NAV]
    first = next((command for command in steering if command != NAV_DELAY), None)
    if flight.vehicle.kind == "quad" and flight.armed and flight.landed and first not in TAKE_OFFS:
        return "Auto: Missing Takeoff Cmd"
    return None
