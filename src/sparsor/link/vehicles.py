"""Which vehicle is on a link: told from its HEARTBEAT."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkError, LinkFailureError
from sparsor.mission.describe import VEHICLES
from sparsor.mission.plan import TITLES
from sparsor.vehicle import AUTOPILOTS

if TYPE_CHECKING:
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Received
    from sparsor.vehicle import Autopilot

NO_AUTOPILOT: Final = 8  # MAV_AUTOPILOT_INVALID: ground stations, companions, radios
GROUND_STATION: Final = 6  # MAV_TYPE_GCS
ARMED: Final = 128  # MAV_MODE_FLAG_SAFETY_ARMED
OTHERS_S: Final = 1.3  # heartbeats come once a second: wait this long for other vehicles


@dataclass(frozen=True)
class FoundVehicle:
    """An autopilot that was heard.

    Parameters
    ----------
    system_id, component_id : int
    firmware_type, vehicle_type : int
        MAV_AUTOPILOT and MAV_TYPE.
    armed : bool
    """

    system_id: int
    component_id: int
    firmware_type: int
    vehicle_type: int
    armed: bool

    @property
    def autopilot(self) -> Autopilot | None:
        """Facts about its autopilot; None for one that we know nothing of."""
        return next((facts for facts in AUTOPILOTS.values() if facts.firmware_type == self.firmware_type), None)

    @property
    def autopilot_title(self) -> str:
        """The autopilot as people write it."""
        return TITLES.get(self.firmware_type, f"autopilot type {self.firmware_type}")

    @property
    def vehicle_title(self) -> str:
        """The kind of vehicle as people write it."""
        return VEHICLES.get(self.vehicle_type, f"vehicle type {self.vehicle_type}")

    @property
    def words(self) -> str:
        """All of it.

        Examples
        --------
        >>> FoundVehicle(1, 1, 3, 2, False).words
        'ArduPilot quadrotor, system 1, disarmed'
        """
        state = "armed" if self.armed else "disarmed"
        return f"{self.autopilot_title} {self.vehicle_title}, system {self.system_id}, {state}"


def vehicle_of(received: Received) -> FoundVehicle | None:
    """Return the vehicle that a HEARTBEAT is of; None for other messages and for what is no vehicle."""
    if received.kind != "HEARTBEAT":
        return None
    beat, frame = received.message, received.frame
    if beat.autopilot == NO_AUTOPILOT or beat.type == GROUND_STATION:
        return None
    armed = bool(beat.base_mode & ARMED)
    return FoundVehicle(frame.system_id, frame.component_id, int(beat.autopilot), int(beat.type), armed)


def find_vehicle(connection: Connection, system_id: int | None = None, timeout_s: float = 10.0) -> FoundVehicle:
    """Wait for a vehicle.

    Parameters
    ----------
    connection : Connection
    system_id : int or None
        Which one; None for the only one there is.
    timeout_s : float

    Raises
    ------
    LinkError
        When several vehicles are there and none was asked for.
    LinkFailureError
        When none is heard, or not the one asked for; says what was heard.
    """
    found: dict[int, FoundVehicle] = {}
    others: set[int] = set()
    deadline_s = time.monotonic() + timeout_s
    with connection.inbox("HEARTBEAT") as inbox:
        while (received := next(inbox.until(deadline_s), None)) is not None:
            vehicle = vehicle_of(received)
            if vehicle is None:
                others.add(received.frame.system_id)
                continue
            if vehicle.system_id == system_id:
                return vehicle
            if system_id is None and not found:
                deadline_s = time.monotonic() + OTHERS_S
            found[vehicle.system_id] = vehicle
    if not found or system_id is not None:
        raise _silence(connection, system_id, timeout_s, found, others)
    if len(found) > 1:
        listed = "; ".join(found[number].words for number in sorted(found))
        raise LinkError(f"there are several vehicles on {connection.address.url}: {listed}. Choose one with --system")
    return next(iter(found.values()))


def _silence(
    connection: Connection,
    system_id: int | None,
    timeout_s: float,
    found: dict[int, FoundVehicle],
    others: set[int],
) -> LinkFailureError:
    url, kind = connection.address.url, connection.address.kind
    if found:
        listed = "; ".join(found[number].words for number in sorted(found))
        return LinkFailureError(f"system {system_id} was not heard on {url} within {timeout_s:g} s; there is {listed}")
    if others:
        listed = ", ".join(str(number) for number in sorted(others))
        return LinkFailureError(
            f"no autopilot was heard on {url} within {timeout_s:g} s, only system {listed} without one "
            "(a ground station, radio or companion). Is the vehicle on and in range?"
        )
    if connection.frames_received:
        return LinkFailureError(f"MAVLink comes from {url}, but no HEARTBEAT of an autopilot within {timeout_s:g} s")
    if connection.bytes_received:
        wrong = "the baud rate is wrong, or it" if kind == "serial" else "it"
        return LinkFailureError(
            f"{connection.bytes_received} bytes came from {url} in {timeout_s:g} s, but no MAVLink: {wrong} is the "
            "port of something else"
        )
    hints = {
        "udpin": "Does the vehicle send to this computer and port (PX4's SITL to 14540, sim_vehicle.py to 14550)?",
        "udpout": "Is this the host and port it listens on? If it sends to us instead, give udpin://0.0.0.0:PORT.",
        "serial": "Is this the autopilot's port, and its baud rate (57600 for radios, 115200 for USB)?",
        "tcpout": "Is this the autopilot's port, and is no other program connected to it (SITL serves one at a time)?",
        "tcpin": "Does the vehicle connect to this computer and port? To connect to it, give tcpout://HOST:PORT.",
    }
    return LinkFailureError(f"nothing came from {url} within {timeout_s:g} s. {hints[kind]}")
