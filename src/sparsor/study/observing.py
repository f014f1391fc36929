"""What a flight over a route reads of a map: single cells, or what a slow sensor makes of the cells it crosses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.sparse import csr_array

from sparsor.core.streams import stream
from sparsor.design import Budget
from sparsor.design.refined import T90_OVER_TAU, Sensor, Task
from sparsor.design.refined.flyover import flyover, passes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design import LegTable
    from sparsor.study.cases import Case

Measured = Literal["legs", "stops"]
# Streams of the noise on validation and on test maps.
_NOISE = {"validation": 8, "test": 9}
# Of the maps' variance: what keeps a search without noise from trusting details of the covariance.
LEAST_NOISE = 3e-5


@dataclass(frozen=True)
class Readings:
    """Readings of one flight.

    Parameters
    ----------
    rows : sparse array of float64 (m, N)
        Shares of the cells in each reading; they sum to 1.
    variance : array of float64 (m,)
        Of its noise, on the square of the maps' scale.
    """

    rows: csr_array[np.float64, tuple[int, int]]
    variance: NDArray[np.float64]

    def of(self, maps: NDArray[np.float64], which: Literal["validation", "test"]) -> NDArray[np.float64]:
        """Return the readings of maps (n, N), noise included, (n, m)."""
        exact = np.asarray(self.rows @ maps.T).T
        noise = stream(0, _NOISE[which]).standard_normal(exact.shape)
        return np.asarray(exact + np.sqrt(self.variance) * noise)


def readings(
    legs: LegTable, stops: NDArray[np.int64], measured: Measured, *, sd: float, t90_s: float = 0.0
) -> Readings:
    """Return what the flight over a route reads.

    Parameters
    ----------
    legs : LegTable
        Its seconds matter to a slow sensor alone.
    stops : array of int64 (n,)
    measured : {"legs", "stops"}
        Every cell under the legs, or the stops alone.
    sd : float
        Of the noise on every reading, in the unit of the maps.
    t90_s : float
        Of the sensor's first-order response; it flies through its stops.
    """
    if t90_s == 0.0:
        cells = legs.cells_under(stops) if measured == "legs" else np.unique(stops)
        return of_cells(cells, legs.size, sd)
    task = Task(np.eye(legs.size), legs, Budget(np.inf, "distance"), Sensor(sd**2, tau_s=t90_s / T90_OVER_TAU))
    rows, variance = task.readings(stops)
    if measured == "stops":
        at_stop = np.isin(passes(flyover(legs), stops)[0], stops)
        rows, variance = rows[at_stop], variance[at_stop]
    return Readings(csr_array(rows), variance)


def of_cells(cells: NDArray[np.int64], size: int, sd: float) -> Readings:
    """Return one reading of each of some cells of a grid of `size`."""
    rows = csr_array((np.ones(cells.size), (np.arange(cells.size), cells)), shape=(cells.size, size))
    return Readings(rows, np.full(cells.size, sd**2))


def task_of(case: Case, legs: LegTable, limit: float, *, sd: float, t90_s: float = 0.0) -> Task:
    """Return what the refined search is given for a case: the training maps' covariance, the noise in its unit."""
    noise = LEAST_NOISE + sd**2 / case.typical_variance
    sensor = Sensor(noise, tau_s=t90_s / T90_OVER_TAU)
    return Task(case.training["shapes"], legs, Budget(float(limit), "distance"), sensor)


def flown_at(legs: LegTable, seconds_per_cell: float) -> LegTable:
    """Return a table in cell units flown at a speed: for a slow sensor it matters how long a cell lasts."""
    return replace(legs, seconds=legs.length * seconds_per_cell)
