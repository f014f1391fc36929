"""One sample of Algorithm 1: drawn, measured, and judged as far as it can still win."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.compiled import njit
from sparsor.design.basis import add_row, aligned
from sparsor.design.homotopy import Room, make_room
from sparsor.design.lars import Atoms, make_atoms, solve_lasso
from sparsor.design.problem import Candidate
from sparsor.design.route import shortest_path
from sparsor.design.sensing import draw_phi, incoherence, sum_cells, visited_cells

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design.problem import Problem, Sparsity, Weights
    from sparsor.design.span import Span

# Skipping has to be exact: a candidate is given up only when it is worse by more than rounding.
_SLACK = 1.0 + 1e-9


@dataclass
class Best:
    """The best candidate so far of a range of samples.

    Parameters
    ----------
    bound : float
        A cost that is known to be reached elsewhere: what is proven to be above it is given up.
    skip : bool
        Whether candidates are given up at all.
    """

    bound: float = np.inf
    skip: bool = True
    candidate: Candidate | None = None
    shortest: float = np.inf
    excess: NDArray[np.float64] | None = None
    order: NDArray[np.int64] | None = None

    def ceiling(self) -> float:
        """Return the cost above which a candidate cannot win."""
        if not self.skip:
            return np.inf
        held = self.candidate
        return self.bound if held is None else min(self.bound, held.cost)

    def offer(self, candidate: Candidate) -> None:
        """Keep a candidate that costs less, or as much at a lower sample number."""
        held = self.candidate
        if held is None or (candidate.cost, candidate.sample) < (held.cost, held.sample):
            self.candidate = candidate

    def too_long(self, used: float) -> None:
        """Remember the shortest route beyond the budget."""
        self.shortest = min(self.shortest, used)

    def learn_order(self, excess: NDArray[np.float64]) -> None:
        """Take the maps that went worst in finished candidates first: their sum passes the ceiling soonest."""
        self.excess = excess.copy() if self.excess is None else self.excess + excess
        self.order = np.argsort(-self.excess, kind="stable")


class Desk:
    """Arrays in which one worker judges one candidate after the other."""

    def __init__(self, problem: Problem) -> None:
        M, K, n = problem.rows, problem.psi.shape[1], len(problem.maps)
        self.atoms = make_atoms(K, M)
        self.room = make_room(K, M)
        self.sums = aligned(M, n)
        self.errors = np.empty(n)
        self.psi = np.ascontiguousarray(problem.psi)

    def judge(
        self, span: Span, lasso_weight: float, *, order: NDArray[np.int64] | None = None, limit: float = np.inf
    ) -> bool:
        """Write the squared errors of the maps; False once their sum is proven to be above `limit`."""
        if order is None:
            order = np.arange(self.errors.size)
        return bool(_errors_within(limit, order, self.atoms, self.sums, span, lasso_weight, self.room, self.errors))

    def measure(self, problem: Problem, phi: NDArray[np.bool_], cells: NDArray[np.int64]) -> None:
        """Take the sums of Phi over the atoms and over the maps."""
        sum_cells(phi, cells, self.psi, self.atoms.rows)
        self.atoms.columns[:] = self.atoms.rows.T
        self.atoms.known[:] = False
        sum_cells(phi, cells, problem.span.by_cell, self.sums)


def try_sample(
    problem: Problem,
    sparsity: Sparsity,
    weights: Weights,
    rng: np.random.Generator,
    sample: int,
    best: Best,
    desk: Desk,
) -> None:
    """Algorithm 1, lines 3 to 28, for one sample; gives up as soon as it cannot win any more.

    Parameters
    ----------
    problem : Problem
    sparsity : callable
    weights : Weights
    rng : numpy.random.Generator
        The sample's own stream.
    sample : int
        r, counted from 0.
    best : Best
        Is offered the candidate.
    desk : Desk
        Of one worker.
    """
    probability, theta = sparsity(rng)
    phi, cells = allowed_phi(problem, rng, probability, theta)
    if cells.size < 2:  # an empty Phi has no path and would win any large lambda_path
        return
    # A path that neither counts nor can be refused is found for those alone that may win.
    needed = weights.path > 0 or problem.budget is not None or np.isfinite(problem.legs.longest)
    stops = _path(problem, cells, best) if needed else cells
    if stops is None:
        return
    desk.measure(problem, phi, cells)
    mu = incoherence(desk.atoms.columns, phi, unit_rows=problem.unit_rows)
    known = (weights.path * _length(problem, stops) if needed else 0.0) + weights.incoherence * mu
    order = best.order if best.skip else None
    limit = _error_limit(best.ceiling(), known, weights) * len(problem.maps)
    if not desk.judge(problem.span, problem.lasso_weight, order=order, limit=limit):
        return
    if not needed:
        stops = shortest_path(cells, problem.legs.length, improve=problem.improve)
    error = float(desk.errors.sum() / len(problem.maps))
    cost = weights.valid * error + known
    best.offer(Candidate(sample, cost, error, _length(problem, stops), mu, phi, stops, probability, theta))
    best.learn_order(desk.errors - problem.span.floor)


def allowed_phi(
    problem: Problem, rng: np.random.Generator, probability: float, theta: int
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Draw a Phi over the allowed cells; return it and the cells that it visits."""
    phi = draw_phi(rng, problem.rows, problem.legs.size, probability, theta)
    if not problem.legs.allowed.all():
        phi[:, ~problem.legs.allowed] = False
    return phi, visited_cells(phi)


def _path(problem: Problem, cells: NDArray[np.int64], best: Best) -> NDArray[np.int64] | None:
    """Return the path over the cells; None when it leaves the area or breaks the budget."""
    stops = shortest_path(cells, problem.legs.length, improve=problem.improve)
    if problem.legs.leaves(stops):
        return None
    if problem.budget is not None:
        used = problem.budget.used(stops, problem.legs)
        if used > problem.budget.limit:
            best.too_long(used)
            return None
    return stops


def _length(problem: Problem, stops: NDArray[np.int64]) -> float:
    return problem.legs.path_length(stops) / problem.legs.cell_unit


def _error_limit(ceiling: float, known: float, weights: Weights) -> float:
    """Return the mean error beyond which the cost is proven to be above the ceiling; below 0 when it already is."""
    if known > ceiling * _SLACK:
        return -1.0
    if weights.valid == 0:
        return np.inf
    return (ceiling * _SLACK - known) / weights.valid * _SLACK


@njit(cache=True, nogil=True)
def _errors_within(
    limit: float,
    order: NDArray[np.int64],
    atoms: Atoms,
    sums: NDArray[np.float64],
    span: Span,
    lasso_weight: float,
    room: Room,
    errors: NDArray[np.float64],
) -> bool:
    """Write the squared error of each map, taken in `order`; False once their sum is proven to be above `limit`.

    (Algorithm 1, lines 13 to 19.) A map that is still to come counts with what no code can go below.
    """
    code = np.empty(atoms.known.size)
    left = np.empty(span.maps.shape[1])
    target = np.empty(sums.shape[0])
    total = span.floor.sum()
    for i in order:
        if total > limit:
            return False
        target[:] = sums[:, i]
        solve_lasso(atoms, target, lasso_weight, room, code)
        inside = _squared_distance(code, span.atoms, span.maps[i], left)
        errors[i] = span.floor[i] + inside
        total += inside
    return bool(total <= limit)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _squared_distance(
    code: NDArray[np.float64], atoms: NDArray[np.float64], place: NDArray[np.float64], left: NDArray[np.float64]
) -> float:
    """Return ``|place - code @ atoms|^2``; `left` is written."""
    left[:] = place
    for k in range(code.size):
        if code[k] != 0.0:
            add_row(atoms, k, -code[k], left)
    total = 0.0
    for d in range(left.size):
        total += left[d] * left[d]
    return total
