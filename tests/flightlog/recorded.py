"""A flight of the practice autopilot, recorded as a ground station and as the vehicle itself record it."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mission_strategies import example_plan
from practice_rig import Peer, Rig, mavlink, mission_messages
from sparsor.link.recorder import STREAMS

if TYPE_CHECKING:
    from pathlib import Path

COMPANION = Peer(1, 191, 1)
COMPANION_LATE_S, COMPANION_RATE = 4.0, 0.5
HEIGHT_M = 60.0


@dataclass(frozen=True)
class RecordedFlight:
    """The records of the ground station's log, the unix time of power-up, and the vehicle's own log."""

    records: list[bytes]
    boot_unix_s: float
    vehicle_log: Path

    @property
    def tlog(self) -> bytes:
        return b"".join(self.records)


def field(lon_deg: float, lat_deg: float) -> float:
    """What the practice sensor flies through: a smooth hill over the example's place."""
    return math.exp(-(((lon_deg - 51.515) / 0.01) ** 2) - ((lat_deg - 25.285) / 0.01) ** 2)


def recorded_flight(autopilot: str, folder: Path, *, stops: int = 2) -> RecordedFlight:
    """Fly a plan from take-off to disarming; a companion with a clock of its own sends NO2C once a second."""
    plan = example_plan(autopilot, stops=stops)
    rig = Rig.of(autopilot, plan=plan, truth=field, logs=folder)
    boot_unix_s = rig.vehicle.settings.boot_unix_s
    vehicle, companion = (mavlink.MAVLink(None, 1, component) for component in (1, COMPANION.component))
    records: list[bytes] = []

    def keep(sender: mavlink.MAVLink, message: object) -> None:
        unix_us = round((boot_unix_s + rig.vehicle.time_s) * 1e6)
        records.append(struct.pack(">Q", unix_us) + message.pack(sender))
        sender.seq = (sender.seq + 1) % 256

    def step() -> None:
        rig.heard.clear()
        if round(rig.vehicle.time_s * 20) % 20 == 0 and rig.flight.armed:
            stamp_ms = round(COMPANION_RATE * (rig.vehicle.time_s - COMPANION_LATE_S) * 1e3)
            value = 0.1 * rig.vehicle.time_s
            message = mavlink.MAVLink_named_value_float_message(stamp_ms, b"NO2C", value)
            rig.send(message, COMPANION)
            keep(companion, message)
        rig.run(0.05, step_s=0.05)
        for message in rig.heard:
            keep(vehicle, message)

    for name, rate_hz in STREAMS.items():
        rig.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, getattr(mavlink, f"MAVLINK_MSG_ID_{name}"), 1e6 / rate_hz)
    while rig.vehicle.time_s < 10:
        step()
    rig.upload(mission_messages(plan, autopilot))
    rig.take_off()
    while rig.flight.armed:
        step()
    for _ in range(20):
        step()
    (log,) = folder.iterdir()
    return RecordedFlight(records, boot_unix_s, log)
