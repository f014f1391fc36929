"""The practice autopilot without its sockets: messages and time in, messages out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.errors import InputError
from sparsor.link.practice.commands import Commands
from sparsor.link.practice.exchange import Message, Outgoing, Peer
from sparsor.link.practice.failsafes import Failsafes
from sparsor.link.practice.flavour import ARDUPILOT, Flavour
from sparsor.link.practice.flight import Flight
from sparsor.link.practice.logserver import REQUESTS, LogServer
from sparsor.link.practice.messages import boot_ms, heartbeat, mission_current
from sparsor.link.practice.narrator import Narrator
from sparsor.link.practice.parameters import Parameters
from sparsor.link.practice.sensor import PracticeSensor, SensorSettings, Truth
from sparsor.link.practice.storage import StoredItem
from sparsor.link.practice.telemetry import Telemetry
from sparsor.link.practice.transfer import MissionStore
from sparsor.link.practice.transfer_ardupilot import ArduPilotTransfers
from sparsor.link.practice.transfer_px4 import Px4Transfers
from sparsor.link.practice.troubles import Troubles, during
from sparsor.link.practice.vehiclelog import NamedValue, VehicleLog
from sparsor.link.practice.wind import Wind, WindSettings
from sparsor.vehicle import Vehicle, autopilot_named, load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from sparsor.link.practice.transfer import Transfers
    from sparsor.mission import Home

STEP_S = 0.05
COMPONENT = mavlink.MAV_COMP_ID_AUTOPILOT1


@dataclass(frozen=True)
class PracticeSettings:
    """What the practice autopilot is.

    Parameters
    ----------
    home : Home
        Where it stands at power-up.
    flavour : Flavour
    vehicle : Vehicle
    sensor : SensorSettings
    truth : callable, optional
        The field's value s at a longitude and latitude; None flies no sensor.
    wind : WindSettings
    troubles : Troubles
    seed : int
        Of the sensor, the gusts and the bad links.
    system : int
        MAVLink system id, 1..255.
    ready_s : float
        Simulated seconds from power-up to being ready to fly missions.
    boot_unix_s : float
        What the clock says at power-up, seconds since 1970.
    logs : Path, optional
        Folder for the vehicle's own logs; None keeps them as long as the program runs.

    Raises
    ------
    InputError
        When a value is out of range.
    """

    home: Home
    flavour: Flavour = ARDUPILOT
    vehicle: Vehicle = field(default_factory=lambda: load_vehicle("quad"))
    sensor: SensorSettings = field(default_factory=SensorSettings)
    truth: Truth | None = None
    wind: WindSettings = field(default_factory=WindSettings)
    troubles: Troubles = field(default_factory=Troubles)
    seed: int = 0
    system: int = 1
    ready_s: float = 8.0
    boot_unix_s: float = 1_700_000_000.0
    logs: Path | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.system <= 255:
            raise InputError(f"system id {self.system}; allowed are 1..255")
        if self.seed < 0:
            raise InputError(f"seed {self.seed}; it has to be 0 or above")
        if not 0 <= self.ready_s < 3600:
            raise InputError(f"ready after {self.ready_s:g} s; allowed are 0..3600")


@dataclass(frozen=True)
class Sample:
    """A value that the sensor sent, and where and when it was taken (simulated seconds since power-up)."""

    time_s: float
    lon_deg: float
    lat_deg: float
    up_m: float
    value: float


class PracticeAutopilot:
    """A vehicle that speaks MAVLink: `receive` what clients send, `advance` the time.

    Two clocks run through it: simulated seconds move the vehicle, its telemetry and its message times; the
    wall clock moves the timeouts of the mission protocol, because clients wait by theirs.

    Parameters
    ----------
    settings : PracticeSettings
    told : callable
        Gets a line for everything that happens to it (`Narrator`).
    """

    def __init__(self, settings: PracticeSettings, told: Callable[[str], None] = lambda _: None) -> None:
        home, flavour = settings.home, settings.flavour
        lat, lon = round(home.lat_deg * 1e7), round(home.lon_deg * 1e7)
        self.settings = settings
        self.store = MissionStore(
            limits=autopilot_named(flavour.name),
            home=StoredItem(mavlink.MAV_CMD_NAV_WAYPOINT, 0, (0.0, 0.0, 0.0, 0.0), lat, lon, home.alt_amsl_m),
        )
        self.parameters = Parameters(flavour, self.store, settings.system)
        self.flight = Flight(
            flavour,
            settings.vehicle,
            self.store,
            self.parameters,
            home,
            settings.ready_s,
            Wind(settings.wind, settings.seed),
            settings.troubles,
        )
        self._failsafes = Failsafes(self.flight)
        self.narrator = Narrator(self.flight, told)
        self.samples: list[Sample] = []
        """What the sensor sent so far."""
        make = Px4Transfers if flavour.is_px4 else ArduPilotTransfers
        self._transfers: Transfers = make(flavour, self.store)
        self._telemetry = Telemetry(self.flight, settings.boot_unix_s)
        self._commands = Commands(self.flight, self._telemetry)
        self._sensor = PracticeSensor(settings.truth, settings.sensor, settings.seed) if settings.truth else None
        self._log = VehicleLog(self.flight, settings.boot_unix_s, settings.system, settings.logs)
        self._log_server = LogServer(self._log, px4=flavour.is_px4)
        self._steps = 0
        self._beat_s = self._beat_wall_s = float("-inf")
        self._current = -1

    @property
    def time_s(self) -> float:
        """Simulated seconds since power-up."""
        return self.flight.time_s

    @property
    def link_lost(self) -> bool:
        """Whether a link loss is on: nothing gets in or out."""
        return self.flight.link_lost

    def join(self, link: int) -> None:
        """Send telemetry to a link that opened."""
        self._telemetry.join(link)

    def leave(self, link: int) -> None:
        """Forget a link that closed."""
        self._telemetry.leave(link)
        self._log_server.leave(link)

    def receive(self, message: Message, peer: Peer, now_s: float) -> list[Outgoing]:
        """Return the answers to one message.

        Parameters
        ----------
        message : pymavlink message
        peer : Peer
            Who sent it.
        now_s : float
            Wall clock, seconds from any origin.
        """
        if not self.is_for_me(message) or self.link_lost:
            return []
        name = message.get_type()
        if name == "HEARTBEAT" and message.type == mavlink.MAV_TYPE_GCS:
            self.flight.station_heard = True
        if name == "MISSION_SET_CURRENT":
            return self._set_current(message.seq, peer)
        if name.startswith("MISSION_"):
            return self._transfers.receive(message, peer, now_s)
        if name in ("COMMAND_LONG", "COMMAND_INT", "SET_MODE"):
            return self._commands.receive(message, peer) + self._said()
        if name in ("PARAM_REQUEST_LIST", "PARAM_REQUEST_READ", "PARAM_SET"):
            return self.parameters.receive(message, peer)
        if name in REQUESTS:
            return self._log_server.receive(message, peer, armed=self.flight.armed)
        if name == "NAMED_VALUE_FLOAT":
            sender = (peer.system, peer.component)
            self._log.named_value(NamedValue(message.time_boot_ms, message.name, message.value, *sender))
        if name == "REQUEST_DATA_STREAM":
            rate = message.req_message_rate if message.start_stop else 0
            self._telemetry.request_group(peer.link, message.req_stream_id, rate)
        if name == "TIMESYNC" and message.tc1 == 0:
            reply = mavlink.MAVLink_timesync_message(round(self.time_s * 1e9), message.ts1)
            return [Outgoing(reply, peer.link)]
        return []

    def advance(self, until_s: float, now_s: float) -> list[Outgoing]:
        """Let simulated time run in fixed steps until `until_s`; returns what was sent on the way, in order."""
        out = self._on_air(self._transfers.advance(now_s) + self._log_server.advance(now_s, armed=self.flight.armed))
        while (self._steps + 1) * STEP_S <= until_s + 1e-9:
            self._steps += 1
            self.flight.step(self._steps * STEP_S - self.flight.time_s)
            self._failsafes.step()
            self.narrator.step()
            out += self._on_air(self._said() + self._after_step())
        # One a second by either clock: a slowed-down flight still shows that it lives.
        if self.time_s - self._beat_s >= 1.0 or now_s - self._beat_wall_s >= 1.0:
            self._beat_s, self._beat_wall_s = self.time_s, now_s
            out += self._on_air([Outgoing(heartbeat(self.flight))])
        return out

    def is_for_me(self, message: Message) -> bool:
        """Whether a message is meant for this vehicle, alone or among others."""
        system, component = getattr(message, "target_system", 0), getattr(message, "target_component", 0)
        return system in (0, self.settings.system) and component in (0, COMPONENT)

    def _after_step(self) -> list[Outgoing]:
        self._log.step()
        out = self._telemetry.due()
        if self._current != self.flight.navigator.current:
            self._current = self.store.current = self.flight.navigator.current
            out.append(Outgoing(mission_current(self.flight)))
        if self._sensor is not None:
            lon, lat = self.flight.lon_lat_deg
            value = self._sensor.step(lon, lat, self.time_s)
            if value is not None and not during(self.settings.troubles.silent_sensor, self.flight.flown_s):
                now_ms, name = boot_ms(self.flight), self.settings.sensor.name
                out.append(Outgoing(mavlink.MAVLink_named_value_float_message(now_ms, name.encode(), value)))
                self._log.named_value(NamedValue(now_ms, name, value, self.settings.system, COMPONENT))
                self.samples.append(Sample(self.time_s, lon, lat, self.flight.motion.up_m, value))
        return out

    def _set_current(self, seq: int, peer: Peer) -> list[Outgoing]:
        if not self.flight.set_current(seq):
            return self._said()
        self._current = self.store.current = self.flight.navigator.current
        # ArduPilot answers with the number that was asked for, home's too.
        message = mission_current(self.flight)
        message.seq = seq
        return [Outgoing(message, peer.link)]

    def _on_air(self, out: list[Outgoing]) -> list[Outgoing]:
        return [] if self.link_lost else out

    def _said(self) -> list[Outgoing]:
        out, self.flight.outbox = self.flight.outbox, []
        for one in out:
            if one.message.get_type() == "STATUSTEXT":
                self._log.text(one.message.severity, one.message.text)
        return out
