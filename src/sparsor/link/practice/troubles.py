"""What goes wrong on request, and when: a rehearsal of bad days."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from sparsor.errors import InputError

LONGEST_DELAY_S = 10.0


@dataclass(frozen=True)
class Window:
    """A stretch of the flight, seconds since the first take-off.

    Parameters
    ----------
    from_s, to_s : float
        Its beginning and its end.

    Raises
    ------
    InputError
        When it does not end after it begins, or begins before take-off.
    """

    from_s: float
    to_s: float

    def __post_init__(self) -> None:
        if not 0 <= self.from_s < self.to_s < math.inf:
            raise InputError(
                f"a window of {self.from_s:g}:{self.to_s:g} s; give FROM:TO in seconds since take-off, "
                "FROM 0 or above and below TO, e.g. 60:90"
            )

    @classmethod
    def parse(cls, text: str) -> Window:
        """Return the window of ``FROM:TO``.

        Raises
        ------
        InputError
            When the text is not that.

        Examples
        --------
        >>> Window.parse("60:90.5")
        Window(from_s=60.0, to_s=90.5)
        """
        match = re.fullmatch(r"(\d+(?:\.\d*)?):(\d+(?:\.\d*)?)", text.strip())
        if not match:
            raise InputError(f"'{text}' is not a window; give FROM:TO in seconds since take-off, e.g. 60:90")
        return cls(float(match[1]), float(match[2]))

    def holds(self, time_s: float) -> bool:
        """Return whether a moment lies in it."""
        return self.from_s <= time_s < self.to_s


@dataclass(frozen=True)
class LinkTroubles:
    """How bad every link is, in both directions.

    Parameters
    ----------
    lose, repeat : float
        Shares of the messages that never arrive, and that arrive twice.
    delay_s : float
        How long a message takes, by the wall clock, because its receivers wait by it.

    Raises
    ------
    InputError
        When a value is out of range.
    """

    lose: float = 0.0
    repeat: float = 0.0
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        for what, share in (("lost", self.lose), ("repeated", self.repeat)):
            if not 0 <= share < 1:
                raise InputError(f"a share of {share:g} of the messages {what}; give 0 to below 1, 0.3 is 30 %")
        if not 0 <= self.delay_s <= LONGEST_DELAY_S:
            raise InputError(f"a delay of {self.delay_s:g} s; allowed are 0..{LONGEST_DELAY_S:g}")


@dataclass(frozen=True)
class Troubles:
    """What goes wrong in a flight; all times in simulated seconds since the first take-off.

    Parameters
    ----------
    silent_sensor : tuple of Window
        When the sensor sends nothing.
    gps_outage : tuple of Window
        When the GPS has no fix.
    link_loss : tuple of Window
        When nothing gets in or out, on any link.
    low_battery_s : float, optional
        When the battery falls to what makes the vehicle come home.
    link : LinkTroubles
        All the time, on the ground too.
    keep_battery : bool
        Nobody changes the battery: a flight begins with what the one before left.

    Raises
    ------
    InputError
        When a value is out of range.
    """

    silent_sensor: tuple[Window, ...] = ()
    gps_outage: tuple[Window, ...] = ()
    link_loss: tuple[Window, ...] = ()
    low_battery_s: float | None = None
    link: LinkTroubles = LinkTroubles()
    keep_battery: bool = False

    def __post_init__(self) -> None:
        if self.low_battery_s is not None and not 0 <= self.low_battery_s < math.inf:
            raise InputError(f"a low battery at {self.low_battery_s:g} s; give seconds since take-off, 0 or above")


def during(windows: tuple[Window, ...], time_s: float | None) -> bool:
    """Return whether a moment of the flight lies in any of the windows; None is before the take-off."""
    return time_s is not None and any(window.holds(time_s) for window in windows)
