"""What a route's flight measures: readings of what is flown over, as the sensor answers.

A sensor that answers at once gives one reading of each cell, better the longer it is there. A slow one gives one of
each pass: the mean over the pass of a first-order response, which still holds air of the cells before. Such a reading
is a row of weights over the cells; with the map's factor F the search needs the row times F alone, which follows the
same recurrence.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray  # noqa: TC002

from sparsor.core.compiled import njit
from sparsor.design.refined.posterior import Belief

T90_OVER_TAU: Final = float(np.log(10.0))
"""Time to 90 % of a step over the time constant, of a first-order response."""
_NEGLIGIBLE = 0.01  # of a difference in what the sensor holds: some readings later nobody can tell
_LEAST_CHANGE = 1e-9  # of a precision
_LEAST_NOISE = 1e-12
_LEAST_TIME_S = 1e-9


class Sensor(NamedTuple):
    """How a sensor answers, in the unit of maps of variance 1.

    Parameters
    ----------
    noise : float
        Variance that every reading has, however long it took.
    noise_s : float
        Variance of a reading that took one second; it falls with the time.
    tau_s : float
        Time constant of the first-order response; 0 answers at once.
    """

    noise: float
    noise_s: float = 0.0
    tau_s: float = 0.0


class Readings(NamedTuple):
    """The readings of one route.

    Parameters
    ----------
    cell : array of int64 (n,)
        Of a fast sensor ascending, of a slow one in the order of flight.
    seconds : array of float64 (n,)
        Spent there.
    row : array of float64 (n, r + 1)
        Of the belief's factor, as the sensor mixes it.
    precision : array of float64 (n,)
        One over the variance of the reading around the row.
    held, unexplained : arrays of float64 (n, r + 1), (n,)
        What a slow sensor holds when it leaves, and the variance of that around the factor.
    """

    cell: NDArray[np.int64]
    seconds: NDArray[np.float64]
    row: NDArray[np.float64]
    precision: NDArray[np.float64]
    held: NDArray[np.float64]
    unexplained: NDArray[np.float64]


@njit(cache=True, nogil=True)
def readings(prior: Belief, sensor: Sensor, cell: NDArray[np.int64], seconds: NDArray[np.float64]) -> Readings:
    """Return the readings of passes through cells, from the start."""
    if sensor.tau_s == 0.0:
        return _of_cells(prior, sensor, cell, seconds)
    made = _room(cell, seconds, prior.spread.size)
    for i in range(cell.size):
        _read_pass(prior, sensor, made, i)
    return made


@njit(cache=True, nogil=True)
def readings_after(
    prior: Belief, sensor: Sensor, cell: NDArray[np.int64], seconds: NDArray[np.float64], before: Readings
) -> tuple[Readings, NDArray[np.float64], NDArray[np.float64]]:
    """Return the readings of a changed route, and what has changed: rows, and their precision (taken away: below 0).

    Parameters
    ----------
    prior : Belief
    sensor : Sensor
    cell, seconds : arrays (p,)
        Passes of the changed route.
    before : Readings
        Of the route as it was.
    """
    if sensor.tau_s == 0.0:
        made = _of_cells(prior, sensor, cell, seconds)
        rows, difference = _cell_changes(prior, before, made)
        return made, rows, difference
    made = _room(cell, seconds, prior.spread.size)
    most = min(cell.size, before.cell.size)
    head = 0
    while head < most and cell[head] == before.cell[head] and seconds[head] == before.seconds[head]:
        head += 1
    tail = 0
    while (
        tail < most - head
        and cell[cell.size - 1 - tail] == before.cell[before.cell.size - 1 - tail]
        and seconds[cell.size - 1 - tail] == before.seconds[before.cell.size - 1 - tail]
    ):
        tail += 1
    _copy(before, 0, made, 0, head)
    i, left = head, 1.0
    while i < cell.size and (i < cell.size - tail or left > _NEGLIGIBLE):
        _read_pass(prior, sensor, made, i)
        if i >= cell.size - tail:
            left *= np.exp(-seconds[i] / sensor.tau_s)
        i += 1
    shift = before.cell.size - cell.size
    _copy(before, i + shift, made, i, cell.size - i)
    gone, new = i + shift - head, i - head
    rows, difference = np.empty((gone + new, prior.spread.size)), np.empty(gone + new)
    rows[:gone], rows[gone:] = before.row[head : i + shift], made.row[head:i]
    difference[:gone], difference[gone:] = -before.precision[head : i + shift], made.precision[head:i]
    return made, rows, difference


@njit(cache=True, nogil=True)
def _room(cell: NDArray[np.int64], seconds: NDArray[np.float64], width: int) -> Readings:
    n = cell.size
    return Readings(cell, seconds, np.empty((n, width)), np.empty(n), np.empty((n, width)), np.empty(n))


@njit(cache=True, nogil=True)
def _copy(before: Readings, source: int, made: Readings, to: int, count: int) -> None:
    made.row[to : to + count] = before.row[source : source + count]
    made.precision[to : to + count] = before.precision[source : source + count]
    made.held[to : to + count] = before.held[source : source + count]
    made.unexplained[to : to + count] = before.unexplained[source : source + count]


@njit(cache=True, nogil=True)
def _read_pass(prior: Belief, sensor: Sensor, made: Readings, i: int) -> None:
    """Read one pass, the ones before being read; before the first, the sensor has settled in its cell."""
    cell, time = made.cell[i], made.seconds[i]
    held, before = made.held, max(i - 1, 0)
    if i == 0:
        held[0] = prior.factor[cell]
        made.unexplained[0] = prior.residual[cell]
    kept, mean = shares(time, sensor.tau_s)
    unexplained = made.unexplained[before]
    for j in range(held.shape[1]):
        here, then = prior.factor[cell, j], held[before, j]
        made.row[i, j] = mean * then + (1 - mean) * here
        held[i, j] = kept * then + (1 - kept) * here
    own = prior.residual[cell]
    made.unexplained[i] = kept**2 * unexplained + (1 - kept) ** 2 * own
    variance = mean**2 * unexplained + (1 - mean) ** 2 * own + sensor.noise
    made.precision[i] = 1 / (variance + sensor.noise_s / max(time, _LEAST_TIME_S))


@njit(cache=True, nogil=True)
def shares(time_s: float, tau_s: float) -> tuple[float, float]:
    """Return how much of what the sensor held is left after a time, and how much of it is in the mean of that time."""
    kept = np.exp(-time_s / tau_s)
    mean = 1.0 if time_s == 0.0 else (1 - kept) * tau_s / time_s
    return kept, mean


@njit(cache=True, nogil=True)
def _of_cells(prior: Belief, sensor: Sensor, cell: NDArray[np.int64], seconds: NDArray[np.float64]) -> Readings:
    """Return one reading of each cell, of all the time spent there."""
    times, passed = np.zeros(prior.residual.size), np.zeros(prior.residual.size, dtype=np.bool_)
    for i in range(cell.size):
        times[cell[i]] += seconds[i]
        passed[cell[i]] = True
    cells = np.flatnonzero(passed)
    precision = np.empty(cells.size)
    for k in range(cells.size):
        time = max(times[cells[k]], _LEAST_TIME_S)
        precision[k] = 1 / (prior.residual[cells[k]] + sensor.noise + sensor.noise_s / time)
    nothing = np.empty((0, 0))
    return Readings(cells, times[cells], nothing, precision, nothing, np.empty(0))


@njit(cache=True, nogil=True)
def _cell_changes(prior: Belief, before: Readings, made: Readings) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return rows and differences of the cells that are read otherwise than before; both are in ascending order."""
    most = before.cell.size + made.cell.size
    cells, difference = np.empty(most, dtype=np.int64), np.empty(most)
    i, j, count = 0, 0, 0
    while i < before.cell.size or j < made.cell.size:
        old = before.cell[i] if i < before.cell.size else prior.residual.size
        new = made.cell[j] if j < made.cell.size else prior.residual.size
        change, cell = 0.0, min(old, new)
        if old == cell:
            change -= before.precision[i]
            i += 1
        if new == cell:
            change += made.precision[j]
            j += 1
        if abs(change) > _LEAST_CHANGE * abs(made.precision[0]):
            cells[count], difference[count] = cell, change
            count += 1
    rows = np.empty((count, prior.spread.size))
    for k in range(count):
        rows[k] = prior.factor[cells[k]]
    return rows, difference[:count]


def weights(
    sensor: Sensor, cell: NDArray[np.int64], seconds: NDArray[np.float64], cells: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rows of weights that passes make, and the variance of the sensor's noise in each.

    Parameters
    ----------
    sensor : Sensor
    cell, seconds : arrays (p,)
        Passes of a route.
    cells : int
        N, of the grid.

    Returns
    -------
    array of float64 (n, N), array of float64 (n,)
        Rows sum to 1. A fast sensor's are the cells themselves.
    """
    identity = np.eye(cells)
    exact = Belief(identity, np.ones(cells), np.ones(cells), np.zeros(cells), np.ones(cells, dtype=np.bool_))
    made = readings(exact, sensor._replace(noise=sensor.noise + _LEAST_NOISE), cell, seconds)
    rows = identity[made.cell] if sensor.tau_s == 0.0 else made.row
    return rows, 1 / made.precision - _LEAST_NOISE
