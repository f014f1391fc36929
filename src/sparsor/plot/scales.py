"""Round numbers for axes: graticule steps and labels, the length of a scale bar."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

ROUND = (1.0, 2.0, 5.0)


def graticule(low_deg: float, high_deg: float, at_most: int) -> tuple[NDArray[np.float64], float]:
    """Return round degrees between two limits, and the step between them.

    Parameters
    ----------
    low_deg, high_deg : float
        The limits; longitudes may run on beyond 180.
    at_most : int
        How many there may be, 2 or more.

    Examples
    --------
    >>> values, step = graticule(51.4982, 51.5318, 5)
    >>> values.tolist(), step
    ([51.5, 51.51, 51.52, 51.53], 0.01)
    """
    step = round_step((high_deg - low_deg) / at_most)
    return multiples(low_deg, high_deg, step), step


def multiples(low_deg: float, high_deg: float, step_deg: float) -> NDArray[np.float64]:
    """Return the whole multiples of a round step between two limits, both included.

    Examples
    --------
    >>> multiples(25.27, 25.3, 0.01).tolist()
    [25.27, 25.28, 25.29, 25.3]
    """
    first, last = math.ceil(low_deg / step_deg - 1e-9), math.floor(high_deg / step_deg + 1e-9)
    # Rounded to the step's own decimals: 51.53, never 51.5300000000004.
    return np.round(np.arange(first, last + 1) * step_deg, decimals_of(step_deg))


def degree_label(value_deg: float, step_deg: float, axis: Literal["lon", "lat"]) -> str:
    """Return a coordinate in words, with the decimals that its step needs.

    Examples
    --------
    >>> degree_label(181.5, 0.5, "lon"), degree_label(-0.001, 0.001, "lat"), degree_label(180.0, 10.0, "lon")
    ('178.5°W', '0.001°S', '180°')
    """
    wrapped = value_deg if axis == "lat" else (value_deg + 180.0) % 360.0 - 180.0
    digits = f"{abs(wrapped):.{decimals_of(step_deg)}f}"
    if float(digits) == 0.0 or (axis == "lon" and float(digits) == 180.0):
        return f"{digits}°"
    return f"{digits}°{('E' if wrapped > 0 else 'W') if axis == 'lon' else ('N' if wrapped > 0 else 'S')}"


def scale_bar_m(longest_m: float) -> float:
    """Return the longest round length, 1, 2 or 5 times a power of ten, that is not above `longest_m`.

    Examples
    --------
    >>> scale_bar_m(740.0), scale_bar_m(200.0)
    (500.0, 200.0)
    """
    power = 10.0 ** math.floor(math.log10(longest_m))
    return max(factor * power for factor in ROUND if factor * power <= longest_m * (1 + 1e-9))


def length_label(length_m: float) -> str:
    """Return a length in metres, or in kilometres from 1000 m on.

    Examples
    --------
    >>> length_label(500.0), length_label(2000.0)
    ('500 m', '2 km')
    """
    return f"{length_m:g} m" if length_m < 1000.0 else f"{length_m / 1000.0:g} km"


def round_step(value: float) -> float:
    """Return the least round number, 1, 2 or 5 times a power of ten, that is not below a value above 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return min(factor * power for factor in (*ROUND, 10.0) if factor * power >= value * (1 - 1e-9))


def decimals_of(step: float) -> int:
    """Return how many decimals a round step has.

    Examples
    --------
    >>> decimals_of(0.005), decimals_of(20.0)
    (3, 0)
    """
    return max(0, -math.floor(math.log10(step) + 1e-9))
