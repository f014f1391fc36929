"""COMMAND_LONG, COMMAND_INT and SET_MODE."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.exchange import Message, Outgoing, Peer
from sparsor.link.practice.flavour import Mode
from sparsor.link.practice.messages import mission_current

if TYPE_CHECKING:
    from collections.abc import Callable

    from sparsor.link.practice.flight import Flight
    from sparsor.link.practice.telemetry import Telemetry

Params = tuple[float, ...]
FORCE = 21196.0
ACCEPTED, DENIED, FAILED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_FAILED


class Commands:
    """What MAV_CMDs do.

    Parameters
    ----------
    flight : Flight
    telemetry : Telemetry
    """

    def __init__(self, flight: Flight, telemetry: Telemetry) -> None:
        self._flight = flight
        self._telemetry = telemetry
        self._known: dict[int, Callable[[Params, Peer], tuple[int, list[Outgoing]]]] = {
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._arm,
            mavlink.MAV_CMD_DO_SET_MODE: self._mode,
            mavlink.MAV_CMD_MISSION_START: self._start,
            mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: self._current,
            mavlink.MAV_CMD_NAV_TAKEOFF: self._take_off,
            mavlink.MAV_CMD_NAV_LAND: lambda _p, _f: (flight.set_mode(Mode.LAND), []),
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda _p, _f: (flight.set_mode(Mode.RETURN), []),
            mavlink.MAV_CMD_DO_PAUSE_CONTINUE: self._pause,
            mavlink.MAV_CMD_DO_CHANGE_SPEED: self._speed,
            mavlink.MAV_CMD_DO_REPOSITION: self._reposition,
            mavlink.MAV_CMD_DO_FENCE_ENABLE: self._fence,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._interval,
            mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: self._tell_interval,
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._message,
            mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: lambda _p, f: self._message((148.0,), f),
            mavlink.MAV_CMD_GET_HOME_POSITION: lambda _p, f: self._message((242.0,), f),
        }

    def receive(self, message: Message, peer: Peer) -> list[Outgoing]:
        """Return the answers to COMMAND_LONG, COMMAND_INT or SET_MODE; the ack comes first."""
        if message.get_type() == "SET_MODE":
            result = self._flight.set_mode(self._flight.flavour.mode_of(message.custom_mode))
            command, answers = mavlink.MAV_CMD_DO_SET_MODE, list[Outgoing]()
            if self._flight.flavour.is_px4:
                return []  # PX4 answers the message with nothing but its heartbeat
        else:
            command = message.command
            known = self._known.get(command)
            result, answers = known(_params(message), peer) if known else (mavlink.MAV_RESULT_UNSUPPORTED, [])
        ack = mavlink.MAVLink_command_ack_message(command, result, 0, 0, peer.system, peer.component)
        return [Outgoing(ack, peer.link), *answers]

    def _arm(self, params: Params, _: Peer) -> tuple[int, list[Outgoing]]:
        force = params[1] == FORCE
        return (self._flight.arm(force=force) if params[0] == 1 else self._flight.disarm(force=force)), []

    def _mode(self, params: Params, _: Peer) -> tuple[int, list[Outgoing]]:
        if not int(params[0]) & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return DENIED, []
        custom = int(params[1])
        if self._flight.flavour.is_px4:
            custom = custom << 16 | int(params[2]) << 24
        return self._flight.set_mode(self._flight.flavour.mode_of(custom)), []

    def _start(self, params: Params, _: Peer) -> tuple[int, list[Outgoing]]:
        if not self._flight.flavour.is_px4 and any(params[:2]):
            return DENIED, []  # ArduPilot flies missions from the beginning only
        return self._flight.start_mission(), []

    def _current(self, params: Params, peer: Peer) -> tuple[int, list[Outgoing]]:
        if not self._flight.set_current(int(params[0])):
            return DENIED, []
        return ACCEPTED, [Outgoing(mission_current(self._flight), peer.link)]

    def _take_off(self, params: Params, _: Peer) -> tuple[int, list[Outgoing]]:
        up = params[6]
        if self._flight.flavour.is_px4:  # above sea level; not given: MIS_TAKEOFF_ALT
            default = self._flight.parameters["MIS_TAKEOFF_ALT"]
            up = default if math.isnan(up) else up - self._flight.home_amsl_m
        return self._flight.take_off(up), []

    def _pause(self, params: Params, _: Peer) -> tuple[int, list[Outgoing]]:
        return self._flight.set_mode(Mode.MISSION if params[0] == 1 else Mode.HOLD), []

    def _speed(self, params: Params, _: Peer) -> tuple[int, list[Outgoing]]:
        if not params[1] > 0:
            return DENIED, []
        self._flight.navigator.speed_m_s = params[1]
        return ACCEPTED, []

    def _reposition(self, params: Params, _: Peer) -> tuple[int, list[Outgoing]]:
        lat, lon, amsl = params[4:7]
        if math.isnan(lat) or math.isnan(lon):
            return DENIED, []
        flight = self._flight
        up = flight.motion.up_m if math.isnan(amsl) else amsl - flight.home_amsl_m
        return flight.fly_to(lon, lat, up), []

    def _fence(self, params: Params, _: Peer) -> tuple[int, list[Outgoing]]:
        if self._flight.flavour.is_px4:
            return mavlink.MAV_RESULT_UNSUPPORTED, []
        self._flight.parameters.set("FENCE_ENABLE", float(params[0] != 0))
        return ACCEPTED, []

    def _interval(self, params: Params, peer: Peer) -> tuple[int, list[Outgoing]]:
        interval_s = params[1] if params[1] <= 0 else params[1] * 1e-6
        known = self._telemetry.set_interval(peer.link, int(params[0]), interval_s)
        return (ACCEPTED if known else FAILED), []

    def _tell_interval(self, params: Params, peer: Peer) -> tuple[int, list[Outgoing]]:
        interval_s = self._telemetry.interval_s(peer.link, int(params[0]))
        interval_us = round(interval_s * 1e6) if interval_s >= 0 else -1
        return ACCEPTED, [Outgoing(mavlink.MAVLink_message_interval_message(int(params[0]), interval_us), peer.link)]

    def _message(self, params: Params, peer: Peer) -> tuple[int, list[Outgoing]]:
        message = self._telemetry.build(int(params[0]))
        return (ACCEPTED, [Outgoing(message, peer.link)]) if message else (FAILED, [])


def _params(message: Message) -> Params:
    first = tuple(getattr(message, f"param{number}") for number in range(1, 5))
    if message.get_type() == "COMMAND_INT":
        placed = message.frame != mavlink.MAV_FRAME_MISSION
        scale = 1e-7 if placed else 1.0
        return (*first, message.x * scale, message.y * scale, message.z)
    return (*first, message.param5, message.param6, message.param7)
