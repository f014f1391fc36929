"""What is to be written at a moment, each thing at its own rate."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


class Due:
    """When each of several things is next; all of them are at the first moment that is asked about.

    Parameters
    ----------
    rates_hz : mapping of str to float

    Examples
    --------
    >>> due = Due({"fast": 10.0, "slow": 5.0})
    >>> [due.at(step * 0.1) for step in range(3)]
    [['fast', 'slow'], ['fast'], ['fast', 'slow']]
    """

    def __init__(self, rates_hz: Mapping[str, float]) -> None:
        self._rates_hz = rates_hz
        self._start_s: float | None = None
        self._done = dict.fromkeys(rates_hz, 0)

    def at(self, time_s: float) -> list[str]:
        """Return the names of what is due, each once."""
        if self._start_s is None:
            self._start_s = time_s
        due: list[str] = []
        for name, rate_hz in self._rates_hz.items():
            # Counted from the start, so that rounding does not add up.
            number = int((time_s - self._start_s) * rate_hz + 1e-6) + 1
            if number > self._done[name]:
                self._done[name] = number
                due.append(name)
        return due
