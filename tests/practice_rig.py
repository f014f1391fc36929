"""A practice autopilot without sockets, flown from the test's own clock, for the tests of `link`."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mission_strategies import example_plan
from sparsor.link.practice import PracticeAutopilot, PracticeSettings, SensorSettings, flavour_named
from sparsor.link.practice.exchange import Peer

ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
START = mavlink.MAV_CMD_MISSION_START
STATION = Peer(255, 190, 1)
MISSION, FENCE, RALLY = 0, 1, 2


def mission_messages(plan: Any, autopilot: str) -> list[Any]:
    """Return the MISSION_ITEM_INTs of a plan, with home where ArduPilot wants it."""
    home = plan.home
    rows = [(item.command, item.frame, item.params) for item in plan.items]
    if autopilot == "ardupilot":
        rows.insert(0, (16, 0, (0.0, 0.0, 0.0, 0.0, home.lat_deg, home.lon_deg, home.alt_amsl_m)))
    return [item_message(seq, *row) for seq, row in enumerate(rows)]


def item_message(seq: int, command: int, frame: int, params: tuple[float, ...], kind: int = MISSION) -> Any:
    scale = 1.0 if frame == 2 else 1e7
    x, y = (0 if math.isnan(value) else round(value * scale) for value in params[4:6])
    current = int(seq == 0)
    return mavlink.MAVLink_mission_item_int_message(
        1, 1, seq, frame, command, current, 1, *params[:4], x, y, params[6], kind
    )


def _flavour(autopilot: str, settings: dict[str, Any]) -> Any:
    return flavour_named(autopilot).on(settings["vehicle"].kind if "vehicle" in settings else "quad")


@dataclass
class Rig:
    """One vehicle and one ground station; simulated time is wall time."""

    vehicle: PracticeAutopilot
    heard: list[Any] = field(default_factory=list)
    track: list[tuple[float, float, float, float]] = field(default_factory=list)

    @classmethod
    def of(cls, autopilot: str, *, plan: Any = None, **settings: Any) -> Rig:
        plan = plan or example_plan(autopilot)
        settings.setdefault("sensor", SensorSettings())
        vehicle = PracticeAutopilot(PracticeSettings(home=plan.home, flavour=_flavour(autopilot, settings), **settings))
        vehicle.join(STATION.link)
        return cls(vehicle)

    @property
    def flight(self) -> Any:
        return self.vehicle.flight

    def send(self, message: Any, peer: Peer = STATION) -> list[Any]:
        out = [one.message for one in self.vehicle.receive(message, peer, self.vehicle.time_s)]
        self.heard += out
        return out

    def command(self, number: int, *params: float) -> int:
        """Send COMMAND_LONG; returns the MAV_RESULT of its ack."""
        values = (*params, *(0.0,) * (7 - len(params)))
        out = self.send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *values))
        return int(next(one.result for one in out if one.get_type() == "COMMAND_ACK"))

    def run(self, seconds: float, *, until: Any = None, step_s: float = 0.5) -> bool:
        """Let time pass; True when `until()` came true."""
        end = self.vehicle.time_s + seconds
        while self.vehicle.time_s < end - 1e-9:
            at = self.vehicle.time_s + step_s
            self.heard += [one.message for one in self.vehicle.advance(at, at)]
            motion = self.flight.motion
            self.track.append((self.vehicle.time_s, motion.east_m, motion.north_m, motion.up_m))
            if until is not None and until():
                return True
        return False

    def upload(self, items: list[Any], kind: int = MISSION) -> int:
        """Upload without losses; returns the MAV_MISSION_RESULT."""
        out = self.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), kind))
        while True:
            for one in out:
                if one.get_type() == "MISSION_ACK":
                    return int(one.type)
            wanted = next(one.seq for one in out if one.get_type().startswith("MISSION_REQUEST"))
            out = self.send(items[wanted])

    def said(self) -> list[str]:
        texts = [one.text for one in self.heard if one.get_type() == "STATUSTEXT"]
        return [text.decode() if isinstance(text, bytes) else text for text in texts]

    def reached(self) -> list[int]:
        return [one.seq for one in self.heard if one.get_type() == "MISSION_ITEM_REACHED"]

    def take_off(self) -> None:
        """Arm and start the mission the way each autopilot wants it."""
        assert self.command(ARM, 1) == 0, self.said()
        assert self.command(START) == 0, self.said()
