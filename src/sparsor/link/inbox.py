"""Messages that came in, and boxes that keep some of them."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sparsor.core.mavlink_frames import Frame
    from sparsor.link.connection import Connection

Message = Any  # one of pymavlink's, which has no types


@dataclass(frozen=True)
class Received:
    """One frame that came in, with what pymavlink makes of it.

    Parameters
    ----------
    frame : Frame
    message : MAVLink_message
        MAVLink_unknown for what the dialect lacks.
    time_s : float
        `time.monotonic` when it came.
    """

    frame: Frame
    message: Message
    time_s: float

    @property
    def kind(self) -> str:
        """The message's name."""
        return str(self.message.get_type())


class Inbox:
    """Messages of some kinds, kept in order from the moment it is made."""

    def __init__(self, connection: Connection, kinds: frozenset[str], system_id: int | None) -> None:
        self._connection, self._kinds, self._system_id = connection, kinds, system_id
        self._received: list[Received] = []
        self._news = threading.Condition()
        self._end = connection.listen(self._keep)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def until(self, deadline_s: float) -> Iterator[Received]:
        """Yield messages as they come, until `time.monotonic` reaches the deadline.

        Raises
        ------
        LinkFailureError
            When the link is gone.
        """
        while True:
            with self._news:
                while not self._received:
                    left_s = deadline_s - time.monotonic()
                    if left_s <= 0:
                        return
                    self._connection.check()
                    self._news.wait(min(left_s, 0.1))
                received = self._received.pop(0)
            yield received

    def _keep(self, received: Received) -> None:
        if self._system_id not in (None, received.frame.system_id):
            return
        if not self._kinds or received.kind in self._kinds:
            with self._news:
                self._received.append(received)
                self._news.notify_all()
