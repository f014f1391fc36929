"""The refined search for a mission: its sensor, its covariance, its route, the error to expect of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.core.workers import one_blas_thread
from sparsor.design import Candidate
from sparsor.design.decoders import Measurements
from sparsor.design.decoders.covariance import training_covariance
from sparsor.design.decoders.decode import DecoderName, candidates
from sparsor.design.decoders.setting import Setting
from sparsor.design.refined import Sensor, Task, refine
from sparsor.errors import DesignError
from sparsor.prior.statistics import unit_shapes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.core.progress import Progress
    from sparsor.core.workers import Workers
    from sparsor.design import LegTable, Problem
    from sparsor.mission.specification import MissionSpecification
    from sparsor.prior.model import Model
    from sparsor.vehicle import SensorProfile

# Of the maps' variance: about 1 % of their range, what a calibrated sensor leaves however long it measures.
READING_NOISE = 0.05**2
# Spread of a map over the noise of a reading: 13 ppb of NO2 about a city for the packaged sensor's 5 ppb. What is in
# the air on the day nobody knows before the flight; a prior from column densities says nothing of it.
SPREAD_OVER_NOISE: Final = 13.0 / 5.0
_T90_OVER_TAU = float(np.log(10.0))
_LINEAR: tuple[DecoderName, ...] = ("kriging", "mmse", "blend")


def refined_task(model: Model, problem: Problem, sensor: SensorProfile, *, hold_s: float, braking_s: float) -> Task:
    """Return what the refined search is to solve.

    Parameters
    ----------
    model : Model
    problem : Problem
        With a budget.
    sensor : SensorProfile
        Its response, and its noise relative to the maps, see `SPREAD_OVER_NOISE`.
    hold_s, braking_s : float
        A dwell, and what it takes beside that.
    """
    assert problem.budget is not None
    with one_blas_thread():
        covariance = training_covariance(model, problem.legs.allowed)
    # The profile's own noise cancels: the maps are as much larger as the sensor is fit to tell.
    noise_s = sensor.interval_s / SPREAD_OVER_NOISE**2 if sensor.noise_sd > 0 else 0.0
    answer = Sensor(READING_NOISE, noise_s, sensor.t90_s / _T90_OVER_TAU)
    # A dwell of a budget of time is told apart from a stop that is flown through.
    budget = replace(problem.budget, per_stop=0.0)
    return Task(covariance, problem.legs, budget, answer, hold_s, braking_s)


def search_refined(
    task: Task, spec: MissionSpecification, model: Model, *, workers: Workers, progress: Progress
) -> tuple[Candidate, float]:
    """Return the route with the lowest expected error, and that error by the best linear decoder.

    Its Phi measures every cell flown over by itself.

    Parameters
    ----------
    task : Task
    spec : MissionSpecification
    model : Model
    workers : Workers
    progress : Progress
    """
    legs = task.legs
    route = refine(
        task,
        seed=spec.search.seed,
        iterations=spec.search.iterations,
        seconds=spec.search.time_s,
        workers=workers,
        progress=progress,
    )
    stops, dwells = apart(route.stops)
    phi = np.eye(legs.size, dtype=np.bool_)[legs.cells_under(stops)]
    inside = model.validation[:, legs.allowed]
    squared = route.expected_error * float(inside.var(axis=1).mean()) * inside.shape[1]
    found = Candidate(
        sample=0,
        cost=squared,
        error=squared,
        length_cells=legs.path_length(stops) / legs.cell_unit,
        incoherence=0.0,
        phi=phi,
        stops=stops,
        probability=float(phi.mean()),
        theta=0,
        dwells=dwells,
    )
    return found, linear_expectation(model, legs, *task.readings(route.stops), spec.search.seed)


def apart(stops: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the stops of a route, each once, and how often each followed itself: the dwells there.

    Examples
    --------
    >>> [part.tolist() for part in apart(np.array([3, 7, 7, 7, 2]))]
    [[3, 7, 2], [0, 2, 0]]
    """
    first = np.flatnonzero(np.append(True, np.diff(stops) != 0))
    return stops[first], np.diff(np.append(first, stops.size)) - 1


def linear_expectation(
    model: Model, legs: LegTable, rows: NDArray[np.float64], variance: NDArray[np.float64], seed: int
) -> float:
    """Return the mean ``|s - s_hat| / |s - mean(s)|`` over the validation maps, by the best linear decoder.

    Parameters
    ----------
    model : Model
    legs : LegTable
    rows, variance : arrays (m, N), (m,)
        What the flight measures, see `Task.readings`.
    seed : int

    Raises
    ------
    DesignError
        When no validation map has contrast inside the area.
    """
    maps = unit_shapes(model.validation, legs.allowed)
    if not len(maps):
        raise DesignError("the validation maps have no contrast inside the area: no error can be expected of them")
    readings = Measurements(rows, rows @ maps[0], variance)
    setting = Setting(model, readings, legs.allowed, np.zeros(len(rows)), seed)
    with one_blas_thread():
        return min(one.error for one in candidates(setting, _LINEAR, amplitude=1.0).values())
