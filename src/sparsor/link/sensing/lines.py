"""Lines as they come from wherever they come."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sparsor.link.sensing.readings import Reading

TICK_S: Final = 0.1


@dataclass(frozen=True)
class Line:
    """A line, or what is wrong with it.

    Parameters
    ----------
    text : str
    reading : Reading
    time_s : float
        When it was measured, on the clock of `time.monotonic`.
    """

    text: str
    reading: Reading
    time_s: float


class Source(Protocol):
    """Lines as they come."""

    live: bool
    """Whether a sensor is at the other end, which may fall silent."""
    waits: bool
    """Whether lines keep, with the time at which they came, until they are taken."""

    def lines(self) -> Iterator[Line | None]:
        """Yield lines; None at least ten times a second while none comes."""
        ...


def nothing_for(seconds: float) -> Iterator[None]:
    """Let time pass, and let the caller do its own things meanwhile."""
    end_s = time.monotonic() + seconds
    while (left_s := end_s - time.monotonic()) > 0:
        time.sleep(min(left_s, TICK_S))
        yield None
