"""A route for several vehicles at once, in one round or more: cut so that the longest of their flights is short."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

import numpy as np

from sparsor.mission.sorties import ITERATIONS, SortieCosts, routes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

SHORTER = 0.96  # of the longest flight, which PyVRP is asked for
MOST_TRIES = 8
_BARRED_S = 1e9

Cut = list[tuple[int, list[int]]]
"""Home and stops of each flight."""


def balanced_flights(
    costs: SortieCosts,
    vehicles: int,
    *,
    rounds: int = 1,
    even: Cut | None = None,
    seed: int = 0,
    iterations: int = ITERATIONS,
) -> Cut:
    """Return flights over all stops, one a vehicle and round at most, the longest as short as was found.

    The route is cut where its longest part is shortest; then PyVRP is asked for flights that are all shorter, again and
    again, and at last for the least in all that is no longer.

    Parameters
    ----------
    costs : SortieCosts
        With one home, which all take off from, or one for each vehicle.
    vehicles, rounds : int
    even : list, optional
        What `cut_evenly` returns, where that is known.
    seed, iterations : int
        Of PyVRP, which ends by a count.
    """
    best = cut_evenly(costs, vehicles, rounds) if even is None else even
    most = rounds if costs.homes > 1 else rounds * vehicles

    def shorter(than_s: float) -> Cut | None:
        return routes(replace(costs, limit_s=than_s), seed=seed, iterations=iterations, sorties=most)

    # A route with legs that may not be flown has no cut: then any flights that fit a battery are a beginning.
    least_s = SHORTER * longest_s(costs, best) if np.isfinite(longest_s(costs, best)) else costs.limit_s
    for _ in range(MOST_TRIES):
        found = shorter(least_s)
        if found is None or longest_s(costs, found) >= longest_s(costs, best):
            break
        best, least_s = found, SHORTER * longest_s(costs, found)
    if not np.isfinite(longest_s(costs, best)):
        return best
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
    """Return the route in parts, one a vehicle and round at most, whose longest is short.

    As short as any cut makes it in one round, and from one home; with homes of their own each round flies a stretch of
    the route, all of about one length. Dynamic programming: of one home over the number of parts, of a home for each
    vehicle over the homes taken.
    """
    used_s = _used_by_parts(costs)
    if costs.homes == 1:
        return _cut(used_s, [(0,) * size for size in range(1, rounds * vehicles + 1)])
    taken = [homes for size in range(1, costs.homes + 1) for homes in combinations(range(costs.homes), size)]
    begins = [0, *_evenly(costs, rounds), costs.count]
    return [
        (home, [begin + stop for stop in stops])
        for begin, end in pairwise(begins)
        if begin < end
        for home, stops in _cut(used_s[:, begin:end, begin:end], taken)
    ]


def _evenly(costs: SortieCosts, parts: int) -> list[int]:
    """Return where stretches of the route of about one length begin, but for the first."""
    along_s = np.cumsum(costs.stop_s + np.append(0.0, np.minimum(np.diagonal(costs.leg_s, 1), _BARRED_S)))
    shares = along_s[-1] * np.arange(1, parts) / parts
    return [int(begin) for begin in np.searchsorted(along_s, shares)]


def _cut(used_s: NDArray[np.float64], taken: Sequence[tuple[int, ...]]) -> Cut:
    """Return stops in parts whose longest is as short as any cut makes it, with one of some choices of homes.

    Parameters
    ----------
    used_s : array of float64 (h, n, n)
        By a flight from each home over the stops from one to another.
    taken : sequence of tuples
        Homes that are flown from, those first that others are got from by adding one.
    """
    count = used_s.shape[1]
    start = np.full(count + 1, np.inf)
    start[0] = 0.0
    best: dict[tuple[int, ...], NDArray[np.float64]] = {(): start}
    came: dict[tuple[int, ...], list[tuple[int, int]]] = {}
    for homes in taken:
        longest, before = np.full(count + 1, np.inf), [(0, 0)] * (count + 1)
        for place in range(len(homes)) if used_s.shape[0] > 1 else (0,):
            others = homes[:place] + homes[place + 1 :]
            table = np.maximum(best[others][:-1, None], used_s[homes[place]])
            begins = table.argmin(axis=0)
            for end, begin in enumerate(begins.tolist()):
                if table[begin, end] < longest[end + 1]:
                    longest[end + 1], before[end + 1] = table[begin, end], (homes[place], begin)
        best[homes], came[homes] = longest, before
    return _parts(min(taken, key=lambda one: (best[one][-1], len(one))), came, count)


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
