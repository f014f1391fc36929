"""How long a flight may be: a share of full coverage, a distance or a time."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from sparsor.errors import BudgetError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design.legs import LegTable

Measure = Literal["fraction", "distance", "time"]

_UNITS: dict[str, tuple[Measure, float]] = {
    "%": ("fraction", 0.01),
    "m": ("distance", 1.0),
    "km": ("distance", 1000.0),
    "s": ("time", 1.0),
    "min": ("time", 60.0),
    "h": ("time", 3600.0),
}
# A shortest tour of n random points in an area A is about this times sqrt(n A) (Beardwood et al. 1959).
_TOUR_CONSTANT = 0.7124


@dataclass(frozen=True)
class BudgetRequest:
    """A budget as it was asked for.

    Parameters
    ----------
    measure : {"fraction", "distance", "time"}
        Share of full coverage, metres or seconds.
    value : float
        0..1, metres or seconds.
    text : str
        As it was written.
    """

    measure: Measure
    value: float
    text: str


def parse_budget(text: str) -> BudgetRequest:
    """Read a budget like ``10%``, ``12km``, ``800 m``, ``25min``, ``90 s`` or ``1.5h``.

    Raises
    ------
    BudgetError
        When the number or the unit is missing or unknown, or the value is not above zero.

    Examples
    --------
    >>> parse_budget("25min").value
    1500.0
    """
    match = re.fullmatch(r"\s*([-+0-9.eE]+)\s*([a-zA-Z%]*)\s*", text)
    units = ", ".join(_UNITS)
    if match is None or match[2] not in _UNITS:
        raise BudgetError(f"budget '{text}' has no known unit; write a number and one of {units}, like 10% or 25min")
    try:
        number = float(match[1])
    except ValueError:
        raise BudgetError(f"budget '{text}' is not a number with a unit ({units}), like 10% or 25min") from None
    if not (math.isfinite(number) and number > 0):
        raise BudgetError(f"budget '{text}' has to be above zero")
    measure, scale = _UNITS[match[2]]
    if measure == "fraction" and number > 100:
        raise BudgetError(f"budget '{text}' is more than full coverage; the most is 100%")
    return BudgetRequest(measure, number * scale, text.strip())


@dataclass(frozen=True)
class Budget:
    """A limit on what a route may use, in the terms of its legs.

    Parameters
    ----------
    limit : float
        Metres (or cell widths), or seconds.
    measure : {"distance", "time"}
        Distances bound the open path over the stops; times bound the flight from take-off to landing.
    per_stop, fixed : float
        Seconds that each stop and each flight cost beside the legs; 0 for distances.
    home : array of float64 (N,), optional
        Seconds between home and each cell, for times. None: home is the first stop.
    """

    limit: float
    measure: Literal["distance", "time"]
    per_stop: float = 0.0
    fixed: float = 0.0
    home: NDArray[np.float64] | None = None

    def used(self, stops: NDArray[np.int64], legs: LegTable) -> float:
        """Return what a route over `stops` in order uses."""
        if self.measure == "distance":
            return legs.path_length(stops)
        if self.home is None:
            transit = float(legs.seconds[stops[-1], stops[0]])
        else:
            transit = float(self.home[stops[0]] + self.home[stops[-1]])
        return self.fixed + legs.path_seconds(stops) + transit + self.per_stop * stops.size

    def stops_within(self, legs: LegTable) -> int:
        """Return about how many random cells a route within the budget can visit; at least 2."""
        table = legs.length if self.measure == "distance" else legs.seconds
        step = legs.step(table)
        count = np.arange(2, max(3, int(legs.allowed.sum()) + 1))
        tour = _TOUR_CONSTANT * np.sqrt(count * legs.allowed.sum()) * step
        used = self.fixed + tour + self.per_stop * count
        return int(count[used <= self.limit].max(initial=2))

    def describe(self, value: float) -> str:
        """Return a value of this budget with its unit, for messages."""
        if self.measure == "time":
            return f"{value / 60:.1f} min"
        return f"{value / 1000:.2f} km" if value >= 1000 else f"{value:.0f} m"
