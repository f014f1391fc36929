"""The paper's Algorithm 1: Monte-Carlo search for the measurement matrix and its path.

Every sample draws a random Phi, finds the path over its cells and reconstructs the validation maps; the one
with the lowest ``C = lambda_valid E + lambda_path L + lambda_incoh mu`` wins. Sample r draws from its own
stream, so that the answer does not depend on how many workers share the samples.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.core.streams import stream
from sparsor.core.workers import one_blas_thread
from sparsor.design.candidate import Best, Desk, try_sample
from sparsor.errors import BudgetError, DesignError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from sparsor.design.problem import Candidate, Problem, Sparsity, Weights

_BLOCK = 16  # samples handed to a worker at a time
_SLICE = 256  # blocks that wait for a worker


@dataclass(frozen=True)
class Found:
    """What a range of samples came to.

    Parameters
    ----------
    candidate : Candidate, optional
        The cheapest, at equal cost the one with the lowest number; None when none can win.
    shortest : float
        What the shortest route beyond the budget uses; infinite when there was none.
    """

    candidate: Candidate | None
    shortest: float = np.inf

    def merged(self, other: Found) -> Found:
        """Return what both ranges together came to, in whichever order they were searched."""
        candidates = [one for one in (self.candidate, other.candidate) if one is not None]
        winner = min(candidates, key=lambda one: (one.cost, one.sample), default=None)
        return Found(winner, min(self.shortest, other.shortest))


def search(
    problem: Problem,
    sparsity: Sparsity,
    weights: Weights,
    *,
    seed: int,
    iterations: int,
    seconds: float | None = None,
    workers: int = 1,
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
    workers : int
        Threads; the compiled parts run side by side.
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
    if seconds is None:
        found = search_range(
            problem,
            sparsity,
            weights,
            seed=seed,
            samples=range(iterations),
            workers=workers,
            progress=progress,
            skip=skip,
        )
        return winner(problem, found, iterations)
    best = Best(skip=skip)
    run = _runner(problem, sparsity, weights, seed, best)
    with _threads(workers) as pool:
        tried = _search_for(seconds, pool, run, workers, progress)
    return winner(problem, Found(best.candidate, best.shortest), tried)


def search_range(
    problem: Problem,
    sparsity: Sparsity,
    weights: Weights,
    *,
    seed: int,
    samples: range,
    bound: float = np.inf,
    workers: int = 1,
    progress: Progress = silent,
    skip: bool = True,
) -> Found:
    """Search some of the samples; ranges that `Found.merged` joins give the answer of all of them at once.

    Parameters
    ----------
    problem, sparsity, weights, seed, workers, progress, skip
        As of `search`.
    samples : range
        Numbers r of the samples, one after the other.
    bound : float
        The cost of a candidate of another range: samples proven to be above it are given up.
    """
    best = Best(bound=bound, skip=skip)
    run = _runner(problem, sparsity, weights, seed, best)
    blocks = [samples[first : first + _BLOCK] for first in range(0, len(samples), _BLOCK)]
    with _threads(workers) as pool:
        for first in range(0, len(blocks), _SLICE):  # not all at once: there may be millions
            for after in pool.map(run, blocks[first : first + _SLICE]):
                progress("searching", after - samples.start, len(samples))
    return Found(best.candidate, best.shortest)


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


def _runner(problem: Problem, sparsity: Sparsity, weights: Weights, seed: int, best: Best) -> Callable[[range], int]:
    """Return what a worker does with a block of samples; it returns the number after the last."""
    _ = problem.span  # computed here, once, and not by every worker

    def run(block: range) -> int:
        desk = Desk(problem)
        for sample in block:
            try_sample(problem, sparsity, weights, stream(seed, sample), sample, best, desk)
        return block.stop

    return run


@contextmanager
def _threads(workers: int) -> Iterator[ThreadPoolExecutor]:
    """Run with a pool of threads that drops what still waits when something goes wrong."""
    with one_blas_thread(), ThreadPoolExecutor(workers) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _search_for(
    seconds: float, pool: ThreadPoolExecutor, run: Callable[[range], int], workers: int, progress: Progress
) -> int:
    """Work through blocks until the time is up; return how many samples were tried."""
    start = time.monotonic()
    for first in count(0, workers * _BLOCK):
        tried = max(pool.map(run, [range(at, at + _BLOCK) for at in range(first, first + workers * _BLOCK, _BLOCK)]))
        passed = time.monotonic() - start
        progress("searching", int(min(passed, seconds) * 1000), int(seconds * 1000))
        if passed >= seconds:
            break
    return tried
