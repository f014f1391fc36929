"""What is seen of a flight: messages in, events and the present state out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.geodesy.lengths import distance_m
from sparsor.link.flights.ground import Ground
from sparsor.link.flights.modes import mode_title
from sparsor.link.flights.reached import Reached
from sparsor.link.flights.route import Route
from sparsor.link.flights.statustexts import StatusTexts
from sparsor.link.flights.views import Event, Fix, View
from sparsor.link.vehicles import vehicle_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from sparsor.link.flights.samples import SampleCounter
    from sparsor.link.inbox import Message, Received
    from sparsor.link.vehicles import FoundVehicle
    from sparsor.mission import MissionPlan

KINDS: Final = (
    "HEARTBEAT", "GLOBAL_POSITION_INT", "EXTENDED_SYS_STATE", "SYS_STATUS", "MISSION_CURRENT", "MISSION_ITEM_REACHED",
    "STATUSTEXT",
)  # fmt: skip
RETURNING: Final = frozenset({"RTL", "SMART_RTL", "AUTO_RTL", "QRTL"})  # modes, as pymavlink names them
NO_SAMPLE_S: Final = 10.0
BATTERY_LOW: Final = 20
STANDS_S: Final = 30.0  # some vehicles stay armed: rovers, and what DISARM_DELAY or COM_DISARM_LAND says so of


class Tracker:
    """Follows one vehicle through its flight; all times are the vehicle's own.

    Parameters
    ----------
    plan : MissionPlan
    vehicle : FoundVehicle
    samples : SampleCounter
    mission_mode : str
        What the vehicle calls its mode while it flies a mission.

    Attributes
    ----------
    armed, flown, ended : bool
        Now; whether it was under way since it was watched; whether it was disarmed after that.
    mode : str or None
    last_fix : Fix or None
    statustexts : StatusTexts
    """

    def __init__(self, plan: MissionPlan, vehicle: FoundVehicle, samples: SampleCounter, mission_mode: str) -> None:
        self.armed, self.flown, self.ended = vehicle.armed, False, False
        self.mode: str | None = None
        self.last_fix: Fix | None = None
        self.statustexts = StatusTexts()
        self._plan, self._vehicle, self._samples, self._mission_mode = plan, vehicle, samples, mission_mode
        self._route = Route(plan)
        facts = vehicle.autopilot
        self._first = 1 if facts is not None and facts.home_is_item_0 else 0
        self._current = 0
        self._reached = Reached(plan)
        self._ground = Ground()
        self._flown_m = 0.0
        self._begun_s = self._ended_s = 0.0
        self._battery: int | None = None
        self._low_said = self._silence_said = self._stands_said = False
        self._handlers: dict[str, Callable[[Message], list[Event]]] = {
            "GLOBAL_POSITION_INT": self._position,
            "EXTENDED_SYS_STATE": self._extended_state,
            "SYS_STATUS": self._system_status,
            "MISSION_CURRENT": self._mission_current,
            "MISSION_ITEM_REACHED": self._item_reached,
            "STATUSTEXT": self._statustext,
        }

    def take(self, received: Received) -> list[Event]:
        """Take one message of the vehicle; return what it means."""
        if received.kind == "HEARTBEAT":
            found = vehicle_of(received)
            same = found is not None and received.frame.component_id == self._vehicle.component_id
            return self._heartbeat(received.message) if same else []
        return self._handlers[received.kind](received.message)

    @property
    def waypoints(self) -> tuple[int, ...]:
        """Places of the waypoints among the plan's items."""
        return self._reached.waypoints

    @property
    def reached(self) -> frozenset[int]:
        """Places of the items that were reached (`Reached.places`)."""
        return self._reached.places

    @property
    def on_ground(self) -> bool:
        """Whether it is on the ground, as far as it tells."""
        return self._ground.is_under

    @property
    def seconds(self) -> float:
        """How long the flight took, or takes so far."""
        return (self._ended_s or self._now_s) - self._begun_s if self.flown else 0.0

    @property
    def flown_m(self) -> float:
        """Length of the track over ground, metres."""
        return self._flown_m

    def view(self) -> View:
        """Return the flight as it is now."""
        fix, last = self.last_fix, self._samples.last
        left_m, left_s = (None, None) if fix is None else self._left(fix)
        return View(
            item=min(self._current + 1, len(self._plan.items)),
            items=len(self._plan.items),
            mode=self.mode,
            flown_m=self._flown_m,
            left_m=left_m,
            left_s=left_s,
            height_m=None if fix is None else fix.height_m,
            ground_speed_m_s=None if fix is None else fix.ground_speed_m_s,
            battery_percent=self._battery,
            samples=self._samples.total,
            sample=None if last is None else f"{last.name} {_rounded(last.value)}",
            sample_age_s=self._samples.age_s,
            sample_rate_hz=self._samples.rate_hz,
        )

    def _left(self, fix: Fix) -> tuple[float, float]:
        """Return what is left of the mission, or of the way home where it returns: metres and seconds."""
        if self.mode in RETURNING:
            home_m = self._route.home_m(fix.lon_deg, fix.lat_deg)
            return home_m, self._route.home_s(self._current, home_m, fix.height_m)
        left_m = self._route.left_m(self._current, fix.lon_deg, fix.lat_deg)
        return left_m, self._route.left_s(self._current, left_m, fix.height_m)

    @property
    def _now_s(self) -> float:
        return 0.0 if self.last_fix is None else self.last_fix.time_s

    def _heartbeat(self, beat: Message) -> list[Event]:
        events = []
        mode, armed = mode_title(beat), bool(beat.base_mode & 128)  # MAV_MODE_FLAG_SAFETY_ARMED
        if mode != self.mode:
            events.append(Event(f"mode {mode}"))
            self.mode = mode
        if armed != self.armed:
            if not armed and self._ground.disarmed():
                events.append(Event("landed"))
            events.append(Event("armed" if armed else "disarmed"))
            self.armed = armed
            if self.flown and not armed:
                self.ended, self._ended_s = True, self._now_s
        return events

    def _position(self, message: Message) -> list[Event]:
        if (message.lon, message.lat) == (0, 0):
            return []
        speed_m_s = float(np.hypot(message.vx, message.vy)) / 100
        fix = Fix(
            message.time_boot_ms / 1000, message.lon / 1e7, message.lat / 1e7, message.relative_alt / 1000, speed_m_s
        )
        before, self.last_fix = self.last_fix, fix
        self._ground.take(fix, message.vz / 100, armed=self.armed, done=self._reached.all_behind)
        if not self.armed:
            return []
        self._under_way()
        if before is not None and self.flown:
            self._flown_m += float(distance_m(before.lon_deg, before.lat_deg, [fix.lon_deg], [fix.lat_deg])[0])
        self._reached.fly_over(fix)
        return [*self._sample_silence(), *self._stands_armed()]

    def _under_way(self) -> None:
        if self.armed and not self.flown and self._ground.is_left:
            self.flown, self._begun_s = True, self._now_s

    def _sample_silence(self) -> list[Event]:
        age_s = self._samples.age_s
        if age_s is None:
            age_s = self._now_s - self._begun_s if self.flown else 0.0
        silent = age_s > NO_SAMPLE_S
        if silent == self._silence_said or not self.flown:
            return []
        self._silence_said = silent
        if not silent:
            return [Event("samples come again")]
        return [Event(f"no sample for {age_s:.0f} s" if self._samples.last else "no sample came yet", warning=True)]

    def _stands_armed(self) -> list[Event]:
        """Say once that it is down and keeps its motors armed: the flight is watched until they are not."""
        if self._stands_said or not self.flown or self._ground.stands_s < STANDS_S:
            return []
        self._stands_said = True
        return [Event("it stands still and stays armed: disarm it, or end the recording with Ctrl-C", warning=True)]

    def _extended_state(self, message: Message) -> list[Event]:
        landed = self._ground.says(int(message.landed_state))
        self._under_way()
        return [Event("landed")] if landed else []

    def _system_status(self, message: Message) -> list[Event]:
        left = int(message.battery_remaining)
        self._battery = left if left >= 0 else None
        if 0 <= left < BATTERY_LOW and self.flown and not self._low_said:
            self._low_said = True
            return [Event(f"battery at {left} %", warning=True)]
        return []

    def _mission_current(self, message: Message) -> list[Event]:
        place = max(int(message.seq) - self._first, 0)
        if self.flown and self.mode == self._mission_mode and place > self._current:
            self._reached.leave(self._current, place)
        self._current = place
        return []

    def _item_reached(self, message: Message) -> list[Event]:
        place = int(message.seq) - self._first
        news = self._reached.tell(place)
        return [Event(f"item {place + 1} of {len(self._plan.items)} reached")] if news else []

    def _statustext(self, message: Message) -> list[Event]:
        said = self.statustexts.take(message)
        return [] if said is None else [Event(f"the vehicle says: {said.text}", said.serious, not said.serious)]


def _rounded(value: float) -> str:
    return f"{value:.1f}" if abs(value) >= 10 else f"{value:.3g}"
