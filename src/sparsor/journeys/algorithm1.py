"""Algorithm 1 for a mission: how sparse its Phi is drawn, what its terms weigh, its winner."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.core.progress import Progress, silent
from sparsor.design import Weights, fixed_sparsity, search, searched_sparsity
from sparsor.design.tuning import comparable_weights, pilot

if TYPE_CHECKING:
    from sparsor.core.workers import Workers
    from sparsor.design import Candidate, Problem
    from sparsor.design.problem import Sparsity
    from sparsor.mission.specification import MissionSpecification


def search_algorithm_1(
    problem: Problem, spec: MissionSpecification, *, workers: Workers | int = 1, progress: Progress = silent
) -> tuple[Candidate, Weights]:
    """Return the winner of Algorithm 1 and the weights of the cost that it won by.

    Parameters
    ----------
    problem : Problem
    spec : MissionSpecification
        Of a mission that is planned by it.
    workers : Workers or int
    progress : Progress

    Raises
    ------
    BudgetError
        When no sample meets the budget.
    """
    sparsity = _sparsity(spec, problem)
    weights = _weights(spec, problem, sparsity)
    found = search(
        problem,
        sparsity,
        weights,
        seed=spec.search.seed,
        iterations=spec.search.iterations,
        seconds=spec.search.time_s,
        workers=workers,
        progress=progress,
    )
    return found, weights


def drawn_within(problem: Problem, *, seed: int, samples: int, workers: Workers | int = 1) -> Candidate:
    """Return the best of a few samples of Algorithm 1 within a budget, by validation error alone.

    Parameters
    ----------
    problem : Problem
        With a budget.
    seed, samples : int
    workers : Workers or int

    Raises
    ------
    BudgetError
        When no sample meets the budget.
    """
    assert problem.budget is not None
    legs = problem.legs
    sparsity = searched_sparsity(problem.budget.stops_within(legs), int(legs.allowed.sum()), problem.rows)
    return search(problem, sparsity, Weights(), seed=seed, iterations=samples, workers=workers)


def _sparsity(spec: MissionSpecification, problem: Problem) -> Sparsity:
    asked = spec.search
    if asked.probability is not None and asked.theta is not None:
        return fixed_sparsity(asked.probability, asked.theta)
    legs = problem.legs
    cells = int(legs.allowed.sum())
    stops = cells if problem.budget is None else problem.budget.stops_within(legs)
    return searched_sparsity(stops, cells, problem.rows, probability=asked.probability, theta=asked.theta)


def _weights(spec: MissionSpecification, problem: Problem, sparsity: Sparsity) -> Weights:
    """Within a budget the path and the incoherence cost nothing unless their weights are given."""
    asked = spec.search
    valid = 1.0 if asked.lambda_valid is None else asked.lambda_valid
    path, incoherence = asked.lambda_path, asked.lambda_incoh
    if problem.budget is not None:
        path, incoherence = path or 0.0, incoherence or 0.0
    if path is not None and incoherence is not None:
        return comparable_weights([], valid=valid, path=path, incoherence=incoherence)
    drawn = pilot(problem, sparsity, seed=asked.seed)
    return comparable_weights(drawn, valid=valid, path=path, incoherence=incoherence)
