"""What the practice vehicle writes into ArduPilot's log (.BIN), at the rates of a real one.

One departure: ArduPilot 4.6 logs named values that it received (NVAL) and none that a script of its own sent. The
practice autopilot's own sensor stands for a companion's, so its samples are logged too, under the vehicle's ids.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from sparsor.link.practice.dataflash import KINDS, describing_records
from sparsor.link.practice.due import Due
from sparsor.link.practice.storage import MISSION

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sparsor.link.practice.flight import Flight
    from sparsor.link.practice.vehiclelog import NamedValue

RATES_HZ: Final = {"POS": 10.0, "ATT": 10.0, "BAT": 10.0, "GPS": 5.0}
GPS_EPOCH_UNIX_S: Final = 315_964_800
LEAP_S: Final = 18  # GPS time is ahead of UTC, since 2017
WEEK_MS: Final = 604_800_000
# AP_Logger's LogEvent.
ARMED, DISARMED, LAND_COMPLETE, NOT_LANDED = 10, 11, 18, 28
NO_FIX, FIX_3D = 1, 3
REASON_UNKNOWN, METHOD_MAVLINK = 0, 2


class BinLog:
    """The records of one flight, arming to disarming.

    Parameters
    ----------
    flight : Flight
    boot_unix_s : float
        What the clock said at power-up.
    """

    def __init__(self, flight: Flight, boot_unix_s: float) -> None:
        self._flight, self._boot_unix_s = flight, boot_unix_s
        self._due = Due(RATES_HZ)
        self._mode = flight.mode
        self._landed = flight.landed

    def header(self) -> Iterator[bytes]:
        """Yield what the log begins with: formats, firmware, parameters, mission, mode, origin and home."""
        flight, now = self._flight, self._now_us()
        yield from describing_records(now)
        major, minor, patch = flight.flavour.version.to_bytes(4, "big")[:3]
        yield KINDS["MSG"].record(now, f"ArduCopter V{major}.{minor}.{patch} (practice)")
        for name, default, _ in flight.flavour.parameters:
            yield KINDS["PARM"].record(now, name, flight.parameters[name], default)
        items = flight.store.items[MISSION]
        for number, item in enumerate(items):
            place = (item.x * 1e-7, item.y * 1e-7, item.z)
            yield KINDS["CMD"].record(now, len(items), number, item.command, *item.params, *place, item.frame)
        yield self._mode_record()
        home = flight.store.home
        for kind in (0, 1):  # the estimator's origin and home, here the same place
            yield KINDS["ORGN"].record(now, kind, home.x * 1e-7, home.y * 1e-7, flight.home_amsl_m)
        yield from self._armed(ARMED)

    def step(self) -> Iterator[bytes]:
        """Yield what is due now."""
        flight = self._flight
        if flight.mode is not self._mode:
            self._mode = flight.mode
            yield self._mode_record()
        if flight.landed != self._landed:
            self._landed = flight.landed
            yield KINDS["EV"].record(self._now_us(), LAND_COMPLETE if flight.landed else NOT_LANDED)
        builders = {"POS": self._position, "ATT": self._attitude, "BAT": self._battery, "GPS": self._gps}
        for name in self._due.at(flight.time_s):
            if name != "POS" or flight.has_fix:
                yield builders[name]()

    def named_value(self, value: NamedValue) -> Iterator[bytes]:
        """Yield the record of a named value."""
        yield KINDS["NVAL"].record(
            self._now_us(), value.time_boot_ms, value.name, value.value, value.system, value.component
        )

    def text(self, severity: int, text: str) -> Iterator[bytes]:
        """Yield the record of a status message, which has no severity here."""
        del severity
        yield KINDS["MSG"].record(self._now_us(), text)

    def footer(self) -> Iterator[bytes]:
        """Yield what the log ends with."""
        yield from self._armed(DISARMED)

    def _now_us(self) -> int:
        return round(self._flight.time_s * 1e6)

    def _armed(self, event: int) -> Iterator[bytes]:
        now, checks = self._now_us(), self._flight.parameters.get("ARMING_CHECK", 0.0)
        yield KINDS["ARM"].record(now, event == ARMED, checks, 0, METHOD_MAVLINK)
        yield KINDS["EV"].record(now, event)

    def _mode_record(self) -> bytes:
        number = self._flight.flavour.custom_mode(self._mode)
        return KINDS["MODE"].record(self._now_us(), number, number, REASON_UNKNOWN)

    def _position(self) -> bytes:
        flight = self._flight
        lon, lat = flight.lon_lat_deg
        up = flight.motion.up_m
        return KINDS["POS"].record(self._now_us(), lat, lon, flight.home_amsl_m + up, up, up)

    def _gps(self) -> bytes:
        flight = self._flight
        if not flight.has_fix:
            return KINDS["GPS"].record(self._now_us(), 0, NO_FIX, *(0,) * 11, 1)
        motion, (lon, lat) = flight.motion, flight.lon_lat_deg
        gps_s = self._boot_unix_s + flight.time_s - GPS_EPOCH_UNIX_S + LEAP_S
        week, in_week_ms = divmod(round(gps_s * 1000), WEEK_MS)
        course = math.degrees(motion.heading_rad) % 360.0
        altitude = flight.home_amsl_m + motion.up_m
        speeds = (motion.ground_speed_m_s, course, -motion.up_m_s)
        return KINDS["GPS"].record(
            self._now_us(), 0, FIX_3D, in_week_ms, week, 12, 0.8, lat, lon, altitude, *speeds, 0, 1
        )

    def _attitude(self) -> bytes:
        motion = self._flight.motion
        roll, pitch = math.degrees(motion.roll_rad), math.degrees(motion.pitch_rad)
        yaw = math.degrees(motion.heading_rad) % 360.0
        return KINDS["ATT"].record(self._now_us(), roll, roll, pitch, pitch, yaw, yaw, 3)

    def _battery(self) -> bytes:
        battery = self._flight.battery
        volts, amperes = battery.volts, battery.amperes
        used_wh = battery.used_mah / 1000.0 * volts
        return KINDS["BAT"].record(
            self._now_us(), 0, volts, volts, amperes, battery.used_mah, used_wh, 0, 0, battery.percent, 1, 100
        )
