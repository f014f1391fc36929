"""What is seen of a flight: messages in, events and the present state out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.geodesy.lengths import distance_m
from sparsor.link.flights.modes import mode_title
from sparsor.link.flights.route import Route
from sparsor.link.flights.statustexts import StatusTexts
from sparsor.link.flights.views import Event, Fix, View
from sparsor.link.vehicles import vehicle_of
from sparsor.mission.items import WAYPOINTS

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
# MAV_LANDED_STATE.
ON_GROUND, IN_AIR, TAKING_OFF, LANDING = 1, 2, 3, 4
FLYING: Final = frozenset({IN_AIR, TAKING_OFF, LANDING})
OFF_GROUND_M: Final = 1.0
MOVING_M_S: Final = 1.0
FALL_M_S: Final = 4.0  # no autopilot lands so fast
FALL_S: Final = 5.0
NO_SAMPLE_S: Final = 10.0
BATTERY_LOW: Final = 20
NEAR_M: Final = 15.0  # how near a waypoint was passed whose MISSION_ITEM_REACHED the link may have lost


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
        self._told_reached: set[int] = set()
        self._left_behind: set[int] = set()
        self._track: list[Fix] = []
        self._flown_m = 0.0
        self._begun_s = self._ended_s = 0.0
        self._landed_state = 0
        self._fell_s: float | None = None
        self._battery: int | None = None
        self._low_said = self._silence_said = False
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
        return tuple(place for place, item in enumerate(self._plan.items) if item.command in WAYPOINTS)

    @property
    def reached(self) -> frozenset[int]:
        """Places of the items that were reached.

        The vehicle said so; or its mission went on past a waypoint near which it was (the link may have lost the word).
        """
        return frozenset(self._told_reached | {place for place in self._left_behind if self._was_near(place)})

    @property
    def on_ground(self) -> bool:
        """Whether it is on the ground, as far as it tells."""
        if self._fell_s is not None and self._now_s - self._fell_s < FALL_S:
            return False  # a copter that is disarmed in the air calls itself landed (ArduPilot)
        low = self.last_fix is not None and self.last_fix.height_m < OFF_GROUND_M
        return self._landed_state == ON_GROUND or low

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
        left_m = None if fix is None else self._route.left_m(self._current, fix.lon_deg, fix.lat_deg)
        return View(
            item=min(self._current + 1, len(self._plan.items)),
            items=len(self._plan.items),
            mode=self.mode,
            flown_m=self._flown_m,
            left_m=left_m,
            left_s=None if left_m is None or fix is None else self._route.left_s(self._current, left_m, fix.height_m),
            height_m=None if fix is None else fix.height_m,
            ground_speed_m_s=None if fix is None else fix.ground_speed_m_s,
            battery_percent=self._battery,
            samples=self._samples.total,
            sample=None if last is None else f"{last.name} {last.value:g}",
            sample_age_s=self._samples.age_s,
            sample_rate_hz=self._samples.rate_hz,
        )

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
        if message.vz > FALL_M_S * 100:
            self._fell_s = fix.time_s
        if not self.armed:
            return []
        if fix.height_m >= OFF_GROUND_M or speed_m_s >= MOVING_M_S:
            self._under_way()
        if before is not None and self.flown:
            self._flown_m += float(distance_m(before.lon_deg, before.lat_deg, [fix.lon_deg], [fix.lat_deg])[0])
        self._track.append(fix)
        return self._sample_silence()

    def _under_way(self) -> None:
        if self.armed and not self.flown:
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

    def _extended_state(self, message: Message) -> list[Event]:
        before, self._landed_state = self._landed_state, int(message.landed_state)
        if self._landed_state in FLYING:
            self._under_way()
        landed = self._landed_state == ON_GROUND and before in FLYING
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
            self._left_behind |= set(range(self._current, min(place, len(self._plan.items)))) & set(self.waypoints)
        self._current = place
        return []

    def _item_reached(self, message: Message) -> list[Event]:
        place = int(message.seq) - self._first
        if not 0 <= place < len(self._plan.items) or place in self._told_reached:
            return []
        self._told_reached.add(place)
        return [Event(f"item {place + 1} of {len(self._plan.items)} reached")]

    def _statustext(self, message: Message) -> list[Event]:
        said = self.statustexts.take(message)
        return [] if said is None else [Event(f"the vehicle says: {said.text}", said.serious, not said.serious)]

    def _was_near(self, place: int) -> bool:
        item = self._plan.items[place]
        lon = np.array([fix.lon_deg for fix in self._track])
        lat = np.array([fix.lat_deg for fix in self._track])
        return bool(len(lon)) and float(distance_m(item.lon_deg, item.lat_deg, lon, lat).min()) <= NEAR_M
