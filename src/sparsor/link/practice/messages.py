"""The state of the practice vehicle in MAVLink messages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.battery import CELLS
from sparsor.link.practice.flavour import Mode
from sparsor.link.practice.readiness import arming_fault
from sparsor.link.practice.storage import MISSION

if TYPE_CHECKING:
    from collections.abc import Callable

    from sparsor.link.practice.exchange import Message
    from sparsor.link.practice.flight import Flight


def heartbeat(flight: Flight) -> Message:
    """Return HEARTBEAT."""
    base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
    if flight.mode is Mode.MANUAL:
        base |= mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
    else:
        base |= mavlink.MAV_MODE_FLAG_GUIDED_ENABLED | mavlink.MAV_MODE_FLAG_AUTO_ENABLED
    state = mavlink.MAV_STATE_STANDBY
    if flight.armed:
        base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
        state = mavlink.MAV_STATE_ACTIVE
    flavour = flight.flavour
    custom = flavour.custom_mode(flight.mode)
    return mavlink.MAVLink_heartbeat_message(flight.vehicle.mav_type, flavour.autopilot, base, custom, state, 3)


def boot_ms(flight: Flight) -> int:
    """Return simulated milliseconds since power-up."""
    return round(flight.time_s * 1000.0) & 0xFFFFFFFF


def _global_position(flight: Flight, _: float) -> Message:
    """Return GLOBAL_POSITION_INT; without a position PX4 sends none, ArduPilot the last one that it had."""
    motion, up_mm = flight.motion, round(flight.motion.up_m * 1000)
    if flight.position_lost and flight.flavour.is_px4:
        return None
    if flight.last_estimate is None:
        place = (0, 0, 0, 0)
    else:
        lon, lat = flight.last_estimate
        place = (round(lat * 1e7), round(lon * 1e7), round(flight.home_amsl_m * 1000) + up_mm, up_mm)
    level = (0.0, 0.0) if flight.position_lost else (motion.north_m_s, motion.east_m_s)
    speeds = (round(value * 100) for value in (*level, -motion.up_m_s))
    heading = round(math.degrees(motion.heading_rad) * 100) % 36_000
    return mavlink.MAVLink_global_position_int_message(boot_ms(flight), *place, *speeds, heading)


def _gps(flight: Flight, _: float) -> Message:
    """Return GPS_RAW_INT; without a fix at the place of the last one."""
    motion, time_us = flight.motion, round(flight.time_s * 1e6)
    lon, lat, up = flight.last_fix or (0.0, 0.0, 0.0)
    amsl = flight.home_amsl_m + up if flight.last_fix else 0.0
    place = round(lat * 1e7), round(lon * 1e7), round(amsl * 1000)
    if not flight.has_fix:
        unknown = 0xFFFF
        return mavlink.MAVLink_gps_raw_int_message(
            time_us, mavlink.GPS_FIX_TYPE_NO_FIX, *place, unknown, unknown, unknown, unknown, 0
        )
    speed, course = round(motion.ground_speed_m_s * 100), round(math.degrees(motion.course_rad) * 100) % 36_000
    return mavlink.MAVLink_gps_raw_int_message(time_us, mavlink.GPS_FIX_TYPE_3D_FIX, *place, 80, 120, speed, course, 12)


def _attitude(flight: Flight, _: float) -> Message:
    motion = flight.motion
    yaw = (motion.heading_rad + math.pi) % (2 * math.pi) - math.pi
    return mavlink.MAVLink_attitude_message(boot_ms(flight), motion.roll_rad, motion.pitch_rad, yaw, 0.0, 0.0, 0.0)


def _hud(flight: Flight, _: float) -> Message:
    motion = flight.motion
    speed, heading = motion.ground_speed_m_s, round(math.degrees(motion.heading_rad)) % 360
    throttle = 0 if flight.landed else 50
    return mavlink.MAVLink_vfr_hud_message(
        motion.airspeed_m_s, speed, heading, throttle, flight.home_amsl_m + motion.up_m, motion.up_m_s
    )


def _system_status(flight: Flight, _: float) -> Message:
    sensors = 0b111 | mavlink.MAV_SYS_STATUS_SENSOR_GPS | mavlink.MAV_SYS_STATUS_AHRS
    sensors |= mavlink.MAV_SYS_STATUS_SENSOR_BATTERY | mavlink.MAV_SYS_STATUS_PREARM_CHECK
    healthy = sensors
    if not flight.has_fix:
        healthy &= ~mavlink.MAV_SYS_STATUS_SENSOR_GPS
    if not flight.armed and arming_fault(flight):
        healthy &= ~mavlink.MAV_SYS_STATUS_PREARM_CHECK
    percent = flight.battery.percent
    volts, amperes = round(flight.battery.volts * 1000), round(flight.battery.amperes * 100)
    return mavlink.MAVLink_sys_status_message(sensors, sensors, healthy, 100, volts, amperes, percent, 0, 0, 0, 0, 0, 0)


def _battery(flight: Flight, _: float) -> Message:
    cells = [round(flight.battery.volts / CELLS * 1000)] * CELLS + [0xFFFF] * (10 - CELLS)
    used = flight.battery.used_mah
    amperes, percent = round(flight.battery.amperes * 100), flight.battery.percent
    lipo = mavlink.MAV_BATTERY_TYPE_LIPO
    left_s = flight.battery.seconds_left
    return mavlink.MAVLink_battery_status_message(0, 0, lipo, 0x7FFF, cells, amperes, used, -1, percent, left_s, 1)


def mission_current(flight: Flight, _: float = 0.0) -> Message:
    """Return MISSION_CURRENT; numbers as the flavour stores items."""
    items = flight.store.items[MISSION]
    seq = min(flight.navigator.current, max(len(items) - 1, 0))
    if not items:
        state = mavlink.MISSION_STATE_NO_MISSION
    elif flight.navigator.finished:
        state = mavlink.MISSION_STATE_COMPLETE
    elif flight.mission_started:
        state = mavlink.MISSION_STATE_ACTIVE if flight.mode is Mode.MISSION else mavlink.MISSION_STATE_PAUSED
    else:
        state = mavlink.MISSION_STATE_NOT_STARTED
    total = len(items) - (1 if items and flight.store.limits.home_is_item_0 else 0)
    return mavlink.MAVLink_mission_current_message(seq, total, state, 1 if flight.mode is Mode.MISSION else 2)


def _system_time(flight: Flight, boot_unix_s: float) -> Message:
    unix_us = round((boot_unix_s + flight.time_s) * 1e6) if flight.clock_set else 0
    return mavlink.MAVLink_system_time_message(unix_us, boot_ms(flight))


def _extended_state(flight: Flight, _: float) -> Message:
    motion, landed = flight.motion, mavlink.MAV_LANDED_STATE_IN_AIR
    if not flight.vehicle.flies:
        # ArduRover does not say; PX4's RoverLandDetector takes what is armed to be under way.
        if not flight.flavour.is_px4:
            landed = mavlink.MAV_LANDED_STATE_UNDEFINED
        elif not flight.armed:
            landed = mavlink.MAV_LANDED_STATE_ON_GROUND
    elif flight.landed:
        landed = mavlink.MAV_LANDED_STATE_ON_GROUND
    elif motion.up_m < 1.0 and motion.up_m_s > 0:
        landed = mavlink.MAV_LANDED_STATE_TAKEOFF
    elif motion.up_m_s < 0 and motion.up_m <= flight.vehicle.touchdown_height_m:
        landed = mavlink.MAV_LANDED_STATE_LANDING
    return mavlink.MAVLink_extended_sys_state_message(mavlink.MAV_VTOL_STATE_UNDEFINED, landed)


def _home(flight: Flight, _: float) -> Message:
    home, upright = flight.store.home, [1.0, 0.0, 0.0, 0.0]
    altitude = round(flight.home_amsl_m * 1000)
    return mavlink.MAVLink_home_position_message(home.x, home.y, altitude, 0, 0, 0, upright, 0, 0, 0)


def _fence(flight: Flight, _: float) -> Message:
    fence = flight.fence
    return mavlink.MAVLink_fence_status_message(int(fence.breached), fence.breaches, 0, 0)


def _version(flight: Flight, _: float) -> Message:
    can = mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    can |= mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
    can |= mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    if flight.flavour.is_px4:
        can |= mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    else:
        can |= mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
    none = [0] * 8
    return mavlink.MAVLink_autopilot_version_message(can, flight.flavour.version, 0, 0, 0, none, none, none, 0, 0, 1)


def _wind(flight: Flight, _: float) -> Message:
    """Return WIND, which ArduPilot sends."""
    return mavlink.MAVLink_wind_message(flight.wind.from_deg, flight.wind.speed_m_s, 0.0)


def _wind_cov(flight: Flight, _: float) -> Message:
    """Return WIND_COV, which PX4 sends; the estimate is the wind itself."""
    wind, up_m = flight.wind, flight.home_amsl_m + flight.motion.up_m
    spread = wind.settings.gusts_m_s**2
    return mavlink.MAVLink_wind_cov_message(
        round(flight.time_s * 1e6), wind.north_m_s, wind.east_m_s, 0.0, spread, 0.0, up_m, 0.0, 0.0
    )


BUILDERS: dict[int, Callable[[Flight, float], Message]] = {
    1: _system_status,
    2: _system_time,
    24: _gps,
    30: _attitude,
    33: _global_position,
    42: mission_current,
    74: _hud,
    147: _battery,
    148: _version,
    162: _fence,
    168: _wind,
    231: _wind_cov,
    242: _home,
    245: _extended_state,
}
OTHERS = {"ardupilot": frozenset({231}), "px4": frozenset({168})}
"""What each flavour does not have."""
