"""The one owner of a link: a port can be opened once, and recording, uploading and watching all need it."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Final, Self

from sparsor.core.mavlink_frames import Frame, FrameReader
from sparsor.errors import LinkFailureError, SparsorError
from sparsor.link.inbox import Inbox, Message, Received
from sparsor.link.ports.addresses import Address, parse_address
from sparsor.link.ports.endpoints import open_endpoint

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from sparsor.link.tlog import TlogWriter

OUR_SYSTEM: Final = 255  # as ground stations call themselves; ArduPilot's SYSID_MYGCS
OUR_COMPONENT: Final = 190  # MAV_COMP_ID_MISSIONPLANNER
HEARTBEAT_S: Final = 1.0
POLL_S: Final = 0.05


class Connection:
    """An open link that several parts use at once.

    A thread reads. Every frame, in and out, goes to the recording; every frame that came in goes to the
    listeners, in order, on that thread: they have to be quick. Heartbeats of a ground station go out once a
    second, without which ArduPilot may fall back to its failsafe, and which open a UDP link.

    Parameters
    ----------
    address : Address or str
    recording : TlogWriter or None
        Closed by its owner, not by the connection.
    heartbeats : bool
        False: send nothing unasked.
    timeout_s : float
        How long a TCP connection may take to come up, seconds.

    Raises
    ------
    LinkError, LinkFailureError
        As `open_endpoint`.

    Attributes
    ----------
    failure : SparsorError or None
        Why the link is gone.
    bytes_received, frames_received : int
    """

    def __init__(
        self,
        address: Address | str,
        *,
        recording: TlogWriter | None = None,
        heartbeats: bool = True,
        timeout_s: float = 10.0,
    ) -> None:
        from pymavlink.dialects.v20 import ardupilotmega

        self.address = parse_address(address) if isinstance(address, str) else address
        self.failure: SparsorError | None = None
        self.bytes_received = self.frames_received = 0
        self._recording, self._heartbeats = recording, heartbeats
        self._codec = ardupilotmega.MAVLink(None, OUR_SYSTEM, OUR_COMPONENT)
        self._decoder = ardupilotmega.MAVLink(None)
        self._beat = ardupilotmega.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)  # GCS, no autopilot, active
        self._reader = FrameReader()
        self._sending = threading.Lock()
        self._listeners: tuple[Callable[[Received], None], ...] = ()
        self._listing = threading.Lock()
        self._heard: dict[int, float] = {}
        self._stop = threading.Event()
        self._endpoint = open_endpoint(self.address, timeout_s)
        self._thread = threading.Thread(target=self._run, name=f"link {self.address.url}", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop reading and give the port back; can be called twice."""
        self._stop.set()
        if threading.current_thread() is not self._thread:
            self._thread.join()
        self._endpoint.close()

    def check(self) -> None:
        """Raise LinkFailureError, or what the recording raised, when the link is gone."""
        if self.failure is not None:
            raise self.failure

    def silent_s(self, system_id: int) -> float:
        """Return how long nothing came from a system, seconds; infinite when it never was heard."""
        heard = self._heard.get(system_id)
        return float("inf") if heard is None else time.monotonic() - heard

    def listen(self, listener: Callable[[Received], None]) -> Callable[[], None]:
        """Call `listener` with every frame that comes, on the reading thread; call the result to end that."""
        with self._listing:
            self._listeners = (*self._listeners, listener)

        def end() -> None:
            with self._listing:
                self._listeners = tuple(other for other in self._listeners if other is not listener)

        return end

    def inbox(self, *kinds: str, system_id: int | None = None) -> Inbox:
        """Return a box that keeps the messages of these kinds from now on, until it is closed."""
        return Inbox(self, frozenset(kinds), system_id)

    def send(self, message: Message, *, as_system: int = OUR_SYSTEM, as_component: int = OUR_COMPONENT) -> None:
        """Send a pymavlink message as this ground station, or in the name of another one on our side.

        Raises
        ------
        LinkFailureError
            When the link is gone.
        """
        with self._sending:
            self._codec.srcSystem, self._codec.srcComponent = as_system, as_component
            raw = bytes(message.pack(self._codec))
            self._codec.seq = (self._codec.seq + 1) % 256  # `pack` leaves the counting to its caller
            self._put(raw, [Frame(raw)])

    def send_frames(self, raw: bytes, frames: Iterable[Frame]) -> None:
        """Send bytes that hold frames of somebody else (mavsdk), and record those frames."""
        with self._sending:
            self._put(raw, frames)

    def _put(self, raw: bytes, frames: Iterable[Frame]) -> None:
        self.check()
        try:
            self._endpoint.send(raw)
            if self._recording is not None:
                for frame in frames:
                    self._recording.write(frame)
        except SparsorError as error:
            self.failure = error
            raise

    def _run(self) -> None:
        next_beat_s = 0.0
        try:
            while not self._stop.is_set():
                if self._heartbeats and time.monotonic() >= next_beat_s:
                    self.send(self._beat)
                    next_beat_s = time.monotonic() + HEARTBEAT_S
                data = self._endpoint.receive(POLL_S)
                self.bytes_received += len(data)
                self._take(self._reader.feed(data))
        except SparsorError as error:
            self.failure = error
        finally:
            self._take_last()

    def _take_last(self) -> None:
        try:
            self._take(self._reader.flush())
        except SparsorError as error:
            self.failure = self.failure or error

    def _take(self, frames: Iterable[Frame]) -> None:
        for frame in frames:
            if self._recording is not None:
                self._recording.write(frame)
            self.frames_received += 1
            now_s = time.monotonic()
            self._heard[frame.system_id] = now_s
            received = Received(frame, self._decoded(frame), now_s)
            for listener in self._listeners:
                listener(received)

    def _decoded(self, frame: Frame) -> Message:
        from pymavlink.dialects.v20 import ardupilotmega

        try:
            return self._decoder.decode(bytearray(frame.raw))
        except ardupilotmega.MAVError as error:  # a payload that is shorter than the message's fields
            return ardupilotmega.MAVLink_bad_data(frame.raw, str(error))


def lost(connection: Connection, system_id: int, after_s: float) -> LinkFailureError | None:
    """Return why a vehicle counts as gone: the link broke, or nothing came for `after_s` seconds; else None."""
    if connection.failure is not None:
        return LinkFailureError(str(connection.failure))
    silent_s = connection.silent_s(system_id)
    return LinkFailureError(f"vehicle {system_id} has been silent for {silent_s:.0f} s") if silent_s > after_s else None
