"""The refined search for a mission: its covariance, its route, the error to expect of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.workers import one_blas_thread
from sparsor.design import Candidate
from sparsor.design.decoders import Measurements
from sparsor.design.decoders.covariance import training_covariance
from sparsor.design.decoders.decode import DecoderName, candidates
from sparsor.design.decoders.setting import Setting
from sparsor.design.refined import Task, refine
from sparsor.errors import DesignError
from sparsor.prior.statistics import unit_shapes

if TYPE_CHECKING:
    from sparsor.core.progress import Progress
    from sparsor.design import LegTable, Problem
    from sparsor.mission.specification import MissionSpecification
    from sparsor.prior.model import Model

# Of the maps' variance: about 1 % of their range, what a calibrated sensor leaves of noise.
READING_NOISE = 0.05**2
_LINEAR: tuple[DecoderName, ...] = ("kriging", "mmse", "blend")


def search_refined(
    spec: MissionSpecification, model: Model, problem: Problem, *, workers: int, progress: Progress
) -> Candidate:
    """Return the route with the lowest expected error; its Phi measures every cell flown over by itself.

    Parameters
    ----------
    spec : MissionSpecification
    model : Model
    problem : Problem
        With a budget.
    workers : int
    progress : Progress
    """
    legs = problem.legs
    assert problem.budget is not None
    with one_blas_thread():
        covariance = training_covariance(model, legs.allowed)
    route = refine(
        Task(covariance, legs, problem.budget, READING_NOISE),
        seed=spec.search.seed,
        iterations=spec.search.iterations,
        seconds=spec.search.time_s,
        workers=workers,
        progress=progress,
    )
    phi = np.eye(legs.size, dtype=np.bool_)[legs.cells_under(route.stops)]
    inside = model.validation[:, legs.allowed]
    squared = route.expected_error * float(inside.var(axis=1).mean()) * inside.shape[1]
    return Candidate(
        sample=0,
        cost=squared,
        error=squared,
        length_cells=legs.path_length(route.stops) / legs.cell_unit,
        incoherence=0.0,
        phi=phi,
        stops=route.stops,
        probability=float(phi.mean()),
        theta=0,
    )


def linear_expectation(model: Model, legs: LegTable, candidate: Candidate, seed: int) -> float:
    """Return the mean ``|s - s_hat| / |s - mean(s)|`` over the validation maps, by the best linear decoder.

    Measured in every cell flown over, with the noise that the route was searched for.

    Raises
    ------
    DesignError
        When no validation map has contrast inside the area.
    """
    maps = unit_shapes(model.validation, legs.allowed)
    if not len(maps):
        raise DesignError("the validation maps have no contrast inside the area: no error can be expected of them")
    rows = candidate.phi.astype(np.float64)
    readings = Measurements(rows, rows @ maps[0], np.full(len(rows), READING_NOISE))
    setting = Setting(model, readings, legs.allowed, np.zeros(len(rows)), seed)
    with one_blas_thread():
        return min(one.error for one in candidates(setting, _LINEAR, amplitude=1.0).values())
