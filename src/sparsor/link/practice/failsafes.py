"""What the practice vehicle does by itself when battery, GPS or ground station fail, as the two autopilots do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.flavour import Mode

if TYPE_CHECKING:
    from sparsor.link.practice.flight import Flight

# How long the position is good enough without GPS: what ArduPilot's manual says of its estimator, and PX4's
# EKF2_NOAID_TOUT.
COASTING_S = {"ardupilot": 10.0, "px4": 5.0}
STATION_ACTIONS = {
    # FS_GCS_ENABLE: LAND, brake or LAND; all others return. NAV_DLL_ACT: Hold, Return, Land.
    "ardupilot": {5: Mode.LAND, 7: Mode.LAND},
    "px4": {1: Mode.HOLD, 2: Mode.RETURN, 3: Mode.LAND},
}
CRITICAL, WARNING = mavlink.MAV_SEVERITY_CRITICAL, mavlink.MAV_SEVERITY_WARNING


class Failsafes:
    """Watches a flight; `step` it after the vehicle moved.

    Parameters
    ----------
    flight : Flight
    """

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self._low_said = self._critical_said = self._made_low = False
        self._no_fix_since_s: float | None = None
        self._resume: Mode | None = None
        self._no_link_since_s: float | None = None
        self._station_lost = False

    def step(self) -> None:
        """Look at everything once."""
        self._watch_battery()
        self._watch_gps()
        self._watch_station()

    def _watch_battery(self) -> None:
        flight, battery = self._flight, self._flight.battery
        at_s, now_s = flight.troubles.low_battery_s, flight.flown_s
        if at_s is not None and now_s is not None and now_s >= at_s and not self._made_low:
            self._made_low = True
            battery.run_low()
        if not flight.armed:
            return
        self._low_said, self._critical_said = self._low_said and battery.low, self._critical_said and battery.critical
        if battery.low and not self._low_said:
            self._low_said = True
            if flight.flavour.is_px4:
                flight.say("Low battery", CRITICAL)
                flight.say("Failsafe activated", CRITICAL)
            else:
                flight.say(f"Battery 1 is low {battery.volts:.2f}V used {battery.used_mah} mAh", WARNING)
                flight.say("Battery Failsafe", WARNING)
            self._act(Mode.RETURN)
        if battery.critical and not self._critical_said:
            self._critical_said = True
            text = "Critical battery" if flight.flavour.is_px4 else "Battery 1 is critical"
            flight.say(f"{text}: landing", CRITICAL)
            self._act(Mode.LAND)

    def _watch_gps(self) -> None:
        flight = self._flight
        if flight.has_fix or flight.flown_s is None:
            self._no_fix_since_s = None
            if flight.position_lost:
                flight.position_lost = False
                self._position_again()
            return
        if self._no_fix_since_s is None:
            self._no_fix_since_s = flight.time_s
        if not flight.position_lost and flight.time_s - self._no_fix_since_s >= COASTING_S[flight.flavour.name]:
            flight.position_lost = True
            self._no_position()

    def _no_position(self) -> None:
        """Land where the wind takes it: neither autopilot can do more without a position."""
        flight = self._flight
        lands = flight.armed and not flight.landed and flight.mode not in (Mode.MANUAL, Mode.LAND)
        if flight.flavour.is_px4:
            self._resume = flight.mode if lands else None
            flight.say("GNSS data fusion stopped", WARNING)
            if lands:
                flight.say("Failsafe activated", CRITICAL)
        else:
            flight.say("EKF variance", CRITICAL)
            if lands:
                flight.say("EKF Failsafe: changed to LAND Mode", CRITICAL)
        if lands:
            flight.set_mode(Mode.LAND)

    def _position_again(self) -> None:
        """ArduPilot stays in LAND; PX4 goes on with what it did, because its cause has cleared."""
        flight = self._flight
        if not flight.flavour.is_px4:
            flight.say("EKF Failsafe Cleared", CRITICAL)
            return
        flight.say("GNSS data fusion started")
        if self._resume is not None and flight.mode is Mode.LAND and not flight.landed:
            flight.set_mode(self._resume)
        self._resume = None

    def _watch_station(self) -> None:
        flight = self._flight
        if not flight.link_lost:
            self._no_link_since_s = None
            if self._station_lost:
                self._station_lost = False
                again = "Connection to ground station regained" if flight.flavour.is_px4 else "GCS Failsafe Cleared"
                flight.say(again, WARNING)
            return
        if self._no_link_since_s is None:
            self._no_link_since_s = flight.time_s
        if flight.station_heard and not self._station_lost and flight.armed:
            self._silent_station(flight.time_s - self._no_link_since_s)

    def _silent_station(self, silent_s: float) -> None:
        flight, values = self._flight, self._flight.parameters
        px4 = flight.flavour.is_px4
        if silent_s < (values.get("COM_DL_LOSS_T", 10.0) if px4 else values.get("FS_GCS_TIMEOUT", 5.0)):
            return
        action = int(values.get("NAV_DLL_ACT" if px4 else "FS_GCS_ENABLE", 0.0))
        if not px4 and not action:
            return
        self._station_lost = True
        flight.say("Connection to ground station lost" if px4 else "GCS Failsafe", WARNING)
        if action:
            if px4:
                flight.say("Failsafe activated", CRITICAL)
            self._act(STATION_ACTIONS[flight.flavour.name].get(action, Mode.RETURN))

    def _act(self, mode: Mode) -> None:
        """Change the mode in the air, to landing where it is when it cannot return; a landing is never called off."""
        flight = self._flight
        if flight.landed or flight.mode is Mode.LAND or flight.mode is mode:
            return
        if flight.set_mode(mode) != mavlink.MAV_RESULT_ACCEPTED:
            flight.set_mode(Mode.LAND)
