"""An endpoint that only sends heartbeats, and MAVSDK's own .plan importer against it.

MAVSDK has to see an autopilot before it imports a plan, because what it makes of one depends on it.
`plan_importer` gives any test the importer for ArduPilot or PX4:

    with plan_importer("px4") as import_plan:
        data = import_plan(plan_bytes(plan).decode())
"""

from __future__ import annotations

import socket
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

AUTOPILOTS = {"ardupilot": mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, "px4": mavlink.MAV_AUTOPILOT_PX4}
CONNECT_S = 20.0


@contextmanager
def heartbeat_endpoint(autopilot: str) -> Iterator[str]:
    """Answer whoever sends a datagram with heartbeats of a quadrotor; yields the URL for MAVSDK."""
    server = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    server.bind(("127.0.0.1", 0))
    server.settimeout(0.05)
    stop = threading.Event()
    thread = threading.Thread(target=_serve, args=(server, AUTOPILOTS[autopilot], stop), daemon=True)
    thread.start()
    try:
        yield f"udpout://127.0.0.1:{server.getsockname()[1]}"
    finally:
        stop.set()
        thread.join()
        server.close()


@contextmanager
def plan_importer(autopilot: str) -> Iterator[Callable[[str], Any]]:
    """Yield MAVSDK's importer of .plan text as it works for an autopilot; it returns a MissionImportData."""
    from mavsdk import ComponentType, Configuration, Mavsdk
    from mavsdk.plugins.mission_raw import MissionRaw

    with heartbeat_endpoint(autopilot) as url:
        station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        try:
            station.add_any_connection(url)
            system = station.first_autopilot(timeout_s=CONNECT_S)
            assert system is not None, f"MAVSDK saw no {autopilot} within {CONNECT_S:g} s"
            yield MissionRaw(system).import_qgroundcontrol_mission_from_string
        finally:
            station.destroy()


def _serve(server: socket.socket, autopilot: int, stop: threading.Event) -> None:
    sender = mavlink.MAVLink(None, srcSystem=1, srcComponent=mavlink.MAV_COMP_ID_AUTOPILOT1)
    listener = None
    while not stop.is_set():
        try:
            listener = server.recvfrom(2048)[1]
        except TimeoutError:
            pass
        except OSError:  # Windows reports a closed peer here
            continue
        if listener is not None:
            beat = sender.heartbeat_encode(mavlink.MAV_TYPE_QUADROTOR, autopilot, 0, 0, mavlink.MAV_STATE_STANDBY, 3)
            server.sendto(beat.pack(sender), listener)
