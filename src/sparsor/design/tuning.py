"""Choices made on the validation maps: lambda of the LASSO, and comparable weights of the cost's terms."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.core.streams import stream
from sparsor.core.workers import Workers, one_blas_thread, workers_of
from sparsor.design.candidate import Desk, allowed_phi
from sparsor.design.monte_carlo import evaluate
from sparsor.design.problem import Problem, Weights
from sparsor.errors import DesignError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design.legs import LegTable
    from sparsor.design.problem import Candidate, Sparsity

LASSO_WEIGHTS = (1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)
_TUNING_DRAWS, _TUNING_PROBABILITIES = 6, (0.03, 0.014)
_PILOT_DRAWS = 32
# Streams of the pilot draws: two numbers in the key, so that they are not the streams of the search.
_PILOT, _TUNING = 1, 2


def choose_lasso_weight(
    psi: NDArray[np.float64],
    maps: NDArray[np.float64],
    legs: LegTable,
    *,
    rows: int = 35,
    seed: int = 0,
    workers: Workers | int = 1,
    progress: Progress = silent,
) -> float:
    """Return the lambda with the lowest mean validation error over random Phi of the paper's kind.

    p = 0.03 and theta = 3, and one of ten times fewer cells, so that the choice holds for short routes too.

    Parameters
    ----------
    psi : array of float64 (N, K)
    maps : array of float64 (n, N)
        Validation maps, the mean taken off.
    legs : LegTable
        Only its size and allowed cells matter.
    rows : int
    seed : int
    workers : Workers or int
        Who tries the Phi; a number is one of threads.
    progress : Progress
    """
    problem = Problem(psi, maps, LASSO_WEIGHTS[0], legs, rows)
    _ = problem.span  # computed once, and not by every worker
    hands = workers_of(workers)
    draws = [(probability, draw) for probability in _TUNING_PROBABILITIES for draw in range(_TUNING_DRAWS)]
    logarithms = []
    with one_blas_thread():
        for done, one in enumerate(hands.map(_log_errors, hands.share((problem, seed)), draws), start=1):
            logarithms += one
            progress("choosing lambda", done, len(draws))
    # Each kind of Phi counts the same, whatever the size of its error: hence the logarithm.
    return LASSO_WEIGHTS[int(np.argmin(np.mean(logarithms, axis=0)))] if logarithms else LASSO_WEIGHTS[0]


def _log_errors(given: tuple[Problem, int], part: tuple[float, int]) -> list[list[float]]:
    """Return the logarithm of one Phi's mean error with each lambda; nothing when it visits under two cells."""
    (problem, seed), (probability, draw) = given, part
    phi, cells = allowed_phi(problem, stream(seed, draw, _TUNING), probability, 3)
    if cells.size < 2:
        return []
    desk = Desk(problem)
    desk.measure(problem, phi, cells)
    logarithms = []
    for weight in LASSO_WEIGHTS:
        desk.judge(problem.span, weight)
        logarithms.append(float(np.log(max(desk.errors.mean(), 1e-300))))
    return [logarithms]


def pilot(problem: Problem, sparsity: Sparsity, *, seed: int) -> list[Candidate]:
    """Evaluate 32 samples outside the search's own streams, without a budget.

    Raises
    ------
    DesignError
        When not one visits two cells.
    """
    free = replace(problem, budget=None)
    with one_blas_thread():
        drawn = [evaluate(free, sparsity, Weights(), rng=stream(seed, draw, _PILOT)) for draw in range(_PILOT_DRAWS)]
    found = [one for one in drawn if one is not None]
    if not found:
        raise DesignError(f"none of {_PILOT_DRAWS} samples visits two cells: raise --probability or lower --theta")
    return found


def comparable_weights(
    candidates: list[Candidate], *, valid: float, path: float | None, incoherence: float | None
) -> Weights:
    """Return the weights of the cost; those not given make the terms comparable on the validation maps.

    ``lambda_path = lambda_valid median(E) / median(L)`` and ``lambda_incoh = lambda_valid median(E) /
    median(mu)`` over `candidates`: at the typical sample all three terms are the same size.
    """
    if path is not None and incoherence is not None:
        return Weights(valid, path, incoherence)
    error, length, mu = (
        float(np.median([getattr(one, name) for one in candidates]))
        for name in ("error", "length_cells", "incoherence")
    )
    return Weights(
        valid,
        valid * error / length if path is None else path,
        valid * error / mu if incoherence is None else incoherence,
    )
