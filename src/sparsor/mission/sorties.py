"""A route beyond one battery, as several flights from one of the homes and back to it."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

SCALE = 10  # PyVRP counts whole numbers: tenths of a second
ITERATIONS = 2000
SPARE_SORTIES = 1


@dataclass(frozen=True)
class SortieCosts:
    """What flights over some of a route's stops use, in seconds of the vehicle's endurance.

    Parameters
    ----------
    leg_s : array of float64 (n, n)
        Between stops, in the direction flown; infinite for legs that may not be flown.
    out_s, back_s : array of float64 (h, n)
        From each home to each stop, and from each stop to each home; (n,) of one home.
    stop_s : array of float64 (n,)
        At each stop.
    fixed_s : float
        Of each flight: take-off, landing, and what else does not depend on the stops.
    limit_s : float
        Of each flight: endurance less reserve.
    """

    leg_s: NDArray[np.float64]
    out_s: NDArray[np.float64]
    back_s: NDArray[np.float64]
    stop_s: NDArray[np.float64]
    fixed_s: float
    limit_s: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "out_s", np.atleast_2d(self.out_s))
        object.__setattr__(self, "back_s", np.atleast_2d(self.back_s))

    @property
    def count(self) -> int:
        """How many stops there are."""
        return len(self.stop_s)

    @property
    def homes(self) -> int:
        """How many homes there are."""
        return len(self.out_s)

    def home_of(self, stops: Sequence[int]) -> int:
        """Return the home from which, and back to which, a flight is shortest."""
        ways_s = self.out_s[:, stops[0]] + self.back_s[:, stops[-1]]
        return int(np.argmin(ways_s))

    def used_s(self, stops: Sequence[int], home: int | None = None) -> float:
        """Return what one flight uses, from the best home where none is given."""
        home = self.home_of(stops) if home is None else home
        order = list(stops)
        legs = float(self.leg_s[order[:-1], order[1:]].sum())
        ways = self.out_s[home, order[0]] + self.back_s[home, order[-1]]
        return float(self.fixed_s + ways + legs + self.stop_s[order].sum())

    def total_s(self, sorties: Sequence[Sequence[int]]) -> float:
        """Return what all flights use together."""
        return sum(self.used_s(stops) for stops in sorties)

    @property
    def beyond_reach(self) -> NDArray[np.int64]:
        """The stops that no flight reaches and comes home from."""
        alone = self.fixed_s + (self.out_s + self.back_s).min(axis=0) + self.stop_s
        return np.flatnonzero(alone > self.limit_s)


def best_sorties(
    costs: SortieCosts,
    *,
    seed: int = 0,
    iterations: int = ITERATIONS,
    error: Callable[[list[list[int]]], float] | None = None,
) -> list[list[int]]:
    """Return the stops of each flight, in order: the route cut best, or PyVRP's, whichever uses less.

    Parameters
    ----------
    costs : SortieCosts
        With every stop within reach; stops numbered in the order of the route.
    seed, iterations : int
        Of PyVRP, which ends by a count.
    error : callable, optional
        To expect of flights, where it depends on the order of their stops: PyVRP's, which keep no leg of the route for
        its own sake, have to be no worse than the cut route then.
    """
    cut = cut_route(costs)
    other = routed(costs, seed=seed, iterations=iterations, sorties=len(cut) + SPARE_SORTIES)
    if other is None or costs.total_s(cut) <= costs.total_s(other):
        return cut
    return cut if error is not None and error(other) > error(cut) else other


def cut_route(costs: SortieCosts) -> list[list[int]]:
    """Return the route in parts that each fit, together using least of all ways to cut it (dynamic programming)."""
    count = costs.count
    best = np.full(count + 1, np.inf)
    best[0], begins = 0.0, np.zeros(count + 1, dtype=np.int64)
    for begin in range(count):
        over_s = costs.fixed_s
        for end in range(begin, count):
            if end > begin:
                over_s += costs.leg_s[end - 1, end]
            over_s += costs.stop_s[end]
            if over_s > costs.limit_s:
                break
            whole_s = over_s + float((costs.out_s[:, begin] + costs.back_s[:, end]).min())
            if whole_s <= costs.limit_s and best[begin] + whole_s < best[end + 1]:
                best[end + 1], begins[end + 1] = best[begin] + whole_s, begin
    parts, end = [], count
    while end > 0:
        parts.append(list(range(int(begins[end]), end)))
        end = int(begins[end])
    return parts[::-1]


def routed(costs: SortieCosts, *, seed: int, iterations: int, sorties: int) -> list[list[int]] | None:
    """Return PyVRP's flights over the same stops, None where it finds none that fit.

    Parameters
    ----------
    costs : SortieCosts
    seed, iterations : int
        It ends by a count.
    sorties : int
        The most that are flown from one home.
    """
    found = routes(costs, seed=seed, iterations=iterations, sorties=sorties)
    return None if found is None else [flight for _, flight in found]


def routes(costs: SortieCosts, *, seed: int, iterations: int, sorties: int) -> list[tuple[int, list[int]]] | None:
    """Return PyVRP's flights with the home of each; parameters as `routed`."""
    from pyvrp import Model
    from pyvrp.stop import MaxIterations

    count = costs.count
    model = Model()
    homes = [model.add_location(0, 0) for _ in range(costs.homes)]
    places = [model.add_location(0, 0) for _ in range(count)]
    depots = [model.add_depot(home) for home in homes]
    for place in places:
        model.add_client(place)
    fixed = _up(costs.fixed_s)
    room = int(np.floor(costs.limit_s * SCALE)) - fixed
    for depot in depots:
        model.add_vehicle_type(
            min(sorties, count), start_depot=depot, end_depot=depot, max_distance=room, fixed_cost=fixed
        )
    for one in range(count):
        for home, out_s, back_s in zip(homes, costs.out_s[:, one], costs.back_s[:, one], strict=True):
            model.add_edge(home, places[one], distance=_up(out_s + costs.stop_s[one]))
            model.add_edge(places[one], home, distance=_up(back_s))
        for other in range(count):
            if other != one and np.isfinite(costs.leg_s[one, other]):
                model.add_edge(places[one], places[other], distance=_up(costs.leg_s[one, other] + costs.stop_s[other]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that there may be no flights that fit is an answer too
        found = model.solve(MaxIterations(iterations), seed=seed, display=False)
    if not found.is_feasible():
        return None
    flights = [
        (int(route.vehicle_type()), [int(visit.idx) for visit in route if visit.is_client()])
        for route in found.best.routes()
    ]
    fits = all(costs.used_s(flight, home) <= costs.limit_s for home, flight in flights)
    # By their first stop on the route, so that the same flights come in the same order.
    return sorted(flights, key=lambda flight: min(flight[1])) if fits else None


def _up(seconds: float) -> int:
    return math.ceil(seconds * SCALE)
