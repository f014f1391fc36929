"""What the practice vehicle is told to do, and how it does it."""

from __future__ import annotations

from dataclasses import replace

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.battery import IDLE_SHARE, flying_draw
from sparsor.link.practice.exchange import Outgoing
from sparsor.link.practice.flavour import Mode
from sparsor.link.practice.motion import Aim
from sparsor.link.practice.readiness import arming_fault, mission_fault
from sparsor.link.practice.returning import Return
from sparsor.link.practice.state import FlightState
from sparsor.link.practice.storage import MISSION

ACCEPTED: int = mavlink.MAV_RESULT_ACCEPTED
FAILED: int = mavlink.MAV_RESULT_FAILED
DENIED: int = mavlink.MAV_RESULT_DENIED
TEMPORARILY_REJECTED: int = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
BLIND = (Mode.MANUAL, Mode.LAND)
# A gust is soon over and is not worth a word.
BLOWN_FOR_S, WIND_SAID_EVERY_S = 3.0, 30.0
BATTERY_CHANGE_S = 10.0
STANDING_M_S = 0.05


class Flight(FlightState):
    """The vehicle that takes orders, each answered with a MAV_RESULT, and is moved by `step`."""

    def arm(self, *, force: bool = False) -> int:
        """Start the motors; returns a MAV_RESULT and says why not."""
        if self.armed:
            return ACCEPTED
        fault = None if force else arming_fault(self)
        if fault:
            self.say(fault, mavlink.MAV_SEVERITY_CRITICAL)
            return TEMPORARILY_REJECTED if self.flavour.is_px4 else FAILED
        self.armed = True
        self.mission_started = self.flavour.is_px4 and self.mode is Mode.MISSION
        if self.mission_started:
            self.navigator = self._navigator(self.navigator.current)
        self._landed_s = self.time_s
        self.say("Armed by external command" if self.flavour.is_px4 else "Arming motors")
        return ACCEPTED

    def disarm(self, *, force: bool = False) -> int:
        """Stop the motors; refused in the air, unless forced."""
        if not self.landed and not force:
            self.say("Disarming denied: not landed", mavlink.MAV_SEVERITY_CRITICAL)
            return TEMPORARILY_REJECTED if self.flavour.is_px4 else FAILED
        if self.armed:
            self.say("Disarming motors")
            self._disarmed_s = self.time_s
        self.battery.draw = 0.0
        self.armed = self.mission_started = False
        self.motion.rest()
        return ACCEPTED

    @property
    def blown(self) -> bool:
        """Whether the wind has been the stronger one for a while."""
        airborne = self.armed and not self.landed
        return airborne and self.motion.overpowered and self.time_s - self._blown_since_s >= BLOWN_FOR_S

    @property
    def under_way(self) -> bool:
        """Whether it is in the air, or what drives or swims is on its mission or its way back."""
        if self.vehicle.flies or not self.armed:
            return not self.landed
        moving = self.motion.ground_speed_m_s > STANDING_M_S
        return moving or (self.mode is Mode.MISSION and self.mission_started and not self.navigator.finished)

    def set_mode(self, mode: Mode | None) -> int:
        """Change the mode; returns a MAV_RESULT and says why not."""
        if mode is None:
            return DENIED
        fault = mission_fault(self) if mode is Mode.MISSION else None
        if self.position_lost and mode not in BLIND:
            fault = self._needs_position(mode)
        if fault:
            self.say(fault, mavlink.MAV_SEVERITY_WARNING)
            return TEMPORARILY_REJECTED if self.flavour.is_px4 else FAILED
        if mode is Mode.MISSION and self.mode is not Mode.MISSION:
            starts = self.flavour.is_px4 and self.armed
            self.mission_started = starts or (self.armed and not self.landed)
            if self.navigator.finished or self.navigator.returning:
                self.navigator = self._navigator(self._first())
        self.mode = mode
        self._guided = None
        self._return = Return()
        return ACCEPTED

    def start_mission(self) -> int:
        """MAV_CMD_MISSION_START: what makes ArduPilot leave the ground, and PX4 arm as well."""
        result = self.set_mode(Mode.MISSION)
        if result != ACCEPTED:
            return result
        if not self.armed:
            if not self.flavour.is_px4:
                self.say("Auto: not armed", mavlink.MAV_SEVERITY_WARNING)
                return FAILED
            result = self.arm()
        self.mission_started = self.armed
        return result

    def take_off(self, up_m: float) -> int:
        """MAV_CMD_NAV_TAKEOFF as a command: straight up, in GUIDED (ArduPilot) or Takeoff (PX4)."""
        if not self.armed or (not self.flavour.is_px4 and self.mode is not Mode.GUIDED) or not up_m > 0:
            return FAILED
        if self.flavour.is_px4:
            self.mode = Mode.TAKEOFF
        self._guided = Aim(self.motion.east_m, self.motion.north_m, up_m, self.vehicle.cruise_m_s)
        return ACCEPTED

    def fly_to(self, lon_deg: float, lat_deg: float, up_m: float) -> int:
        """Go to a place in GUIDED, Position or Hold."""
        if self.landed or self.mode not in (Mode.GUIDED, Mode.HOLD):
            return DENIED
        self._guided = Aim(*self.place.metres(lon_deg, lat_deg), up_m, self.vehicle.cruise_m_s)
        return ACCEPTED

    def set_current(self, seq: int) -> bool:
        """Go on with another item of the mission; False when there is none of that number."""
        self._follow_changes()
        if not 0 <= seq < len(self.store.items[MISSION]):
            return False
        if self.navigator.returning or self.navigator.finished:
            self.navigator = self._navigator(self._first())
        self.navigator.jump_to(max(seq, self._first()))
        return True

    def step(self, dt_s: float) -> None:
        """Let `dt_s` seconds pass."""
        self.time_s += dt_s
        self.wind.step(dt_s)
        self._follow_changes()
        if self.armed:
            self._fly(dt_s)
        elif self.landed and not self.troubles.keep_battery and self.time_s - self._disarmed_s >= BATTERY_CHANGE_S:
            self.battery.level = 1.0  # somebody has changed it
        self._keep_position()

    def _fly(self, dt_s: float) -> None:
        flying = self.under_way
        self.battery.use(dt_s, flying_draw(self.motion.airspeed_m_s, self.vehicle.cruise_m_s) if flying else IDLE_SHARE)
        aim = self._aim()
        if flying or (aim.up_m > 0.1 and not aim.landing):
            self.motion.step(replace(aim, adrift=True) if self.position_lost else aim, dt_s)
            self._touch(aim)
            self._watch_fence()
            self._watch_wind()
        if self.landed and not self.under_way:
            self._disarm_on_ground()
        elif not self.vehicle.flies:
            self._landed_s = self.time_s

    def _needs_position(self, mode: Mode) -> str:
        title = self.flavour.mode_title(mode)
        if self.flavour.is_px4:
            return f"Switching to {title} is currently not available"
        return f"Mode change to {title} failed: requires position"

    def _aim(self) -> Aim:
        motion = self.motion
        if self.mode is Mode.MISSION and self.mission_started:
            return self._mission_aim()
        if self.mode is Mode.RETURN and not self.landed:
            return self._return_aim()
        if self.mode is Mode.LAND:
            return Aim(motion.east_m, motion.north_m, 0.0, 0.0, landing=True)
        if self._guided is not None:
            return self._guided
        return motion.here()

    def _mission_aim(self) -> Aim:
        aim, reached = self.navigator.step(self.motion, self.time_s, landed=self.landed)
        for seq in reached:
            self.outbox.append(Outgoing(mavlink.MAVLink_mission_item_reached_message(seq)))
        if self.navigator.returning:
            self.mode = Mode.RETURN
        elif self.navigator.finished and self.flavour.is_px4 and self.mode is Mode.MISSION:
            self.say("Mission finished, loitering" if not self.landed else "Mission finished")
            self.mode = Mode.HOLD
        return aim

    def _return_aim(self) -> Aim:
        values = self.parameters
        height_m = values["RTL_RETURN_ALT"] if self.flavour.is_px4 else values["RTL_ALT"] / 100.0
        return self._return.aim(self.motion, height_m)

    def _touch(self, aim: Aim) -> None:
        if self.landed and self.motion.up_m > 0.05:
            self.landed = False
            if self.took_off_s is None:
                self.took_off_s = self.time_s
        elif not self.landed and aim.landing and self.motion.up_m <= 0.0:
            self.landed = True
            self._landed_s = self.time_s
            self._guided = None
            self.motion.rest()
            self.say("Landing detected" if self.flavour.is_px4 else "SIM Hit ground at 0.5 m/s")

    def _disarm_on_ground(self) -> None:
        done = self.mode in (Mode.RETURN, Mode.LAND) or (self.mission_started and self.navigator.finished)
        # A mission that ended on the ground disarms at once; motors that idle stop after a while.
        wait = self.flavour.disarm_s if done else self.parameters.get("DISARM_DELAY", 10.0)
        if self.flavour.is_px4 and not done:
            wait = self.parameters.get("COM_DISARM_PRFLT", 10.0)
        if wait > 0 and self.time_s - self._landed_s >= wait:
            if self.navigator.finished and not self.flavour.is_px4:
                self.say("Mission complete, disarming")
            self.disarm()

    def _watch_wind(self) -> None:
        """Say it when the wind has been the stronger one for a while."""
        if self.landed or not self.motion.overpowered:
            self._blown_since_s = self.time_s
        elif self.time_s - max(self._blown_since_s + BLOWN_FOR_S, self._wind_said_s + WIND_SAID_EVERY_S) >= 0:
            self._wind_said_s = self.time_s
            self.say(f"Wind {self.wind.speed_m_s:.0f} m/s: too strong, drifting", mavlink.MAV_SEVERITY_CRITICAL)

    def _watch_fence(self) -> None:
        crossed = None if self.landed else self.fence.crossed(self.motion)
        if not crossed:
            return
        self.say(f"Fence breached: {crossed}", mavlink.MAV_SEVERITY_CRITICAL)
        action = self.parameters["GF_ACTION" if self.flavour.is_px4 else "FENCE_ACTION"]
        returns = action == (3 if self.flavour.is_px4 else 1)
        if self.mode is not Mode.LAND and (returns or (self.flavour.is_px4 and action == 2)):
            self.set_mode(Mode.RETURN if returns else Mode.HOLD)

    def _follow_changes(self) -> None:
        if self._known_mission == self.store.changes[MISSION]:
            return
        self._known_mission = self.store.changes[MISSION]
        # In flight the new mission goes on at the same number, as both autopilots do.
        flying = self.mission_started and not self.landed
        self.navigator = self._navigator(self.navigator.current if flying else max(self.store.first, self._first()))
        fault = mission_fault(self) if self.flavour.is_px4 and self.store.items[MISSION] and self.has_fix else None
        if fault:
            self.say(fault, mavlink.MAV_SEVERITY_CRITICAL)
