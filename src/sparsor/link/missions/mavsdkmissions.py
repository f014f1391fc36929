"""mavsdk's mission protocol, fed from our connection."""

from __future__ import annotations

import functools
import math
import threading
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from sparsor.core.mavlink_frames import FrameReader
from sparsor.errors import LinkFailureError, SparsorError
from sparsor.link.connection import lost
from sparsor.link.missions.dialogue import SILENT_S
from sparsor.link.missions.sending import INVALID_SEQUENCE
from sparsor.link.missions.wire import FENCE, KINDS, MISSION, RALLY, WireItem

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from sparsor.core.progress import Progress
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Received
    from sparsor.link.vehicles import FoundVehicle

RECENT: Final = 64  # frames among which a repeated one is a duplicate of the link; sequence numbers repeat after 256
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


class MavsdkMissions:
    """mavsdk's mission protocol with one vehicle of a connection.

    mavsdk gets the vehicle's frames only: whatever else is on the link, it finds one autopilot. Held back from it are
    frames that the link delivered twice, acks of another kind than it transfers, and MAV_MISSION_INVALID_SEQUENCE:
    ArduPilot's echo of an item that mavsdk sent again, on which it would give up.

    Parameters
    ----------
    connection : Connection
    vehicle : FoundVehicle
    timeout_s : float
        How long mavsdk may take to see the vehicle, seconds.

    Raises
    ------
    UnheardError
        When mavsdk, which needs more than one heartbeat, does not see it; from every method: when it gives up on the
        link.
    """

    def __init__(self, connection: Connection, vehicle: FoundVehicle, timeout_s: float) -> None:
        from mavsdk import ComponentType, Configuration, Mavsdk
        from mavsdk.plugins.mission_raw import MissionRaw

        _keep_silent()
        self._connection, self._vehicle = connection, vehicle
        self._kind = MISSION
        self._feeding = threading.Lock()
        self._closed = False
        self._recent: deque[bytes] = deque(maxlen=RECENT)
        self._outgoing = FrameReader()
        self._mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        self._mavsdk.add_any_connection("raw://")
        self._mavsdk.subscribe_raw_bytes_to_be_sent(self._send)
        self._plugin: Any = None
        self._end = connection.listen(self._feed)
        try:
            self._plugin = MissionRaw(self._system(timeout_s))
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End mavsdk; nothing is sent after that; can be called twice."""
        self._end()
        with self._feeding:  # the reading thread may be giving it a frame: not to one that is destroyed
            self._closed = True
        # Its threads may call what waits for an abandoned transfer until it is destroyed; it lets go of that before.
        waiting = list(vars(self._plugin)["_callbacks"]) if self._plugin is not None else []
        self._mavsdk.destroy()
        waiting.clear()

    def upload(self, kind: int, items: Sequence[WireItem], progress: Progress) -> None:
        """Send all items of a MAV_MISSION_TYPE."""
        self._kind = kind
        wanted = [mavsdk_item(number, kind, item) for number, item in enumerate(items)]
        if kind == MISSION:
            self._upload_mission(wanted, progress)
            return
        starts = {FENCE: self._plugin.upload_geofence_async, RALLY: self._plugin.upload_rally_points_async}
        self._wait(f"sending {KINDS[kind]}", lambda done: starts[kind](wanted, lambda result, _: done(result)))

    def download(self, kind: int) -> tuple[WireItem, ...]:
        """Return what the vehicle holds of a MAV_MISSION_TYPE."""
        self._kind = kind
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
        return tuple(map(wire_item, held))

    def cancel(self) -> None:
        """Give up an upload that runs."""
        with suppress(Exception):  # mavsdk raises when none runs
            self._plugin.cancel_mission_upload()

    def _system(self, timeout_s: float) -> Any:  # noqa: ANN401 # mavsdk has no types
        system = self._mavsdk.first_autopilot(timeout_s)
        if system is None:
            raise UnheardError(f"{self._vehicle.words} fell silent before the transfer began")
        return system

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
        with self._feeding:
            if self._closed or received.frame.system_id != self._vehicle.system_id or raw in self._recent:
                return
            self._recent.append(raw)
            if not self._held_back(received):
                self._mavsdk.pass_received_raw_bytes(raw)

    def _held_back(self, received: Received) -> bool:
        message = received.message
        return received.kind == "MISSION_ACK" and (
            message.mission_type != self._kind or message.type == INVALID_SEQUENCE
        )

    def _send(self, raw: bytes) -> None:
        with suppress(SparsorError):  # the connection remembers why it failed, and `_wait` asks it
            self._connection.send_frames(raw, self._outgoing.feed(raw))


@functools.cache
def _keep_silent() -> None:
    """Stop mavsdk's words on stdout, which carries the command's result; once, for it frees the function it had."""
    from mavsdk.logging import log_subscribe

    log_subscribe(lambda *_: True)


def mavsdk_item(number: int, kind: int, item: WireItem) -> Any:  # noqa: ANN401 # mavsdk has no types
    """Return a WireItem as mavsdk's MissionItem."""
    from mavsdk.plugins.mission_raw import MissionItem

    one, two, three, four = item.params
    return MissionItem(
        seq=number, frame=item.frame, command=item.command, current=int(number == 0),
        autocontinue=int(item.autocontinue), param1=one, param2=two, param3=three, param4=four,
        x=item.x, y=item.y, z=item.z, mission_type=kind,
    )  # fmt: skip


def wire_item(item: Any) -> WireItem:  # noqa: ANN401 # mavsdk has no types
    """Return mavsdk's MissionItem as a WireItem."""
    params = (float(item.param1), float(item.param2), float(item.param3), float(item.param4))
    return WireItem(
        int(item.command), int(item.frame), params, int(item.x), int(item.y), float(item.z), bool(item.autocontinue)
    )
