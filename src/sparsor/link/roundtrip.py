"""How long to wait for an answer, and in how many copies to ask: both learnt from the link itself.

Jacobson, Congestion avoidance and control (1988), with Karn's rule: the time of an answer counts only when it is clear
which message it answers. Constants as in RFC 6298.
"""

from __future__ import annotations

from typing import Final

FIRST_S: Final = 1.5  # before anything was measured
FLOOR_S: Final = 0.2
CEILING_S: Final = 3.0  # PX4 gives a transfer up after 5 s without an item
MOST_COPIES: Final = 4  # at 30 % loss each way, an answered message in four copies fails one time in fifteen
CALM: Final = 64  # answers without a timeout after which one copy fewer will do


class RoundTrip:
    """An estimate of the round trip, and of how much the link loses.

    Attributes
    ----------
    resend_s : float
        How long to wait for an answer, seconds.
    copies : int
        How often to send each message at first.

    Examples
    --------
    >>> trip = RoundTrip()
    >>> for _ in range(20):
    ...     trip.answered(1.0)
    >>> round(trip.resend_s, 1), trip.copies
    (1.0, 1)
    >>> trip.expired()
    >>> round(trip.resend_s, 1), trip.copies
    (2.0, 2)
    """

    def __init__(self) -> None:
        self.copies = 1
        self._smoothed_s: float | None = None
        self._deviation_s = 0.0
        self._backoff = 1.0
        self._calm = 0

    @property
    def resend_s(self) -> float:
        """Smoothed round trip plus four mean deviations, doubled for each timeout since the last measurement."""
        expected_s = FIRST_S if self._smoothed_s is None else self._smoothed_s + 4 * self._deviation_s
        return min(max(expected_s, FLOOR_S) * self._backoff, CEILING_S)

    def answered(self, seconds: float | None) -> None:
        """Learn from an answer; None where it is unclear which sending it answers."""
        self._calm += 1
        if self._calm >= CALM and self.copies > 1:
            self.copies, self._calm = self.copies - 1, 0
        if seconds is None:
            return
        self._backoff = 1.0
        if self._smoothed_s is None:
            self._smoothed_s, self._deviation_s = seconds, seconds / 2
            return
        self._deviation_s += (abs(seconds - self._smoothed_s) - self._deviation_s) / 4
        self._smoothed_s += (seconds - self._smoothed_s) / 8

    def expired(self) -> None:
        """Learn that no answer came in time."""
        self._calm = 0
        self._backoff = min(2 * self._backoff, CEILING_S / FLOOR_S)
        self.copies = min(self.copies + 1, MOST_COPIES)
