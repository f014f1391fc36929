"""Why the practice autopilot does not arm, and why it does not fly a mission, in the words of the real ones."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.link.practice.flavour import Mode
from sparsor.link.practice.storage import MISSION
from sparsor.mission.items import TAKE_OFFS, WAYPOINTS

if TYPE_CHECKING:
    from sparsor.link.practice.state import FlightState

# ArduPilot arms a little before it has the position that AUTO wants.
ARMS_AT = 0.8
PILOTED = (Mode.MANUAL, Mode.HOLD, Mode.GUIDED)


def arming_fault(flight: FlightState) -> str | None:
    """Return the arming check that fails, None when all pass."""
    waiting = flight.time_s < flight.ready_s * (1.0 if flight.flavour.is_px4 else ARMS_AT)
    if flight.flavour.is_px4:
        if waiting:
            return "Arming denied: waiting for GPS and estimator"
        if flight.fence.outside(flight.motion):
            return "Arming denied: outside the geofence"
        return mission_fault(flight) if flight.mode is Mode.MISSION else None
    if flight.parameters["ARMING_CHECK"] and waiting:
        return "PreArm: Need Position Estimate" if flight.has_fix else "PreArm: GPS 1: Bad fix"
    outside = flight.fence.outside(flight.motion)
    if flight.parameters["ARMING_CHECK"] and outside:
        return f"PreArm: vehicle outside fence ({outside})"
    in_auto = flight.mode is Mode.MISSION and int(flight.parameters["AUTO_OPTIONS"]) & 1
    if flight.mode not in PILOTED and not in_auto:
        return f"Arm: {flight.flavour.mode_title(flight.mode)} mode not armable"
    return None


def mission_fault(flight: FlightState) -> str | None:
    """Return why the stored mission is not flown now, None when it is."""
    items = flight.store.items[MISSION]
    if flight.flavour.is_px4:
        return _px4_fault(flight)
    failed = "Mode change to AUTO failed: "
    if flight.time_s < flight.ready_s:
        return failed + "requires position"
    if len(items) < 2:
        return failed + "no mission"
    # Armed on the ground it wants a take-off first (AUTO_OPTIONS bit 1 aside).
    moves = [item for item in items[1:] if item.command in TAKE_OFFS | WAYPOINTS]
    if flight.armed and flight.landed and moves and moves[0].command not in TAKE_OFFS:
        return "Auto: Missing Takeoff Cmd"
    return None


def _px4_fault(flight: FlightState) -> str | None:
    items = flight.store.items[MISSION]
    if flight.time_s < flight.ready_s:
        return "Mission rejected: no valid position"
    if not items:
        return "No valid mission available, refusing mode"
    placed = [item for item in items if item.command in TAKE_OFFS | WAYPOINTS]
    if flight.landed and (not placed or placed[0].command not in TAKE_OFFS):
        return "Mission rejected: takeoff is missing"
    most = flight.parameters["MIS_DIST_1WP"]
    if placed and most > 0:
        away = flight.motion.distance_m(*flight.place.metres(placed[0].lon_deg, placed[0].lat_deg))
        if away > most:
            return f"First waypoint too far away: {away:.0f} m"
    return None
