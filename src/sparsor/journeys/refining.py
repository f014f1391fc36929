"""The refined search for a mission: its sensor, its covariance, its route, the error to expect of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.core.workers import one_blas_thread
from sparsor.design import Candidate
from sparsor.design.decoders import Measurements
from sparsor.design.decoders.covariance import training_covariance
from sparsor.design.decoders.decode import DecoderName, candidates
from sparsor.design.decoders.setting import Setting
from sparsor.design.refined import T90_OVER_TAU, Sensor, Task, refine
from sparsor.errors import BudgetError, DesignError
from sparsor.journeys.algorithm1 import drawn_within
from sparsor.prior.statistics import unit_shapes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.core.workers import Workers
    from sparsor.design import Problem
    from sparsor.design.decoders.noise import Noise
    from sparsor.journeys.preparing import Prepared
    from sparsor.mission.specification import MissionSpecification
    from sparsor.prior.model import Model
    from sparsor.vehicle import SensorProfile

# Of the maps' variance: about 1 % of their range, what a calibrated sensor leaves however long it measures.
READING_NOISE = 0.05**2
# Spread of a map over the noise of a reading: 13 ppb of NO2 about a city for the packaged sensor's 5 ppb. What is in
# the air on the day nobody knows before the flight; a prior from column densities says nothing of it.
SPREAD_OVER_NOISE: Final = 13.0 / 5.0
_SAMPLES = 64  # of Algorithm 1: one start among many
LINEAR: Final[tuple[DecoderName, ...]] = ("kriging", "mmse", "blend")


@dataclass(frozen=True, eq=False)
class Known:
    """What earlier flights measured, in the unit of maps of a spread of 1.

    Parameters
    ----------
    rows : array of float64 (m, N)
        Weights of the cells in each reading.
    noise : Noise
    of_a_reading : float
        Variance of the noise of one reading of the sensor, as it was found; of those to come too.
    zero_sd : float
        How far the sensor's zero will have moved by the next flight.
    home : int or None
        Cell from which that one takes off, where that is on the grid.
    """

    rows: NDArray[np.float64]
    noise: Noise
    of_a_reading: float
    zero_sd: float
    home: int | None = None


@dataclass(frozen=True)
class Refined:
    """What the refined search found.

    Parameters
    ----------
    candidate : Candidate
        Its Phi measures every cell flown over by itself.
    error : float
        To expect by the best linear decoder, see `linear_expectation`.
    interrupted : bool
        Whether the search was ended early.
    """

    candidate: Candidate
    error: float
    interrupted: bool


def refined_task(
    model: Model,
    problem: Problem,
    sensor: SensorProfile,
    *,
    hold_s: float,
    braking_s: float,
    known: Known | None = None,
) -> Task:
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
    known : Known, optional
        From earlier flights over the same map.
    """
    assert problem.budget is not None
    with one_blas_thread():
        covariance = training_covariance(model, problem.counted)
    # The profile's own noise cancels: the maps are as much larger as the sensor is fit to tell.
    of_a_reading = 1 / SPREAD_OVER_NOISE**2 if known is None else known.of_a_reading
    noise_s = sensor.interval_s * of_a_reading if sensor.noise_sd > 0 else 0.0
    answer = Sensor(READING_NOISE, noise_s, sensor.t90_s / T90_OVER_TAU)
    # A dwell of a budget of time is told apart from a stop that is flown through.
    budget = replace(problem.budget, per_stop=0.0)
    task = Task(covariance, problem.legs, budget, answer, hold_s, braking_s, problem.mapped)
    return task if known is None else task.after(known.rows, known.noise, known.zero_sd**2, known.home)


def search_refined(
    prepared: Prepared,
    problem: Problem,
    spec: MissionSpecification,
    *,
    begin: Sequence[NDArray[np.int64]] = (),
    known: Known | None = None,
    workers: Workers | int = 1,
    progress: Progress = silent,
) -> Refined:
    """Return the route with the lowest expected error.

    Parameters
    ----------
    prepared : Prepared
    problem : Problem
        With the mission's budget.
    spec : MissionSpecification
    begin : sequence of arrays of int64
        Routes to begin from beside the search's own and Algorithm 1's.
    known : Known, optional
        From earlier flights over the same map.
    workers : Workers or int
    progress : Progress

    Raises
    ------
    BudgetError
        When the budget is too small for any route.
    """
    legs, model = prepared.legs, prepared.prior.model
    assert prepared.sensor is not None
    hold_s, braking_s = prepared.hold(spec)
    task = refined_task(model, problem, prepared.sensor, hold_s=hold_s, braking_s=braking_s, known=known)
    route = refine(
        task,
        seed=spec.search.seed,
        iterations=spec.search.iterations,
        seconds=spec.search.time_s,
        begin=(*begin, *_drawn(problem, spec.search.seed, workers)),
        workers=workers,
        progress=progress,
    )
    stops, dwells = apart(route.stops)
    phi = np.eye(legs.size, dtype=np.bool_)[legs.cells_under(stops)]
    inside = model.validation[:, problem.counted]
    squared = route.expected_error * float(inside.var(axis=1).mean()) * inside.shape[1]
    candidate = Candidate(
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
    error = linear_expectation(model, problem.counted, *task.readings(route.stops), spec.search.seed, known)
    return Refined(candidate, error, route.interrupted)


def _drawn(problem: Problem, seed: int, workers: Workers | int) -> list[NDArray[np.int64]]:
    """Return the route of the best Phi of a few that Algorithm 1 draws, where one is within the budget."""
    try:
        return [drawn_within(problem, seed=seed, samples=_SAMPLES, workers=workers).stops]
    except BudgetError:
        return []


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
    model: Model,
    counted: NDArray[np.bool_],
    rows: NDArray[np.float64],
    variance: NDArray[np.float64],
    seed: int,
    known: Known | None = None,
) -> float:
    """Return the mean ``|s - s_hat| / |s - mean(s)|`` over the validation maps, by the best linear decoder.

    Parameters
    ----------
    model : Model
    counted : array of bool (N,)
        Cells of the map.
    rows, variance : arrays (m, N), (m,)
        What the flight measures, see `Task.readings`.
    seed : int
    known : Known, optional
        From earlier flights over the same map: then of all readings together.

    Raises
    ------
    DesignError
        When no validation map has contrast inside the area.
    """
    maps = unit_shapes(model.validation, counted)
    if not len(maps):
        raise DesignError("the validation maps have no contrast inside the area: no error can be expected of them")
    drift = None
    if known is not None:
        drift = np.concatenate((known.noise.drift, np.full(len(rows), known.zero_sd)))
        rows, variance = np.vstack((known.rows, rows)), np.concatenate((known.noise.variance, variance))
    readings = Measurements(rows, rows @ maps[0], variance, drift)
    setting = Setting(model, readings, counted, np.zeros(len(rows)), seed)
    with one_blas_thread():
        return min(one.error for one in candidates(setting, LINEAR, amplitude=1.0).values())
