"""What is there of a log that comes in pieces, which piece to ask for next, and how large a piece is worth it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

CHUNK: Final = 90  # bytes in a LOG_DATA
MANY: Final = 64  # chunks in one go from which the link's rate can be told


class Pace:
    """What a request costs on this link, measured.

    Attributes
    ----------
    latency_s : float
        From a request to the first chunk.
    """

    def __init__(self) -> None:
        self.latency_s = 0.0
        self._chunk_s = 0.0
        self._cost_s = 0.0

    @property
    def worth(self) -> float:
        """How many chunks come in the time that a request costs beside its data: waiting, for what is lost too."""
        return self._cost_s / self._chunk_s if self._chunk_s else 0.0

    def learn(self, asked_s: float, times_s: Sequence[float], ended_s: float) -> None:
        """Learn from one request: when it went out, when each chunk came, and when it was over."""
        if times_s:
            self.latency_s = times_s[0] - asked_s
        if len(times_s) >= MANY:
            self._chunk_s = (times_s[-1] - times_s[0]) / (len(times_s) - 1)
        cost_s = max(ended_s - asked_s - len(times_s) * self._chunk_s, 0.0)
        self._cost_s += (cost_s - self._cost_s) / 4


class Window:
    """A part of the log, and which chunks of it are missing.

    Parameters
    ----------
    start, size : int
        Bytes.

    Attributes
    ----------
    data : bytearray
    missing : set of int
        Chunks, counted from the start of the window.
    cut : bool
        Whether the log turned out to end in this window.
    """

    def __init__(self, start: int, size: int) -> None:
        self.start = start
        self.data = bytearray(size)
        self.missing = set(range(-(-size // CHUNK)))
        self.cut = False
        self._ends: set[int] = set()

    @property
    def received(self) -> int:
        """How much of the log is there, bytes, to a chunk."""
        return self.start + max(len(self.data) - len(self.missing) * CHUNK, 0)

    def stretch(self, worth: float) -> tuple[int, int]:
        """Return the first and last chunk to ask for: the first gap, and those behind it by less than `worth`.

        What lies between two gaps is sent once more; that is sooner than another round trip.
        """
        places = sorted(self.missing)
        first = last = places[0]
        for place in places[1:]:
            if place - last > 1 + worth:
                break
            last = place
        return first, last

    def take(self, offset: int, data: bytes) -> int | None:
        """Keep a chunk; returns its place, None for one that does not belong here."""
        place, misplaced = divmod(offset - self.start, CHUNK)
        at = place * CHUNK
        if misplaced or not 0 <= at < len(self.data):
            return None
        wanted = min(CHUNK, len(self.data) - at)
        if len(data) < wanted:
            self._shorten(at + len(data))
            return place
        self.data[at : at + wanted] = data[:wanted]
        self.missing.discard(place)
        return place

    def _shorten(self, size: int) -> None:
        """Cut the log to a size below the listed one, when the vehicle has said so a second time."""
        if size not in self._ends:
            self._ends.add(size)
            return
        del self.data[size:]
        self.missing = {place for place in self.missing if place * CHUNK < size}
        self.cut = True
