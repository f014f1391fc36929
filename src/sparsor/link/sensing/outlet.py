"""The companion computer's end of a link: a heartbeat of its own, and a new connection whenever the old one breaks."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Final, Self

from sparsor.errors import LinkError, LinkFailureError, SparsorError
from sparsor.link.connection import HEARTBEAT_S, Connection, lost
from sparsor.link.ports.addresses import parse_address
from sparsor.link.sensing.backoff import Backoff
from sparsor.link.vehicles import find_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable

    from sparsor.link.inbox import Message

COMPANION: Final = 191  # MAV_COMP_ID_ONBOARD_COMPUTER
FIRST_GUESS: Final = 1  # the system id that nearly every vehicle has, until it is heard
FIND_S: Final = 3.0  # heartbeats come once a second
GONE_S: Final = 5.0
OPEN_S: Final = 3.0


class Outlet:
    """A link that messages go out by as a component of the vehicle.

    It is up while the vehicle's heartbeats come. When they stop, or the link breaks, it is made anew until the
    outlet is closed; what is sent meanwhile is lost, and `send` says so.

    Parameters
    ----------
    url : str
        Address of the link.
    system_id : int or None
        The vehicle's; None for the only one that is heard.
    component_id : int
    say : callable
        Told that the link is gone, and that it is back; once each.

    Raises
    ------
    LinkError
        When the address, port or device cannot be used; in the beginning only.

    Attributes
    ----------
    system_id : int or None
        The vehicle's, once it is heard.
    refusal : SparsorError or None
        Why no further attempt is made.
    """

    def __init__(
        self, url: str, *, system_id: int | None, component_id: int = COMPANION, say: Callable[[str], None]
    ) -> None:
        from pymavlink.dialects.v20 import ardupilotmega as mavlink

        self.system_id, self.component_id = system_id, component_id
        self.refusal: SparsorError | None = None
        self._address = parse_address(url)
        self._say = say
        self._beat = mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
        )
        self._next_beat_s = 0.0
        self._up, self._stop = threading.Event(), threading.Event()
        self._connection: Connection | None = None
        try:
            self._connection = self._opened()
        except LinkFailureError as error:  # nobody is there yet
            say(f"{error} (trying again)")
        self._thread = threading.Thread(target=self._run, name="sensor outlet", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    @property
    def is_up(self) -> bool:
        """Whether the vehicle is heard."""
        return self._up.is_set()

    def check(self) -> None:
        """Raise what ended the attempts: several vehicles, of which none was chosen."""
        if self.refusal is not None:
            raise self.refusal

    def beat(self) -> None:
        """Send the heartbeat when it is due; to be called ten times a second or more often."""
        now_s = time.monotonic()
        if now_s < self._next_beat_s:
            return
        self._next_beat_s = now_s + HEARTBEAT_S
        # A link that we call on is silent until we speak, so the vehicle's id may have to be guessed at first.
        if self.system_id is not None or self._address.kind == "udpout":
            self._put(self._beat)

    def send(self, message: Message) -> bool:
        """Send a message; False when the link is down and the message lost."""
        return self._up.is_set() and self._put(message)

    def _put(self, message: Message) -> bool:
        connection = self._connection
        if connection is None:
            return False
        try:
            connection.send(message, as_system=self.system_id or FIRST_GUESS, as_component=self.component_id)
        except LinkFailureError:
            return False
        return True

    def _opened(self) -> Connection:
        return Connection(self._address, heartbeats=False, timeout_s=OPEN_S)

    def _run(self) -> None:
        backoff, said = Backoff(), self._connection is None
        while not self._stop.is_set():
            try:
                self._connection = self._connection or self._opened()
                self._find(self._connection)
                if said:
                    self._say(f"{self._address.url} is back")
                backoff, said = Backoff(), False
                self._up.set()
                self._watch(self._connection)
            except (LinkError, LinkFailureError) as error:
                if self.refusal is None and not said and not self._stop.is_set():
                    self._say(f"{error} (trying again)")
                    said = True
            finally:
                self._up.clear()
                self._close()
            if self.refusal is not None:
                return
            self._stop.wait(backoff.next_s())

    def _find(self, connection: Connection) -> None:
        try:
            self.system_id = find_vehicle(connection, self.system_id, FIND_S).system_id
        except LinkError as error:
            self.refusal = error
            raise

    def _watch(self, connection: Connection) -> None:
        assert self.system_id is not None  # it was found
        while not self._stop.wait(0.1):
            failure = lost(connection, self.system_id, GONE_S)
            if failure is not None:
                raise failure

    def _close(self) -> None:
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()
