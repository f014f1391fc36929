"""Search for the route with the lowest expected error within a budget.

Several starts are annealed in a coarse model of the map, hot to warm; the best of them go on in a fine model, warm to
cold. Every chain of moves draws from its own stream and is as long as `iterations` says, so the answer depends on
neither the number of workers nor their speed.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from threading import Event, Lock
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.core.streams import stream
from sparsor.core.workers import Workers, one_blas_thread, workers_of
from sparsor.design.refined.annealing import anneal, route_error
from sparsor.design.refined.conditioning import conditioned
from sparsor.design.refined.costs import costs, shortest_pair, used
from sparsor.design.refined.crossings import crosses
from sparsor.design.refined.flyover import flyover, passes
from sparsor.design.refined.posterior import LEVEL_VARIANCE, belief
from sparsor.design.refined.readings import Sensor, weights
from sparsor.design.refined.starts import starts
from sparsor.errors import BudgetError, DesignError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.design.budget import Budget
    from sparsor.design.decoders.noise import Noise
    from sparsor.design.legs import LegTable
    from sparsor.design.refined.costs import Costs
    from sparsor.design.refined.flyover import Flyover
    from sparsor.design.refined.posterior import Belief

DEFAULT_ITERATIONS = 480_000
_STREAM = 5  # not one of Algorithm 1's, nor of the rehearsal's
_PIECE = 1000  # moves between two looks at the clock
LEAST_ITERATIONS = 10
_ROUNDING = 1e-9
_HARDLY = 0.3  # of the information that halves a variance


@dataclass(frozen=True)
class _Stage:
    """Some chains with one rank of the covariance, from one temperature to another."""

    rank: int
    chains: int
    hot: float
    cold: float


# Chosen on validation maps; each stage gets half of the moves. See docs/decisions/0012-refined-search.md.
_STAGES = (_Stage(64, 2, 0.1, 0.003), _Stage(128, 2, 0.003, 0.0003))


_EXACT = Sensor(0.0)


@dataclass(frozen=True)
class Task:
    """What the search is given.

    Parameters
    ----------
    covariance : array of float64 (N, N)
        Of maps of amplitude 1, differences from their mean; see `decoders.covariance`.
    legs : LegTable
    budget : Budget
    sensor : Sensor
        Its noise for maps of a mean variance of 1.
    hold_s : float
        A dwell, which a route may make at any stop, several times over; 0: none.
    braking_s : float
        What a dwell takes beside that.
    mapped : array of bool (N,), optional
        Cells that the error counts, those among them that may not be flown too; default: those that may be flown.
    level_variance : float
        Of the maps' level, which is as good as unknown; 0 where the covariance holds what is known of it, see `after`.
    zero_variance : float
        Of what the sensor shows too much all through the flight.
    home : int, optional
        Cell of home, where what is flown over on the ways from and to it counts as measured.
    """

    covariance: NDArray[np.float64]
    legs: LegTable
    budget: Budget
    sensor: Sensor = _EXACT
    hold_s: float = 0.0
    braking_s: float = 0.0
    mapped: NDArray[np.bool_] | None = None
    level_variance: float = LEVEL_VARIANCE
    zero_variance: float = 0.0
    home: int | None = None

    def __post_init__(self) -> None:
        size = self.legs.size
        if self.covariance.shape != (size, size):
            raise DesignError(f"a covariance of shape {self.covariance.shape} does not fit a grid of {size} cells")
        given = {"hold_s": self.hold_s, "braking_s": self.braking_s}
        unknown = {"level_variance": self.level_variance, "zero_variance": self.zero_variance}
        for name, value in {**self.sensor._asdict(), **given, **unknown}.items():
            if not (np.isfinite(value) and value >= 0):
                raise DesignError(f"{name} is {value:g}; it has to be 0 or above")

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Cells that the error counts."""
        return self.legs.allowed if self.mapped is None else self.mapped

    @property
    def reading_noise(self) -> float:
        """Variance of the reading of a cell that is flown through."""
        return self.sensor.noise + self.sensor.noise_s / self.legs.step(self.legs.seconds)

    @property
    def over(self) -> Flyover:
        """What is under its routes."""
        return flyover(self.legs, hold_s=self.hold_s, home=self.home)

    @property
    def least_telling(self) -> float:
        """Variance of a component of the maps, over all cells together, that the longest flight hardly tells of."""
        table = self.legs.length if self.budget.measure == "distance" else self.legs.seconds
        readings = self.budget.limit / self.legs.step(table)
        return _HARDLY * self.reading_noise * float(self.counted.sum()) / readings

    def readings(self, stops: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return what a route's flight measures: rows of weights over the cells (n, N), and variances (n,)."""
        return weights(self.sensor, *passes(self.over, stops), self.legs.size)

    def after(
        self, rows: NDArray[np.float64], noise: Noise, zero_variance: float = 0.0, home: int | None = None
    ) -> Task:
        """Return the task of a further flight over maps that were measured before.

        Parameters
        ----------
        rows : array of float64 (m, N)
            Weights of the cells in each reading.
        noise : Noise
            Of the readings, for maps of a mean variance of 1.
        zero_variance : float
            Of how far the sensor's zero moves until the further flight.
        home : int, optional
            Cell from which that one takes off: its way over cells that are known tells the sensor's zero.
        """
        covariance = conditioned(self.covariance, self.level_variance, rows, noise)
        return replace(self, covariance=covariance, level_variance=0.0, zero_variance=zero_variance, home=home)


@dataclass(frozen=True)
class Route:
    """A route and what to expect of it.

    Parameters
    ----------
    stops : array of int64 (n,)
        Turning points in path order; every cell under the legs between them is measured. At one that follows itself
        the vehicle dwells.
    expected_error : float
        Mean posterior variance over the cells that count as a share of the maps' variance.
    used : float
        Of the budget.
    interrupted : bool
        Whether the search was ended early.
    """

    stops: NDArray[np.int64]
    expected_error: float
    used: float
    interrupted: bool = False


def refine(
    task: Task,
    *,
    seed: int,
    iterations: int = DEFAULT_ITERATIONS,
    seconds: float | None = None,
    begin: Sequence[NDArray[np.int64]] = (),
    workers: Workers | int = 1,
    progress: Progress = silent,
) -> Route:
    """Search for the route with the lowest expected error.

    Parameters
    ----------
    task : Task
    seed : int
    iterations : int
        Moves tried, over all chains.
    seconds : float, optional
        Stop after about this long, searching again and again with that many moves; the answer then depends on the
        machine.
    begin : sequence of arrays of int64
        Further routes to start from, e.g. Algorithm 1's; those that break the budget or cross themselves are left out.
    workers : Workers or int
        Who anneals; a number is one of threads.
    progress : Progress

    Returns
    -------
    Route
        The best so far when interrupted from the keyboard.

    Raises
    ------
    BudgetError
        When the budget is too small for any start.
    """
    if iterations < LEAST_ITERATIONS:
        raise DesignError(f"iterations is {iterations}; the refined search needs at least {LEAST_ITERATIONS}")
    with one_blas_thread():
        search = _Search(task, seed, iterations, seconds, workers, progress)
        best = search.from_starts(begin)
        turn = 1
        while seconds is not None and not search.over:
            best = search.again(turn, best)
            turn += 1
        return search.route(best)


class _Search:
    """The stages of one search, and the clock and the keyboard that may end it early."""

    def __init__(
        self,
        task: Task,
        seed: int,
        iterations: int,
        seconds: float | None,
        workers: Workers | int,
        progress: Progress,
    ) -> None:
        allowed = task.legs.allowed
        self.task, self.seed, self.moves, self.progress = task, seed, iterations, progress
        self.over_cells = task.over
        self.costs = costs(task.budget, task.legs, task.hold_s + task.braking_s if task.hold_s else 0.0)
        least = task.least_telling
        shared = {"level_variance": task.level_variance, "zero_variance": task.zero_variance}
        self.beliefs = [
            belief(task.covariance, allowed, mapped=task.counted, rank=one.rank, least=least, **shared)
            for one in _STAGES
        ]
        self.hands = workers_of(workers)
        self.shared = [self.hands.share((one, self.over_cells, task.sensor, self.costs)) for one in self.beliefs]
        self.begun, self.seconds = time.monotonic(), seconds
        self.interrupted = Event()
        self.done, self.lock = 0, Lock()

    @property
    def over(self) -> bool:
        """Whether the time is up or the search was interrupted."""
        late = self.seconds is not None and time.monotonic() - self.begun > self.seconds
        return late or self.interrupted.is_set()

    def from_starts(self, begin: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
        """Return the best route that all stages find from the starts."""
        pair = shortest_pair(self.costs, self.task.legs.allowed)
        routes = [*begin, pair, *starts(self.beliefs[-1], self.costs, self.task.legs.shape, self.task.reading_noise)]
        routes = [stops for stops in routes if self.fits(stops)]
        if not routes:
            say = self.task.budget.describe
            raise BudgetError(
                f"no route within {say(self.costs.limit)}: the shortest of two cells takes "
                f"{say(used(self.costs, pair))}. Allow a larger --budget"
            )
        found = routes
        for level, stage in enumerate(_STAGES):
            found = self.anneal_all(0, level, self.ranked(found, level)[: stage.chains])
        return self.ranked([*found, *routes], len(_STAGES) - 1)[0]

    def again(self, turn: int, best: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return what the last stage makes of a route on other streams; it is no worse."""
        level = len(_STAGES) - 1
        return self.ranked(self.anneal_all(turn, level, [best] * _STAGES[level].chains), level)[0]

    def fits(self, stops: NDArray[np.int64]) -> bool:
        """Return whether a route is within the budget, inside the area and free of needless crossings."""
        if stops.size < 2 or used(self.costs, stops) > self.costs.limit or not self.task.legs.allowed[stops].all():
            return False
        return not crosses(stops, self.costs.legs, self.over_cells.columns, 0, stops.size - 1)

    def error(self, stops: NDArray[np.int64], level: int) -> float:
        return float(route_error(self.beliefs[level], self.over_cells, self.task.sensor, stops))

    def ranked(self, routes: list[NDArray[np.int64]], level: int) -> list[NDArray[np.int64]]:
        """Return routes by their expected error, the lowest first; ties stay in order."""
        return sorted(routes, key=lambda stops: self.error(stops, level))

    def anneal_all(self, turn: int, level: int, routes: list[NDArray[np.int64]]) -> list[NDArray[np.int64]]:
        """Anneal routes side by side and return the best that each led to."""
        with ThreadPoolExecutor(self.hands.count) as pool:
            chains = [pool.submit(self.chain, turn, level, number, stops) for number, stops in enumerate(routes)]
            try:
                return [one.result() for one in chains]
            except KeyboardInterrupt:
                self.interrupted.set()
                return [one.result() for one in chains]

    def chain(self, turn: int, level: int, number: int, stops: NDArray[np.int64]) -> NDArray[np.int64]:
        """Anneal one route through the temperatures of a stage, piece by piece."""
        stage, rng = _STAGES[level], stream(self.seed, _STREAM, turn, level, number)
        moves = self.moves // (len(_STAGES) * stage.chains)
        temperatures = np.geomspace(stage.hot, stage.cold, moves)
        best, lowest, size = stops, np.inf, _PIECE * self.hands.grain
        for first in range(0, moves, size):
            if self.over:
                break
            part = temperatures[first : first + size]
            stops, reached, error, rng = self.hands.call(_anneal_pieces, self.shared[level], (stops, part, rng))
            if error < lowest:
                best, lowest = reached, error
            self.tell(part.size)
        return best

    def tell(self, moves: int) -> None:
        with self.lock:
            self.done += moves
            if self.seconds is None:
                self.progress("refining the route", min(self.done, self.moves), self.moves)
            else:
                passed = min(time.monotonic() - self.begun, self.seconds)
                self.progress("refining the route", int(passed * 1000), int(self.seconds * 1000))

    def route(self, stops: NDArray[np.int64]) -> Route:
        """Return a route without the stops that change nothing."""
        level = len(_STAGES) - 1
        k = 1
        while k < stops.size - 1:
            without = np.delete(stops, k)
            idle = self.error(without, level) <= self.error(stops, level) * (1 + _ROUNDING)
            if idle and self.fits(without):
                stops = without
            else:
                k += 1
        return Route(
            stops, self.error(stops, level), float(used(self.costs, stops)), interrupted=self.interrupted.is_set()
        )


def _anneal_pieces(
    given: tuple[Belief, Flyover, Sensor, Costs],
    part: tuple[NDArray[np.int64], NDArray[np.float64], np.random.Generator],
) -> tuple[NDArray[np.int64], NDArray[np.int64], float, np.random.Generator]:
    """Anneal a route piece by piece; return the last one, the best one, its error, and the stream where it stands."""
    stops, temperatures, rng = part
    best, lowest = stops, np.inf
    for first in range(0, temperatures.size, _PIECE):
        stops, reached, error = anneal(*given, stops, temperatures[first : first + _PIECE], rng)
        if error < lowest:
            best, lowest = reached, error
    return stops, best, lowest, rng
