"""What a route measures of each cell: everything under its legs, as far as the sensor answers in time."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray  # noqa: TC002

from sparsor.design.legs import crossing_table

if TYPE_CHECKING:
    from sparsor.design.legs import LegTable


class Flyover(NamedTuple):
    """The cells under every leg, as compiled code reads them.

    Parameters
    ----------
    columns : int
        Of the grid.
    first, rows_off, columns_off, share : arrays
        See `crossing_table`.
    seconds : array of float64 (N, N)
        Time of flight of each leg.
    hold_s : float
        Dwell at each stop.
    tau_s : float
        Time constant of the first-order sensor; 0 answers at once.
    """

    columns: int
    first: NDArray[np.int64]
    rows_off: NDArray[np.int64]
    columns_off: NDArray[np.int64]
    share: NDArray[np.float64]
    seconds: NDArray[np.float64]
    hold_s: float = 0.0
    tau_s: float = 0.0


def flyover(legs: LegTable, *, hold_s: float = 0.0, tau_s: float = 0.0) -> Flyover:
    """Return the cells under the legs of a table, for a dwell at each stop and a sensor's time constant."""
    return Flyover(
        legs.shape[1], *crossing_table(legs.shape), np.ascontiguousarray(legs.seconds), float(hold_s), float(tau_s)
    )


@njit(cache=True, nogil=True)
def fly(
    over: Flyover, stops: NDArray[np.int64], sign: int, passes: NDArray[np.int64], seconds: NDArray[np.float64]
) -> None:
    """Add a path over `stops` to the passes over each cell and the seconds spent there; -1 takes it away."""
    for k in range(stops.size - 1):
        start, end = stops[k], stops[k + 1]
        row, column = start // over.columns, start % over.columns
        down, across = end // over.columns - row, end % over.columns - column
        down_sign = 1 if down >= 0 else -1
        across_sign = 1 if across >= 0 else -1
        offset = abs(down) * over.columns + abs(across)
        time = over.seconds[start, end]
        for i in range(over.first[offset], over.first[offset + 1]):
            cell = (row + down_sign * over.rows_off[i]) * over.columns + column + across_sign * over.columns_off[i]
            passes[cell] += sign
            seconds[cell] += sign * over.share[i] * time
    for stop in stops:
        seconds[stop] += sign * over.hold_s


@njit(cache=True, nogil=True)
def response(passes: int, seconds: float, tau_s: float) -> float:
    """Return how much of a cell's information the sensor took in, 0..1.

    A first-order sensor reads ``1 - exp(-t / tau)`` of the cell after t seconds; the square of that share is what it
    is worth, as a reading's noise counts in full.
    """
    if passes == 0:
        return 0.0
    if tau_s == 0.0:
        return 1.0
    return float(np.expm1(-seconds / tau_s) ** 2)
