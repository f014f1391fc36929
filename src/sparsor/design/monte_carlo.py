"""The paper's Algorithm 1: Monte-Carlo search for the measurement matrix and its path.

Every sample draws a random Phi, finds the path over its cells and reconstructs the validation maps; the one
with the lowest ``C = lambda_valid E + lambda_path L + lambda_incoh mu`` wins. Sample r draws from its own
stream, so that the answer does not depend on how many workers share the samples.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.core.streams import stream
from sparsor.core.workers import Workers, one_blas_thread, workers_of
from sparsor.design.candidate import Best, Desk, try_sample
from sparsor.errors import BudgetError, DesignError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from sparsor.design.problem import Candidate, Problem, Sparsity, Weights

_BLOCK = 16  # samples handed to a worker at a time


@dataclass(frozen=True)
class Found:
    """What a range of samples came to.

    Parameters
    ----------
    candidate : Candidate, optional
        The cheapest, at equal cost the one with the lowest number; None when none can win.
    shortest : float
        What the shortest route beyond the budget uses; infinite when there was none.
    excess : array of float64 (n,), optional
        Errors of the validation maps, summed over the candidates that were finished: which maps go worst.
    """

    candidate: Candidate | None
    shortest: float = np.inf
    excess: NDArray[np.float64] | None = None

    def merged(self, other: Found) -> Found:
        """Return what both ranges together came to, in whichever order they were searched."""
        candidates = [one for one in (self.candidate, other.candidate) if one is not None]
        winner = min(candidates, key=lambda one: (one.cost, one.sample), default=None)
        known = [one.excess for one in (self, other) if one.excess is not None]
        return Found(winner, min(self.shortest, other.shortest), np.sum(known, axis=0) if known else None)


@dataclass(frozen=True)
class _Task:
    """What all ranges of a search are given."""

    problem: Problem
    sparsity: Sparsity
    weights: Weights
    seed: int
    skip: bool


def search(
    problem: Problem,
    sparsity: Sparsity,
    weights: Weights,
    *,
    seed: int,
    iterations: int,
    seconds: float | None = None,
    workers: Workers | int = 1,
    progress: Progress = silent,
    skip: bool = True,
) -> Candidate:
    """Run Algorithm 1.

    Parameters
    ----------
    problem : Problem
    sparsity : callable
        Draws p and theta of one sample from its stream; `fixed_sparsity` gives the paper's constants.
    weights : Weights
    seed : int
    iterations : int
        n_iter, the number of samples.
    seconds : float, optional
        Search for this long instead of `iterations`; the answer then depends on the machine.
    workers : Workers or int
        Who draws and evaluates the samples; a number is one of threads.
    progress : Progress
    skip : bool
        Whether candidates are given up once they cannot win; the answer is the same either way.

    Raises
    ------
    BudgetError
        When no sample has a route within the budget; it names the shortest that was found.
    DesignError
        When no sample visits two cells.
    """
    if iterations < 1:
        raise DesignError(f"iterations is {iterations}; at least 1 is needed")
    _ = problem.span  # computed here, once, and not by every worker
    found, tried, begun = Found(None), 0, time.monotonic()
    hands = workers_of(workers)

    def handed_out() -> Iterator[tuple[range, Found]]:
        first, end, size = 0, iterations if seconds is None else sys.maxsize, _BLOCK * hands.grain
        while first < end and (first == 0 or seconds is None or time.monotonic() - begun < seconds):
            last = min(first + size, end)
            yield range(first, last), found
            first = last

    shared = hands.share(_Task(problem, sparsity, weights, seed, skip))
    with one_blas_thread():
        for tried, part in hands.map(_search_part, shared, handed_out()):
            found = found.merged(part)
            if seconds is None:
                progress("searching", tried, iterations)
            else:
                progress("searching", int(min(time.monotonic() - begun, seconds) * 1000), int(seconds * 1000))
    return winner(problem, found, tried)


def search_range(
    problem: Problem,
    sparsity: Sparsity,
    weights: Weights,
    *,
    seed: int,
    samples: range,
    before: Found | None = None,
    skip: bool = True,
) -> Found:
    """Search some of the samples; ranges that `Found.merged` joins give the answer of all of them at once.

    Parameters
    ----------
    problem, sparsity, weights, seed, skip
        As of `search`.
    samples : range
        Numbers r of the samples, one after the other.
    before : Found, optional
        What other ranges came to: samples proven to cost more are given up, after the maps that go worst.
    """
    before = before or Found(None)
    best, desk = Best(bound=np.inf if before.candidate is None else before.candidate.cost, skip=skip), Desk(problem)
    if before.excess is not None:
        best.learn_order(before.excess)
    for sample in samples:
        try_sample(problem, sparsity, weights, stream(seed, sample), sample, best, desk)
    excess = best.excess if before.excess is None or best.excess is None else best.excess - before.excess
    return Found(best.candidate, best.shortest, excess)


def _search_part(task: _Task, part: tuple[range, Found]) -> tuple[int, Found]:
    """Return the number after the last sample of a range, and what it came to."""
    samples, before = part
    found = search_range(
        task.problem, task.sparsity, task.weights, seed=task.seed, samples=samples, before=before, skip=task.skip
    )
    return samples.stop, found


def evaluate(
    problem: Problem, sparsity: Sparsity, weights: Weights, *, rng: np.random.Generator, sample: int = 0
) -> Candidate | None:
    """Evaluate the one sample drawn from `rng`; None when it visits under two cells or breaks the budget."""
    best = Best()
    try_sample(problem, sparsity, weights, rng, sample, best, Desk(problem))
    return best.candidate


def winner(problem: Problem, found: Found, tried: int) -> Candidate:
    """Return the winner among `tried` samples.

    Raises
    ------
    BudgetError, DesignError
        As `search` does, when there is none.
    """
    if found.candidate is not None:
        return found.candidate
    if problem.budget is not None and np.isfinite(found.shortest):
        say = problem.budget.describe
        raise BudgetError(
            f"no route within {say(problem.budget.limit)} among {tried} samples: the shortest found "
            f"is {say(found.shortest)}. Allow a larger --budget or more --iterations."
        )
    raise DesignError(
        f"none of {tried} samples visits two cells on a path inside the area: raise --probability or lower --theta"
    )


def fixed_sparsity(probability: float, theta: int) -> Sparsity:
    """Return the paper's sampling: the same p and theta for every sample."""
    return lambda _rng: (probability, theta)
