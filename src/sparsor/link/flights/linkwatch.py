"""Whether a vehicle is still heard, and sends what a flight is watched by."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkFailureError
from sparsor.link.flights.orders import order
from sparsor.link.flights.views import Event
from sparsor.link.recorder import SET_MESSAGE_INTERVAL, request_streams, stream_params

if TYPE_CHECKING:
    from sparsor.link.connection import Connection
    from sparsor.link.inbox import Received
    from sparsor.link.vehicles import FoundVehicle

QUIET_S: Final = 4.0  # a link without a word for so long is told of; heartbeats come once a second
NEEDED: Final = ("GLOBAL_POSITION_INT", "MISSION_CURRENT")  # every vehicle has them
MISSING_S: Final = 3.0  # then they are asked for again


class LinkWatch:
    """Notices that a vehicle falls silent, and asks again for messages that do not come.

    Parameters
    ----------
    connection : Connection
    vehicle : FoundVehicle
    """

    def __init__(self, connection: Connection, vehicle: FoundVehicle) -> None:
        self._connection, self._vehicle = connection, vehicle
        self._quiet = False
        self._heard_s = dict.fromkeys(NEEDED, time.monotonic())

    def ask(self) -> None:
        """Ask for all messages that a flight is watched by."""
        self._heard_s = dict.fromkeys(NEEDED, time.monotonic())
        request_streams(self._connection, self._vehicle)

    def insist(self) -> None:
        """Ask for all, and for what a flight cannot do without until the vehicle answers.

        Raises
        ------
        LinkFailureError
            When it does not answer, or the link is gone.
        """
        self.ask()
        for name in NEEDED:
            order(self._connection, self._vehicle, SET_MESSAGE_INTERVAL, *stream_params(name))

    def heard(self, received: Received) -> None:
        """Take note of a message."""
        if received.kind in self._heard_s:
            self._heard_s[received.kind] = received.time_s

    def check(self, lost_timeout_s: float | None, *, flying: bool) -> Event | None:
        """Return that the vehicle fell silent or is heard again, None when that is as it was.

        Raises
        ------
        LinkFailureError
            When nothing was heard for `lost_timeout_s` seconds, or the link is gone.
        """
        silent_s = self._connection.silent_s(self._vehicle.system_id)
        if lost_timeout_s is not None and silent_s > lost_timeout_s:
            raise LinkFailureError(f"the link was lost: nothing was heard of the vehicle for {silent_s:.0f} s")
        quiet = silent_s > QUIET_S
        if not quiet and time.monotonic() - min(self._heard_s.values()) > MISSING_S:
            self.ask()
        if quiet == self._quiet:
            return None
        self._quiet = quiet
        if not quiet:
            return Event("the vehicle is heard again")
        meanwhile = ": the vehicle flies on by itself" if flying else ""
        return Event(f"nothing was heard for {silent_s:.0f} s{meanwhile}", warning=True)
