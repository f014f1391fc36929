"""How long to wait before the next attempt."""

from __future__ import annotations

from typing import Final

FIRST_S: Final = 0.5
LONGEST_S: Final = 10.0


class Backoff:
    """Waiting times that double with every attempt.

    Examples
    --------
    >>> backoff = Backoff()
    >>> [backoff.next_s() for _ in range(6)]
    [0.5, 1.0, 2.0, 4.0, 8.0, 10.0]
    """

    def __init__(self) -> None:
        self._wait_s = FIRST_S
        self.tried = False

    def next_s(self) -> float:
        """Return how long to wait now, seconds."""
        wait_s, self._wait_s = self._wait_s, min(2 * self._wait_s, LONGEST_S)
        self.tried = True
        return wait_s
