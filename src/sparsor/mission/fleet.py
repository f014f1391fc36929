"""A route for several vehicles at once, in one round or more: cut so that the longest of their flights is short."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from sparsor.mission.sorties import ITERATIONS, SortieCosts, routes

if TYPE_CHECKING:
    from numpy.typing import NDArray

SHORTER = 0.96  # of the longest flight, which PyVRP is asked for
MOST_TRIES = 8
_BARRED_S = 1e9

Cut = list[tuple[int, list[int]]]
"""Home and stops of each flight."""
Flown = tuple[int, ...]  # flights from each home


def balanced_flights(
    costs: SortieCosts, vehicles: int, *, rounds: int = 1, seed: int = 0, iterations: int = ITERATIONS
) -> Cut:
    """Return flights over all stops, one a vehicle and round at most, the longest as short as was found.

    The route is cut where its longest part is shortest; then PyVRP is asked for flights that are all shorter, again and
    again, and at last for the least in all that is no longer.

    Parameters
    ----------
    costs : SortieCosts
        With one home, which all take off from, or one for each vehicle.
    vehicles, rounds : int
    seed, iterations : int
        Of PyVRP, which ends by a count.
    """
    best = cut_evenly(costs, vehicles, rounds)
    most = _flights_a_home(costs, vehicles, rounds)

    def shorter(than_s: float) -> Cut | None:
        return routes(replace(costs, limit_s=than_s), seed=seed, iterations=iterations, sorties=most)

    for _ in range(MOST_TRIES):
        found = shorter(SHORTER * longest_s(costs, best))
        if found is None or longest_s(costs, found) >= longest_s(costs, best):
            break
        best = found
    found = shorter(longest_s(costs, best) + 1.0)
    if found is not None and longest_s(costs, found) <= longest_s(costs, best):
        best = min(best, found, key=lambda cut: sum(costs.used_s(stops, home) for home, stops in cut))
    return best


def in_rounds(cut: Cut, vehicles: int, *, own: bool) -> list[Cut]:
    """Return flights by round: no more in each than there are vehicles, of homes of their own one from each.

    From one home flights beside each other on the route come in different rounds, where that can be: those at once are
    farther apart.

    Examples
    --------
    >>> in_rounds([(0, [0]), (0, [1]), (0, [2]), (0, [3])], 2, own=False)
    [[(0, [0]), (0, [2])], [(0, [1]), (0, [3])]]
    >>> in_rounds([(1, [0, 1]), (0, [2]), (1, [3])], 2, own=True)
    [[(1, [0, 1]), (0, [2])], [(1, [3])]]
    """
    along = sorted(cut, key=lambda flight: min(flight[1]))
    if not own:
        count = -(-len(along) // vehicles)
        return [along[first::count] for first in range(count)]
    rounds: list[Cut] = []
    taken: Counter[int] = Counter()
    for home, stops in along:
        if taken[home] == len(rounds):
            rounds.append([])
        rounds[taken[home]].append((home, stops))
        taken[home] += 1
    return rounds


def longest_s(costs: SortieCosts, cut: Cut) -> float:
    """Return what the longest flight uses."""
    return max(costs.used_s(stops, home) for home, stops in cut)


def cut_evenly(costs: SortieCosts, vehicles: int, rounds: int = 1) -> Cut:
    """Return the route in parts, one a vehicle and round at most, whose longest is as short as any cut makes it.

    Dynamic programming over the number of parts flown from each home.
    """
    used_s = _used_by_parts(costs)
    most = _flights_a_home(costs, vehicles, rounds)
    start = np.full(costs.count + 1, np.inf)
    start[0] = 0.0
    none = (0,) * costs.homes
    best: dict[Flown, NDArray[np.float64]] = {none: start}
    came: dict[Flown, list[tuple[int, int]]] = {}
    for flown in product(range(most + 1), repeat=costs.homes):
        if flown == none:
            continue
        longest, before = np.full(costs.count + 1, np.inf), [(0, 0)] * (costs.count + 1)
        for home in np.flatnonzero(flown).tolist():
            table = np.maximum(best[_one_less(flown, home)][:-1, None], used_s[home])
            begins = table.argmin(axis=0)
            for end, begin in enumerate(begins.tolist()):
                if table[begin, end] < longest[end + 1]:
                    longest[end + 1], before[end + 1] = table[begin, end], (home, begin)
        best[flown], came[flown] = longest, before
    flown = min(came, key=lambda one: (best[one][-1], sum(one)))
    return _parts(flown, came, costs.count)


def _flights_a_home(costs: SortieCosts, vehicles: int, rounds: int) -> int:
    """Return how often is taken off from each home at most: by every vehicle, or by the one whose home it is."""
    return rounds if costs.homes > 1 else rounds * vehicles


def _one_less(flown: Flown, home: int) -> Flown:
    return (*flown[:home], flown[home] - 1, *flown[home + 1 :])


def _parts(flown: Flown, came: dict[Flown, list[tuple[int, int]]], count: int) -> Cut:
    parts: Cut = []
    end = count
    while end > 0:
        home, begin = came[flown][end]
        parts.append((home, list(range(begin, end))))
        flown, end = _one_less(flown, home), begin
    return parts[::-1]


def _used_by_parts(costs: SortieCosts) -> NDArray[np.float64]:
    """Return what a flight from each home over a part of the route uses, (h, begin, end); infinite where none is."""
    along = np.minimum(np.diagonal(costs.leg_s, 1), _BARRED_S)
    legs = np.concatenate([[0.0], np.cumsum(along)])
    stops = np.concatenate([[0.0], np.cumsum(costs.stop_s)])
    over = legs[None, :] - legs[:, None] + stops[None, 1:] - stops[:-1, None]
    used = costs.fixed_s + over[None] + costs.out_s[:, :, None] + costs.back_s[:, None, :]
    backwards = np.tri(costs.count, k=-1, dtype=np.bool_)
    return np.where(backwards[None] | (used >= _BARRED_S), np.inf, used)
