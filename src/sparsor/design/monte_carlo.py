"""The paper's Algorithm 1: Monte-Carlo search for the measurement matrix and its path.

Every sample draws a random Phi, finds the path over its cells and reconstructs the validation maps; the one
with the lowest ``C = lambda_valid E + lambda_path L + lambda_incoh mu`` wins. Sample r draws from its own
stream, so that the answer does not depend on how many workers share the samples.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray  # noqa: TC002

from sparsor.core.progress import Progress, silent
from sparsor.core.streams import stream
from sparsor.core.workers import Workers, one_blas_thread, workers_of
from sparsor.design.budget import Budget  # noqa: TC001
from sparsor.design.candidate import reconstruction_error
from sparsor.design.legs import LegTable  # noqa: TC001
from sparsor.design.route import shortest_path
from sparsor.design.sensing import draw_phi, incoherence, measured_atoms
from sparsor.errors import BudgetError, DesignError

_BLOCK = 16  # samples handed to a worker at a time
# Skipping has to be exact: a candidate is given up only when it is worse by more than rounding.
_SLACK = 1.0 + 1e-9

Sparsity = Callable[[np.random.Generator], tuple[float, int]]


@dataclass(frozen=True)
class Weights:
    """The three weights of the cost C (the paper's Eq. 6)."""

    valid: float = 1.0
    path: float = 0.0
    incoherence: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("valid", self.valid), ("path", self.path), ("incoh", self.incoherence)):
            if not (np.isfinite(value) and value >= 0):
                raise DesignError(f"lambda_{name} is {value:g}; it has to be 0 or above")


@dataclass(frozen=True)
class Problem:
    """What Algorithm 1 is given.

    Parameters
    ----------
    psi : array of float64 (N, K)
        Dictionary.
    maps : array of float64 (n, N)
        Validation maps on the dictionary's scale, its mean taken off.
    lasso_weight : float
        lambda of the LASSO.
    legs : LegTable
    rows : int
        M, rows of Phi.
    budget : Budget, optional
        Routes beyond it are rejected.
    unit_rows, improve : bool
        The default reading of mu and of the path; both False is the paper's.
    """

    psi: NDArray[np.float64]
    maps: NDArray[np.float64]
    lasso_weight: float
    legs: LegTable
    rows: int = 35
    budget: Budget | None = None
    unit_rows: bool = True
    improve: bool = True

    def __post_init__(self) -> None:
        if not (np.isfinite(self.lasso_weight) and self.lasso_weight > 0):
            raise DesignError(f"lasso weight is {self.lasso_weight:g}; it has to be above 0")
        if not 1 <= self.rows <= self.legs.size:
            raise DesignError(f"rows is {self.rows}; a measurement matrix has 1..{self.legs.size} rows")
        if self.maps.shape[1] != self.legs.size or self.psi.shape[0] != self.legs.size:
            raise DesignError(
                f"maps of {self.maps.shape[1]} cells and atoms of {self.psi.shape[0]} do not fit a grid of "
                f"{self.legs.size} cells"
            )


@dataclass(frozen=True)
class Candidate:
    """One Monte-Carlo sample that was evaluated to the end.

    Parameters
    ----------
    sample : int
        r, counted from 0.
    cost, error, length_cells, incoherence : float
        C, E (mean squared l2 error), L in cell units, mu.
    phi : array of bool (M, N)
    stops : array of int64 (n,)
        The visited cells in path order.
    probability, theta : float, int
        What the sample was drawn with.
    dwells : array of int64 (n,), optional
        How many holds long the vehicle stays at each stop; None: one at every stop.
    """

    sample: int
    cost: float
    error: float
    length_cells: float
    incoherence: float
    phi: NDArray[np.bool_]
    stops: NDArray[np.int64]
    probability: float
    theta: int
    dwells: NDArray[np.int64] | None = None


@dataclass
class _Best:
    """The best candidate so far.

    Parameters
    ----------
    candidate : Candidate, optional
    shortest : float
        What the shortest route beyond the budget uses of it.
    reached : float
        A cost that others have found already.
    """

    candidate: Candidate | None = None
    shortest: float = np.inf
    reached: float = np.inf

    def ceiling(self) -> float:
        return self.reached if self.candidate is None else min(self.candidate.cost, self.reached)

    def offer(self, candidate: Candidate) -> None:
        held = self.candidate
        if held is None or (candidate.cost, candidate.sample) < (held.cost, held.sample):
            self.candidate = candidate

    def merge(self, other: _Best) -> None:
        if other.candidate is not None:
            self.offer(other.candidate)
        self.too_long(other.shortest)

    def too_long(self, used: float) -> None:
        self.shortest = min(self.shortest, used)


@dataclass(frozen=True)
class _Samples:
    """A range of samples, and the lowest cost that was known when it was handed out."""

    first: int
    last: int
    reached: float


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

    Raises
    ------
    BudgetError
        When no sample has a route within the budget; it names the shortest that was found.
    DesignError
        When no sample visits two cells.
    """
    if iterations < 1:
        raise DesignError(f"iterations is {iterations}; at least 1 is needed")
    best, tried, begun = _Best(), 0, time.monotonic()
    hands = workers_of(workers)

    def handed_out() -> Iterator[_Samples]:
        first, end, size = 0, iterations if seconds is None else sys.maxsize, _BLOCK * hands.grain
        while first < end and (first == 0 or seconds is None or time.monotonic() - begun < seconds):
            last = min(first + size, end)
            yield _Samples(first, last, best.ceiling())
            first = last

    with one_blas_thread():
        for tried, found in hands.map(_try_samples, hands.share((problem, sparsity, weights, seed)), handed_out()):
            best.merge(found)
            if seconds is None:
                progress("searching", tried, iterations)
            else:
                progress("searching", int(min(time.monotonic() - begun, seconds) * 1000), int(seconds * 1000))
    return _winner(problem, best, tried)


def evaluate(
    problem: Problem, sparsity: Sparsity, weights: Weights, *, rng: np.random.Generator, sample: int = 0
) -> Candidate | None:
    """Evaluate the one sample drawn from `rng`; None when it visits under two cells or breaks the budget."""
    best = _Best()
    _try_draw(problem, sparsity, weights, rng, sample, best)
    return best.candidate


def fixed_sparsity(probability: float, theta: int) -> Sparsity:
    """Return the paper's sampling: the same p and theta for every sample."""
    return lambda _rng: (probability, theta)


def _try_samples(given: tuple[Problem, Sparsity, Weights, int], samples: _Samples) -> tuple[int, _Best]:
    """Try a range of samples; return where it ends, and the best of those below the cost reached before."""
    problem, sparsity, weights, seed = given
    best = _Best(reached=samples.reached)
    for sample in range(samples.first, samples.last):
        _try_draw(problem, sparsity, weights, stream(seed, sample), sample, best)
    return samples.last, best


def _try_draw(
    problem: Problem,
    sparsity: Sparsity,
    weights: Weights,
    rng: np.random.Generator,
    sample: int,
    best: _Best,
) -> None:
    """Algorithm 1, lines 3 to 28, for one sample; gives up as soon as it cannot win any more."""
    legs = problem.legs
    probability, theta = sparsity(rng)
    phi = draw_phi(rng, problem.rows, legs.size, probability, theta)
    phi[:, ~legs.allowed] = False
    cells = np.flatnonzero(phi.any(axis=0))
    if cells.size < 2:  # an empty Phi has no path and would win any large lambda_path
        return
    stops = shortest_path(cells, legs.length, improve=problem.improve)
    if legs.leaves(stops):
        return
    if problem.budget is not None:
        used = problem.budget.used(stops, legs)
        if used > problem.budget.limit:
            best.too_long(used)
            return
    atoms = measured_atoms(phi, cells, problem.psi)
    mu = incoherence(atoms, phi, unit_rows=problem.unit_rows)
    length = legs.path_length(stops) / legs.cell_unit
    known = weights.path * length + weights.incoherence * mu
    error = reconstruction_error(problem, phi, cells, atoms, _error_limit(best.ceiling(), known, weights))
    if error is None:
        return
    cost = weights.valid * error + known
    best.offer(Candidate(sample, cost, error, length, mu, phi, stops, probability, theta))


def _error_limit(ceiling: float, known: float, weights: Weights) -> float:
    """Return the mean error beyond which the cost is proven to be above the best so far."""
    if weights.valid == 0:
        return np.inf
    return max(ceiling * _SLACK - known, 0.0) / weights.valid * _SLACK


def _winner(problem: Problem, best: _Best, iterations: int) -> Candidate:
    if best.candidate is not None:
        return best.candidate
    if problem.budget is not None and np.isfinite(best.shortest):
        say = problem.budget.describe
        raise BudgetError(
            f"no route within {say(problem.budget.limit)} among {iterations} samples: the shortest found "
            f"is {say(best.shortest)}. Allow a larger --budget or more --iterations."
        )
    raise DesignError(
        f"none of {iterations} samples visits two cells on a path inside the area: raise --probability or lower --theta"
    )
