"""A vehicle for the tests of the link: heartbeats, the mission protocol, a few parameters; no flight.

It stands in where a test wants to script what the vehicle does wrong.
"""

from __future__ import annotations

import socket
import struct
import threading
import time
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

ARDUPILOT, PX4 = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4
HOME = (252_600_000, 515_000_000, 7.0)  # where ArduPilot says it is, whatever item 0 says


@dataclass
class Vehicle:
    """What it is, what it holds, and what it does wrong."""

    autopilot: int = ARDUPILOT
    systems: tuple[int, ...] = (1,)
    vehicle_type: int = mavlink.MAV_TYPE_QUADROTOR
    armed: bool = False
    speaks: bytes | None = None  # sent instead of MAVLink
    beats: bool = True
    room: int = 650
    refuses: int | None = None  # a mission type whose upload is denied
    spoils: dict[str, Any] = field(default_factory=dict)  # fields of mission item 2 that are read back wrong
    dies_at: int | None = None  # item after whose arrival nothing is ever sent again
    fence_enable: float = 0.0
    copies: int = 1  # of every frame it sends
    stored: dict[int, list[Any]] = field(default_factory=lambda: {0: [], 1: [], 2: []})
    current: int = -1
    dead: bool = False


class VehicleEndpoint:
    """A thread with a UDP socket on a free port of this computer."""

    def __init__(self, vehicle: Vehicle | None = None, send_to: int | None = None) -> None:
        self.vehicle = vehicle or Vehicle()
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.02)
        self.peer = None if send_to is None else ("127.0.0.1", send_to)
        self.codecs = {number: mavlink.MAVLink(None, number, 1) for number in self.vehicle.systems}
        self.parser = mavlink.MAVLink(None)
        self.parser.robust_parsing = True
        self.sent: list[bytes] = []
        self.heard: list[Any] = []
        self.upload: dict[str, Any] | None = None
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)

    @property
    def url(self) -> str:
        return f"udpout://127.0.0.1:{self.socket.getsockname()[1]}"

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.stop.set()
        self.thread.join()
        self.socket.close()

    def send(self, message, system=None):
        if self.peer is None or self.vehicle.dead:
            return
        codec = self.codecs[system or self.vehicle.systems[0]]
        raw = bytes(message.pack(codec))
        codec.seq = (codec.seq + 1) % 256
        for _ in range(self.vehicle.copies):
            self.socket.sendto(raw, self.peer)
            self.sent.append(raw)

    def beat(self):
        if self.vehicle.speaks is not None and self.peer is not None:
            self.socket.sendto(self.vehicle.speaks, self.peer)
        elif self.vehicle.beats:
            mode = 128 if self.vehicle.armed else 0
            for system in self.vehicle.systems:
                beat = mavlink.MAVLink_heartbeat_message(
                    self.vehicle.vehicle_type, self.vehicle.autopilot, mode, 0, 3, 3
                )
                self.send(beat, system)

    def run(self):
        next_beat = 0.0
        while not self.stop.is_set():
            if self.peer is not None and time.monotonic() >= next_beat:
                self.beat()
                next_beat = time.monotonic() + 0.25
            try:
                data, self.peer = self.socket.recvfrom(4096)
            except (TimeoutError, ConnectionError):
                continue
            for message in self.parser.parse_buffer(data) or []:
                self.heard.append(message)
                answer = getattr(self, f"on_{message.get_type().lower()}", None)
                if answer and message.target_system in self.vehicle.systems:
                    answer(message)

    def ack(self, to, result, kind):
        self.send(mavlink.MAVLink_mission_ack_message(to.get_srcSystem(), to.get_srcComponent(), result, kind))

    def request(self, to):
        number = len(self.upload["items"])
        self.send(
            mavlink.MAVLink_mission_request_int_message(
                to.get_srcSystem(), to.get_srcComponent(), number, self.upload["kind"]
            )
        )

    def on_mission_count(self, message):
        if message.mission_type == self.vehicle.refuses:
            self.ack(message, mavlink.MAV_MISSION_DENIED, message.mission_type)
        elif message.count > self.vehicle.room:
            self.ack(message, mavlink.MAV_MISSION_NO_SPACE, message.mission_type)
        else:
            self.upload = {"kind": message.mission_type, "count": message.count, "items": []}
            self.request(message)

    def on_mission_item_int(self, message):
        if self.upload is None or message.seq != len(self.upload["items"]):
            return
        self.upload["items"].append(message)
        if message.seq == self.vehicle.dies_at:
            self.vehicle.dead = True
        if len(self.upload["items"]) < self.upload["count"]:
            self.request(message)
            return
        self.vehicle.stored[self.upload["kind"]] = self.upload["items"]
        self.ack(message, mavlink.MAV_MISSION_ACCEPTED, self.upload["kind"])
        self.upload = None

    def on_mission_clear_all(self, message):
        for kind in (0, 1, 2) if message.mission_type == 255 else (message.mission_type,):
            self.vehicle.stored[kind] = []
        self.ack(message, mavlink.MAV_MISSION_ACCEPTED, message.mission_type)

    def on_mission_request_list(self, message):
        count = len(self.vehicle.stored[message.mission_type])
        self.send(
            mavlink.MAVLink_mission_count_message(
                message.get_srcSystem(), message.get_srcComponent(), count, message.mission_type
            )
        )

    def on_mission_request_int(self, message):
        kind, number = message.mission_type, message.seq
        held = self.vehicle.stored[kind][number]
        fields = {name: getattr(held, name) for name in held.fieldnames}
        fields |= {"target_system": message.get_srcSystem(), "target_component": message.get_srcComponent()}
        if kind == 0:
            fields = {name: 0.0 if value != value else value for name, value in fields.items()}
            if number == 0 and self.vehicle.autopilot == ARDUPILOT:
                fields |= {"x": HOME[0], "y": HOME[1], "z": HOME[2], "frame": 0}
            if number == 2:
                fields |= self.vehicle.spoils
        self.send(mavlink.MAVLink_mission_item_int_message(**fields))

    def on_mission_set_current(self, message):
        self.vehicle.current = message.seq
        self.send(mavlink.MAVLink_mission_current_message(message.seq))

    def on_param_request_read(self, message):
        held = {"FENCE_ENABLE": self.vehicle.fence_enable, "FENCE_TYPE": 5.0, "FENCE_ALT_MAX": 50.0}
        if self.vehicle.autopilot == PX4:
            held = {"GF_ACTION": struct.unpack("<f", struct.pack("<i", 2))[0]}
        kind = 6 if self.vehicle.autopilot == PX4 else 9
        if message.param_id in held:
            name = message.param_id.encode()
            self.send(mavlink.MAVLink_param_value_message(name, held[message.param_id], kind, 2, 0))

    def on_command_long(self, message):
        if message.command == mavlink.MAV_CMD_DO_SET_MISSION_CURRENT:
            self.vehicle.current = int(message.param1)
        self.send(mavlink.MAVLink_command_ack_message(message.command, 0))
        if message.command == mavlink.MAV_CMD_REQUEST_MESSAGE and message.param1 == 33:
            self.send(mavlink.MAVLink_global_position_int_message(1000, *HOME[:2], 7000, 0, 0, 0, 0, 0))
