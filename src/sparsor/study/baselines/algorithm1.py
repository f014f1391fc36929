"""Algorithm 1 with a budget instead of lambda_path: the best of its samples that meet it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.core.workers import Workers  # noqa: TC001
from sparsor.design import Weights, search, searched_sparsity

if TYPE_CHECKING:
    from sparsor.design import Candidate, Problem


def best_within(problem: Problem, *, seed: int, iterations: int, workers: Workers | int = 1) -> Candidate:
    """Return the sample with the lowest validation error among those within the problem's budget.

    p and theta are drawn anew for every sample: at the paper's p = 0.03, theta = 3 hardly one path is short enough.

    Parameters
    ----------
    problem : Problem
        With a budget.
    seed, iterations : int
    workers : Workers or int

    Raises
    ------
    BudgetError
        When no sample meets the budget.
    """
    assert problem.budget is not None
    cells = int(problem.legs.allowed.sum())
    sparsity = searched_sparsity(problem.budget.stops_within(problem.legs), cells, problem.rows)
    return search(problem, sparsity, Weights(), seed=seed, iterations=iterations, workers=workers)
