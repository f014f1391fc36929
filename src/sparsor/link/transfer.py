"""Missions, fences and rally points to the vehicle and back, through mavsdk over our connection."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, Self

from sparsor.core.mavlink_frames import FrameReader
from sparsor.core.progress import silent
from sparsor.errors import LinkFailureError, SparsorError
from sparsor.link.connection import lost
from sparsor.link.resending import Resender
from sparsor.link.wire import FENCE, KINDS, MISSION, RALLY, WireItem

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from sparsor.core.progress import Progress
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Received
    from sparsor.link.vehicles import FoundVehicle

SILENT_S: Final = 10.0  # a vehicle that says nothing for so long is gone
RECENT: Final = 64  # frames among which a repeated one is a duplicate of the link; sequence numbers repeat after 256
ACK_S: Final = 1.0
TRIES: Final = 5
REASONS: Final = {
    "TIMEOUT": "it did not answer",
    "TOO_MANY_MISSION_ITEMS": "it has no room for so many",
    "INVALID_SEQUENCE": "items arrived out of order",
    "UNSUPPORTED": "it does not take this kind, or this command",
    "DENIED": "it denied the transfer",
    "INVALID_ARGUMENT": "it found a parameter invalid",
    "TRANSFER_CANCELLED": "it cancelled the transfer",
}


# Results that a link which loses, delays or repeats brings about.
LINKS_FAULT: Final = frozenset({"TIMEOUT", "INVALID_SEQUENCE", "PROTOCOL_ERROR", "ERROR", "TRANSFER_CANCELLED"})


class UnheardError(LinkFailureError):
    """mavsdk gave up on the link; we have not yet."""


class Transfer:
    """mavsdk's mission protocol with one vehicle of a connection.

    mavsdk gets the vehicle's frames only: whatever else is on the link, it finds one autopilot. Frames that the
    link delivered twice are dropped on the way, because mavsdk gives up on them.

    Parameters
    ----------
    connection : Connection
    vehicle : FoundVehicle
    timeout_s : float
        How long mavsdk may take to see the vehicle, seconds.

    Raises
    ------
    LinkFailureError
        When mavsdk does not see it.

    Attributes
    ----------
    helped : set of str
        What mavsdk gave up on and our own, more patient `Resender` carried on with.
    """

    def __init__(self, connection: Connection, vehicle: FoundVehicle, timeout_s: float = 10.0) -> None:
        from mavsdk import ComponentType, Configuration, Mavsdk
        from mavsdk.logging import log_subscribe
        from mavsdk.plugins.mission_raw import MissionRaw

        log_subscribe(lambda *_: True)  # it prints on stdout, which carries the command's result
        self._connection, self._vehicle = connection, vehicle
        self.helped: set[str] = set()
        self._resender = Resender(connection, vehicle)
        self._recent: deque[bytes] = deque(maxlen=RECENT)
        self._outgoing = FrameReader()
        self._mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        self._mavsdk.add_any_connection("raw://")
        self._mavsdk.subscribe_raw_bytes_to_be_sent(self._send)
        self._end = connection.listen(self._feed)
        try:
            self._plugin: Any = MissionRaw(self._system(timeout_s))
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End mavsdk."""
        self._end()
        self._mavsdk.destroy()

    def upload(self, kind: int, items: Sequence[WireItem], progress: Progress = silent) -> None:
        """Send all items of a MAV_MISSION_TYPE; none clears what the vehicle holds of it.

        Raises
        ------
        LinkFailureError
            When the vehicle refuses or is gone.
        """
        if not items:
            self.clear(kind)
            return
        wanted = [_to_mavsdk(number, kind, item) for number, item in enumerate(items)]
        progress(f"send {KINDS[kind]}", 0, len(items))
        try:
            self._upload(kind, wanted, progress)
        except UnheardError:
            self.helped.add(KINDS[kind])
            self._resender.upload(kind, items, progress)
        progress(f"send {KINDS[kind]}", len(items), len(items))

    def download(self, kind: int) -> tuple[WireItem, ...]:
        """Return what the vehicle holds of a MAV_MISSION_TYPE, with home where it keeps it.

        Raises
        ------
        LinkFailureError
            When the vehicle does not answer.
        """
        try:
            return self._download(kind)
        except UnheardError:
            self.helped.add(KINDS[kind])
            return self._resender.download(kind)

    def _download(self, kind: int) -> tuple[WireItem, ...]:
        starts = {
            MISSION: self._plugin.download_mission_async,
            FENCE: self._plugin.download_geofence_async,
            RALLY: self._plugin.download_rallypoints_async,
        }
        held: list[Any] = []

        def start(done: Callable[[Any], None]) -> None:
            def told(result: Any, items: list[Any], _: object) -> None:  # noqa: ANN401 # mavsdk has no types
                held.extend(items)
                done(result)

            starts[kind](told)

        self._wait(f"reading its {KINDS[kind]}", start, allowed=("NO_MISSION_AVAILABLE",))
        return tuple(map(_from_mavsdk, held))

    def clear(self, kind: int) -> None:
        """Empty a MAV_MISSION_TYPE (MISSION_CLEAR_ALL, which mavsdk sends only for missions).

        Raises
        ------
        LinkFailureError
            When the vehicle does not accept it.
        """
        from pymavlink.dialects.v20 import ardupilotmega as mavlink

        vehicle = self._vehicle
        asked = mavlink.MAVLink_mission_clear_all_message(vehicle.system_id, vehicle.component_id, kind)
        with self._connection.inbox("MISSION_ACK", system_id=vehicle.system_id) as inbox:
            for _ in range(TRIES):
                self._connection.send(asked)
                for answer in inbox.until(time.monotonic() + ACK_S):
                    if answer.message.mission_type != kind:
                        continue
                    if answer.message.type == mavlink.MAV_MISSION_ACCEPTED:
                        return
                    raise LinkFailureError(
                        f"the vehicle does not clear its {KINDS[kind]} (result {answer.message.type})"
                    )
        raise LinkFailureError(f"the vehicle does not answer when asked to clear its {KINDS[kind]}")

    def set_current(self, item: int) -> None:
        """Make an item the next to be flown; asked again where the answer is lost.

        Raises
        ------
        LinkFailureError
            When the vehicle does not accept it.
        """
        for left in reversed(range(TRIES)):
            try:
                self._wait(
                    f"setting the current item to {item}",
                    lambda done: self._plugin.set_current_mission_item_async(item, lambda result, _: done(result)),
                )
            except UnheardError:
                if not left:
                    raise
            else:
                return

    def cancel(self) -> None:
        """Give up a transfer that runs."""
        with suppress(Exception):  # mavsdk raises when none runs
            self._plugin.cancel_mission_upload()

    def _system(self, timeout_s: float) -> Any:  # noqa: ANN401 # mavsdk has no types
        system = self._mavsdk.first_autopilot(timeout_s)
        if system is None:
            self._connection.check()
            raise LinkFailureError(f"{self._vehicle.words} fell silent before the transfer began")
        return system

    def _upload(self, kind: int, wanted: list[Any], progress: Progress) -> None:
        if kind == MISSION:
            self._upload_mission(wanted, progress)
            return
        starts = {FENCE: self._plugin.upload_geofence_async, RALLY: self._plugin.upload_rally_points_async}
        self._wait(f"sending {KINDS[kind]}", lambda done: starts[kind](wanted, lambda result, _: done(result)))

    def _upload_mission(self, items: list[Any], progress: Progress) -> None:
        from mavsdk.plugins.mission_raw import MissionPlan, MissionRawResult

        def start(done: Callable[[Any], None]) -> None:
            def told(result: Any, data: Any, _: object) -> None:  # noqa: ANN401 # mavsdk has no types
                if result != MissionRawResult.NEXT:
                    done(result)
                elif not math.isnan(data.progress):
                    progress("send mission", round(data.progress * len(items)), len(items))

            self._plugin.upload_mission_with_progress_async(MissionPlan(items), told)

        self._wait("sending the mission", start)

    def _wait(self, doing: str, start: Callable[[Callable[[Any], None]], None], allowed: Sequence[str] = ()) -> None:
        """Start something of mavsdk's and wait for its result; a Ctrl-C or a lost link ends the wait."""
        ended = threading.Event()
        results: list[Any] = []

        def done(result: Any) -> None:  # noqa: ANN401 # mavsdk has no types
            results.append(result)
            ended.set()

        start(done)
        while not ended.wait(0.1):
            gone = lost(self._connection, self._vehicle.system_id, SILENT_S)
            if gone is not None:
                raise LinkFailureError(f"{gone}, while {doing}")
        name = str(results[0].name)
        if name != "SUCCESS" and name not in allowed:
            raise (UnheardError if name in LINKS_FAULT else LinkFailureError)(
                f"{doing} failed: {REASONS.get(name, name.replace('_', ' ').lower())} ({name})"
            )

    def _feed(self, received: Received) -> None:
        raw = received.frame.raw
        if received.frame.system_id == self._vehicle.system_id and raw not in self._recent:
            self._recent.append(raw)
            self._mavsdk.pass_received_raw_bytes(raw)

    def _send(self, raw: bytes) -> None:
        with suppress(SparsorError):  # the connection remembers why it failed, and `_wait` asks it
            self._connection.send_frames(raw, self._outgoing.feed(raw))


def _to_mavsdk(number: int, kind: int, item: WireItem) -> Any:  # noqa: ANN401 # mavsdk has no types
    from mavsdk.plugins.mission_raw import MissionItem

    one, two, three, four = item.params
    return MissionItem(
        seq=number, frame=item.frame, command=item.command, current=int(number == 0),
        autocontinue=int(item.autocontinue), param1=one, param2=two, param3=three, param4=four,
        x=item.x, y=item.y, z=item.z, mission_type=kind,
    )  # fmt: skip


def _from_mavsdk(item: Any) -> WireItem:  # noqa: ANN401 # mavsdk has no types
    params = (float(item.param1), float(item.param2), float(item.param3), float(item.param4))
    return WireItem(
        int(item.command), int(item.frame), params, int(item.x), int(item.y), float(item.z), bool(item.autocontinue)
    )
