"""A route for several vehicles at once: cut so that the longest of their flights is short."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
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


def balanced_flights(costs: SortieCosts, vehicles: int, *, seed: int = 0, iterations: int = ITERATIONS) -> Cut:
    """Return flights over all stops, as many as vehicles at most, the longest as short as was found.

    The route is cut where its longest part is shortest; then PyVRP is asked for flights that are all shorter, again and
    again, and at last for the least in all that is no longer.

    Parameters
    ----------
    costs : SortieCosts
        With one home, which all take off from, or one for each vehicle.
    vehicles : int
    seed, iterations : int
        Of PyVRP, which ends by a count.
    """
    best = cut_evenly(costs, vehicles)
    own = costs.homes > 1
    for _ in range(MOST_TRIES):
        limited = replace(costs, limit_s=SHORTER * longest_s(costs, best))
        found = routes(limited, seed=seed, iterations=iterations, sorties=1 if own else vehicles)
        if found is None or longest_s(costs, found) >= longest_s(costs, best):
            break
        best = found
    limited = replace(costs, limit_s=longest_s(costs, best) + 1.0)
    found = routes(limited, seed=seed, iterations=iterations, sorties=1 if own else vehicles)
    if found is not None and longest_s(costs, found) <= longest_s(costs, best):
        best = min(best, found, key=lambda cut: sum(costs.used_s(stops, home) for home, stops in cut))
    return best


def longest_s(costs: SortieCosts, cut: Cut) -> float:
    """Return what the longest flight uses."""
    return max(costs.used_s(stops, home) for home, stops in cut)


def cut_evenly(costs: SortieCosts, vehicles: int) -> Cut:
    """Return the route in parts, one a vehicle at most, whose longest is as short as any cut makes it.

    Dynamic programming: of one home over the number of parts, of a home for each vehicle over the homes taken.
    """
    used_s = _used_by_parts(costs)
    own = costs.homes > 1
    taken: list[tuple[int, ...]] = [()]
    if own:
        taken += [homes for size in range(1, costs.homes + 1) for homes in combinations(range(costs.homes), size)]
    else:
        taken += [(0,) * size for size in range(1, vehicles + 1)]
    start = np.full(costs.count + 1, np.inf)
    start[0] = 0.0
    best: dict[tuple[int, ...], NDArray[np.float64]] = {(): start}
    came: dict[tuple[int, ...], list[tuple[int, int]]] = {}
    for homes in taken[1:]:
        longest, before = np.full(costs.count + 1, np.inf), [(0, 0)] * (costs.count + 1)
        for place in range(len(homes)) if own else (0,):
            others = homes[:place] + homes[place + 1 :]
            table = np.maximum(best[others][:-1, None], used_s[homes[place]])
            begins = table.argmin(axis=0)
            for end, begin in enumerate(begins.tolist()):
                if table[begin, end] < longest[end + 1]:
                    longest[end + 1], before[end + 1] = table[begin, end], (homes[place], begin)
        best[homes], came[homes] = longest, before
    homes = min(taken[1:], key=lambda one: (best[one][-1], len(one)))
    return _parts(homes, came, costs.count)


def _parts(homes: tuple[int, ...], came: dict[tuple[int, ...], list[tuple[int, int]]], count: int) -> Cut:
    parts: Cut = []
    end = count
    while end > 0:
        home, begin = came[homes][end]
        parts.append((home, list(range(begin, end))))
        place = homes.index(home)
        homes, end = homes[:place] + homes[place + 1 :], begin
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
