"""What the practice vehicle writes into PX4's log (.ulg), at the rates of PX4's default topics.

Named values are always logged, as PX4 does when SDLOG_PROFILE has its bit for debugging topics.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice import ulogfile
from sparsor.link.practice.battery import CAPACITY_MAH, CELLS
from sparsor.link.practice.due import Due
from sparsor.link.practice.flavour import Mode

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sparsor.link.practice.flight import Flight
    from sparsor.link.practice.vehiclelog import NamedValue

RATES_HZ: Final = {"position": 5.0, "gps": 10.0, "status": 2.0, "battery": 5.0}
# vehicle_status.nav_state.
NAVIGATION: Final = {
    Mode.MANUAL: 0, Mode.GUIDED: 2, Mode.MISSION: 3, Mode.HOLD: 4, Mode.RETURN: 5, Mode.TAKEOFF: 17, Mode.LAND: 18,
}  # fmt: skip
DISARMED, ARMED = 1, 2
ROTARY_WING, FIXED_WING, ROVER = 1, 2, 3
VEHICLE_TYPES: Final = {
    mavlink.MAV_TYPE_FIXED_WING: FIXED_WING,
    mavlink.MAV_TYPE_GROUND_ROVER: ROVER,
    mavlink.MAV_TYPE_SURFACE_BOAT: ROVER,
}
LONGEST_KEY: Final = 9  # PX4 puts a zero into the tenth place of what it receives
NO_FIX, FIX_3D = 1, 3


class ULog:
    """The messages of one flight, arming to disarming (SDLOG_MODE 0).

    Parameters
    ----------
    flight : Flight
    boot_unix_s : float
        What the clock said at power-up.
    system : int
        The vehicle's system id.
    """

    def __init__(self, flight: Flight, boot_unix_s: float, system: int) -> None:
        self._flight, self._boot_unix_s, self._system = flight, boot_unix_s, system
        self._due = Due(RATES_HZ)
        self._armed_us = self._mode_us = self._now_us()
        self._take_off_us = 0
        self._mode = flight.mode

    def header(self) -> Iterator[bytes]:
        """Yield what the log begins with: version, flags, formats, what flies, parameters, topics."""
        flight = self._flight
        yield ulogfile.beginning(self._now_us())
        for topic in ulogfile.TOPICS:
            yield topic.description()
        yield ulogfile.info_text("sys_name", "PX4")
        yield ulogfile.info_text("ver_hw", "practice")
        yield ulogfile.info_text("ver_sw", "practice")
        yield ulogfile.info("uint32_t", "ver_sw_release", flight.flavour.version.to_bytes(4, "little"))
        yield ulogfile.info("int32_t", "time_ref_utc", bytes(4))
        for name, _, kind in flight.flavour.parameters:
            whole = kind != mavlink.MAV_PARAM_TYPE_REAL32
            yield ulogfile.parameter(name, flight.parameters[name], whole=whole)
        for topic in ulogfile.TOPICS:
            yield topic.subscription()

    def step(self) -> Iterator[bytes]:
        """Yield what is due now; a change of the mode at once."""
        flight, due = self._flight, self._due.at(self._flight.time_s)
        if not flight.landed and not self._take_off_us:
            self._take_off_us = self._now_us()
        if flight.mode is not self._mode:
            self._mode, self._mode_us = flight.mode, self._now_us()
            due = [*due, *({"status"} - set(due))]
        for name in due:
            if name == "status":
                yield self._status()
            elif name == "battery":
                yield self._battery()
            elif name == "gps":
                yield self._gps()
            elif flight.has_fix:
                yield self._position()

    def named_value(self, value: NamedValue) -> Iterator[bytes]:
        """Yield the message of a named value: when it came, not the time that its sender gave."""
        key = value.name.encode("ascii", "replace")[:LONGEST_KEY]
        yield ulogfile.NAMED.record({"timestamp": self._now_us(), "key": key, "value": value.value})

    def text(self, severity: int, text: str) -> Iterator[bytes]:
        """Yield a status message."""
        yield ulogfile.text_message(severity, self._now_us(), text)

    def footer(self) -> Iterator[bytes]:
        """Yield what the log ends with."""
        yield self._status()

    def _now_us(self) -> int:
        return round(self._flight.time_s * 1e6)

    def _position(self) -> bytes:
        flight, now = self._flight, self._now_us()
        lon, lat = flight.lon_lat_deg
        altitude = flight.home_amsl_m + flight.motion.up_m
        return ulogfile.POSITION.record(
            {
                "timestamp": now,
                "timestamp_sample": now,
                "lat": lat,
                "lon": lon,
                "alt": altitude,
                "alt_ellipsoid": altitude,  # the practice world has no geoid
                "eph": 0.3,
                "epv": 0.4,
                "terrain_alt": flight.home_amsl_m,
                "terrain_alt_valid": True,
            }
        )

    def _gps(self) -> bytes:
        flight, now = self._flight, self._now_us()
        if not flight.has_fix:
            return ulogfile.GPS.record({"timestamp": now, "timestamp_sample": now, "fix_type": NO_FIX})
        motion, (lon, lat) = flight.motion, flight.lon_lat_deg
        altitude = flight.home_amsl_m + motion.up_m
        return ulogfile.GPS.record(
            {
                "timestamp": now,
                "timestamp_sample": now,
                "time_utc_usec": round((self._boot_unix_s + flight.time_s) * 1e6),
                "latitude_deg": lat,
                "longitude_deg": lon,
                "altitude_msl_m": altitude,
                "altitude_ellipsoid_m": altitude,
                "eph": 0.8,
                "epv": 1.2,
                "hdop": 0.8,
                "vdop": 1.2,
                "vel_m_s": motion.ground_speed_m_s,
                "vel_n_m_s": motion.north_m_s,
                "vel_e_m_s": motion.east_m_s,
                "vel_d_m_s": -motion.up_m_s,
                "cog_rad": (motion.heading_rad + math.pi) % (2 * math.pi) - math.pi,
                "fix_type": FIX_3D,
                "satellites_used": 12,
                "vel_ned_valid": True,
            }
        )

    def _status(self) -> bytes:
        flight = self._flight
        state = NAVIGATION[flight.mode]
        return ulogfile.STATUS.record(
            {
                "timestamp": self._now_us(),
                "armed_time": self._armed_us if flight.armed else 0,
                "takeoff_time": self._take_off_us,
                "nav_state_timestamp": self._mode_us,
                "arming_state": ARMED if flight.armed else DISARMED,
                "nav_state": state,
                "nav_state_user_intention": state,
                "vehicle_type": VEHICLE_TYPES.get(flight.vehicle.mav_type, ROTARY_WING),
                "system_type": flight.vehicle.mav_type,
                "system_id": self._system,
                "component_id": mavlink.MAV_COMP_ID_AUTOPILOT1,
                "pre_flight_checks_pass": True,
            }
        )

    def _battery(self) -> bytes:
        battery = self._flight.battery
        return ulogfile.BATTERY.record(
            {
                "timestamp": self._now_us(),
                "voltage_v": battery.volts,
                "current_a": battery.amperes,
                "discharged_mah": battery.used_mah,
                "remaining": battery.level,
                "time_remaining_s": battery.seconds_left,
                "capacity": CAPACITY_MAH,
                "cell_count": CELLS,
                "id": 1,
                "warning": battery.low,
                "connected": True,
            }
        )
