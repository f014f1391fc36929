"""Recording a link to a .tlog."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sparsor.core.progress import silent
from sparsor.errors import LinkFailureError
from sparsor.link.connection import Connection
from sparsor.link.flights.orders import command_long
from sparsor.link.ports.addresses import parse_address
from sparsor.link.tlog import TlogWriter
from sparsor.link.vehicles import vehicle_of

if TYPE_CHECKING:
    from pathlib import Path

    from sparsor.core.progress import Progress
    from sparsor.link.vehicles import FoundVehicle

TICK_S: Final = 0.5
SET_MESSAGE_INTERVAL: Final = 511  # MAV_CMD
# What a map needs, and how often, Hz: a copter sends none of it until asked (MAV_CMD_SET_MESSAGE_INTERVAL).
STREAMS: Final = {
    "GLOBAL_POSITION_INT": 5.0,
    "GPS_RAW_INT": 2.0,
    "SYSTEM_TIME": 1.0,
    "ATTITUDE": 4.0,
    "MISSION_CURRENT": 1.0,
    "EXTENDED_SYS_STATE": 1.0,
    "SYS_STATUS": 1.0,
}


@dataclass(frozen=True)
class Recording:
    """What was recorded.

    Parameters
    ----------
    file : Path
    messages : int
        Frames in the file, ours among them.
    received : int
        Frames that came in.
    seconds : float
    vehicles : tuple of FoundVehicle
        The autopilots heard, as they were first heard.
    """

    file: Path
    messages: int
    received: int
    seconds: float
    vehicles: tuple[FoundVehicle, ...]


def record(
    url: str,
    path: Path,
    *,
    seconds: float = math.inf,
    timeout_s: float = 30.0,
    listen_only: bool = False,
    replace: bool = False,
    progress: Progress = silent,
) -> Recording:
    """Record every frame of a link, both directions, until the time is over or Ctrl-C.

    Parameters
    ----------
    url : str
        Address of the link.
    path : Path
        The .tlog.
    seconds : float
        How long; without end when infinite.
    timeout_s : float
        How long to wait for the first frame.
    listen_only : bool
        Send nothing: no heartbeat, no request for positions.
    replace : bool
        Whether a file that is there may be replaced.
    progress : Progress

    Raises
    ------
    LinkError
        When the address or the file cannot be used.
    LinkFailureError
        When nothing comes, or the link breaks; what came until then is in the file.
    """
    address = parse_address(url)
    tlog = TlogWriter(path, replace=replace)
    received = 0
    try:
        with Connection(address, recording=tlog, heartbeats=not listen_only, timeout_s=timeout_s) as connection:
            begun_s = time.monotonic()
            try:
                vehicles = _watch(connection, begun_s + seconds, timeout_s, listen_only, progress)
            finally:
                received = connection.frames_received
            took_s = time.monotonic() - begun_s
        return Recording(path, tlog.frames, connection.frames_received, took_s, vehicles)
    finally:
        if received:
            tlog.close()
        else:  # nothing but our own heartbeats
            tlog.discard()


def request_streams(connection: Connection, vehicle: FoundVehicle) -> None:
    """Ask a vehicle for what a map needs (`STREAMS`).

    Raises
    ------
    LinkFailureError
        When the link is gone.
    """
    for name in STREAMS:
        connection.send(command_long(vehicle, SET_MESSAGE_INTERVAL, *stream_params(name)))


def stream_params(name: str) -> tuple[float, float]:
    """Return the parameters of MAV_CMD_SET_MESSAGE_INTERVAL for one of `STREAMS`.

    Examples
    --------
    >>> stream_params("GLOBAL_POSITION_INT")
    (33.0, 200000.0)
    """
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    return float(getattr(mavlink, f"MAVLINK_MSG_ID_{name}")), 1e6 / STREAMS[name]


def _watch(
    connection: Connection, end_s: float, timeout_s: float, listen_only: bool, progress: Progress
) -> tuple[FoundVehicle, ...]:
    vehicles: dict[int, FoundVehicle] = {}
    begun_s = time.monotonic()
    try:
        with connection.inbox("HEARTBEAT") as inbox:
            while (now_s := time.monotonic()) < end_s:
                for received in inbox.until(min(now_s + TICK_S, end_s)):
                    vehicle = vehicle_of(received)
                    if vehicle is not None and vehicle.system_id not in vehicles:
                        vehicles[vehicle.system_id] = vehicle
                        if not listen_only:
                            request_streams(connection, vehicle)
                connection.check()
                if connection.frames_received == 0 and now_s - begun_s > timeout_s:
                    raise LinkFailureError(f"nothing came from {connection.address.url} within {timeout_s:g} s")
                if math.isfinite(end_s):
                    progress("record", round(now_s - begun_s), round(end_s - begun_s))
    except KeyboardInterrupt:
        pass  # this is how a recording without an end is ended
    return tuple(vehicles[number] for number in sorted(vehicles))
