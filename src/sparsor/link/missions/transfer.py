"""Missions, fences and rally points to the vehicle and back: through mavsdk, and by ourselves where it gives up."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self, TypeVar

from sparsor.core.progress import silent
from sparsor.link.connection import lost
from sparsor.link.missions.dialogue import SILENT_S
from sparsor.link.missions.mavsdkmissions import MavsdkMissions, UnheardError
from sparsor.link.missions.resending import Resender
from sparsor.link.missions.wire import KINDS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from sparsor.core.progress import Progress
    from sparsor.link.connection import Connection
    from sparsor.link.missions.wire import WireItem
    from sparsor.link.vehicles import FoundVehicle

T = TypeVar("T")


class Transfer:
    """The mission protocol with one vehicle of a connection.

    Once mavsdk gave up on the link it is ended, so that nothing of it disturbs, and our own, more patient `Resender`
    does this transfer and all that follow.

    Parameters
    ----------
    connection : Connection
    vehicle : FoundVehicle
    timeout_s : float
        How long mavsdk may take to see the vehicle, seconds.
    resend : bool
        False: leave it at what mavsdk can do.

    Raises
    ------
    LinkFailureError
        When nothing is heard of the vehicle any more.

    Attributes
    ----------
    helped : set of str
        What the `Resender` did.
    """

    def __init__(
        self, connection: Connection, vehicle: FoundVehicle, timeout_s: float = 10.0, *, resend: bool = True
    ) -> None:
        self.helped: set[str] = set()
        self._resend = resend
        self._resender = Resender(connection, vehicle)
        self._missions: MavsdkMissions | None = None
        try:
            self._missions = MavsdkMissions(connection, vehicle, timeout_s)
        except UnheardError:
            connection.check()
            if not resend or lost(connection, vehicle.system_id, SILENT_S) is not None:
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End mavsdk; can be called twice."""
        if self._missions is not None:
            self._missions.close()
            self._missions = None

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
        name = KINDS[kind]
        progress(f"send {name}", 0, len(items))
        self._either(
            name,
            lambda missions: missions.upload(kind, items, progress),
            lambda: self._resender.upload(kind, items, progress),
        )
        progress(f"send {name}", len(items), len(items))

    def download(self, kind: int) -> tuple[WireItem, ...]:
        """Return what the vehicle holds of a MAV_MISSION_TYPE, with home where it keeps it.

        Raises
        ------
        LinkFailureError
            When the vehicle does not answer.
        """
        return self._either(
            KINDS[kind], lambda missions: missions.download(kind), lambda: self._resender.download(kind)
        )

    def clear(self, kind: int) -> None:
        """Empty a MAV_MISSION_TYPE (MISSION_CLEAR_ALL, which mavsdk sends only for missions).

        Raises
        ------
        LinkFailureError
            When the vehicle does not accept it.
        """
        self._resender.clear(kind)

    def set_current(self, item: int) -> None:
        """Make an item the next to be flown (mavsdk takes a MISSION_CURRENT that was sent before for a refusal).

        Raises
        ------
        LinkFailureError
            When the vehicle does not accept it.
        """
        self._resender.set_current(item)

    def cancel(self) -> None:
        """Give up an upload that mavsdk runs; our own ends with the call."""
        if self._missions is not None:
            self._missions.cancel()

    def _either(self, name: str, through: Callable[[MavsdkMissions], T], ourselves: Callable[[], T]) -> T:
        """Do something through mavsdk; where that gave up on the link, now or before, do it ourselves."""
        if self._missions is not None:
            try:
                return through(self._missions)
            except UnheardError:
                if not self._resend:
                    raise
                self.close()
        self.helped.add(name)
        return ourselves()
