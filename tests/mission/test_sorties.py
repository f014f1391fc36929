"""Every stop is in exactly one sortie, none is beyond its limit, and no better cut of the route exists."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.mission.fleet import balanced_flights, cut_evenly, in_rounds, longest_s
from sparsor.mission.sorties import SortieCosts, best_sorties, cut_route, routed


@st.composite
def costs(draw: st.DrawFn, most: int = 12, homes: int = 3) -> SortieCosts:
    """Stops in a square, homes somewhere, a wind that makes one direction longer, a limit within reach."""
    count = draw(st.integers(1, most))
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    places = rng.uniform(0, 1000, (count, 2))
    home = rng.uniform(-500, 1500, (draw(st.integers(1, homes)), 1, 2))
    wind = rng.uniform(-0.3, 0.3, 2)

    def seconds(start: np.ndarray, end: np.ndarray) -> np.ndarray:
        way = end - start
        return np.hypot(*np.moveaxis(way, -1, 0)) + way @ wind

    out, back = seconds(home, places), seconds(places, home)
    stop = rng.uniform(0, 60, count)
    fixed = draw(st.floats(0, 100))
    alone = fixed + (out + back).min(axis=0) + stop
    return SortieCosts(
        seconds(places[:, None], places), out, back, stop, fixed, float(alone.max()) * draw(st.floats(1.001, 3))
    )


@settings(max_examples=60, deadline=None)
@given(costs())
def test_every_stop_is_flown_once_within_the_limit(given_costs: SortieCosts) -> None:
    count = given_costs.count
    assert not given_costs.beyond_reach.size
    found = best_sorties(given_costs, iterations=60)
    assert sorted(itertools.chain(*found)) == list(range(count))
    assert all(given_costs.used_s(flight) <= given_costs.limit_s for flight in found)
    cut = cut_route(given_costs)
    assert given_costs.total_s(found) <= given_costs.total_s(cut)
    other = routed(given_costs, seed=0, iterations=60, sorties=len(cut) + 1)
    if other is not None:
        assert given_costs.total_s(found) <= given_costs.total_s(other)
    assert found == best_sorties(given_costs, iterations=60)


@settings(max_examples=60, deadline=None)
@given(costs(most=8))
def test_no_cut_of_the_route_uses_less(given_costs: SortieCosts) -> None:
    count = given_costs.count
    best = min(
        given_costs.total_s(parts)
        for cuts in itertools.product([False, True], repeat=count - 1)
        for parts in [_parts(count, cuts)]
        if all(given_costs.used_s(part) <= given_costs.limit_s for part in parts)
    )
    assert np.isclose(given_costs.total_s(cut_route(given_costs)), best)


def _parts(count: int, cuts: tuple[bool, ...]) -> list[list[int]]:
    edges = [0, *(place + 1 for place, cut in enumerate(cuts) if cut), count]
    return [list(range(*pair)) for pair in itertools.pairwise(edges)]


@settings(max_examples=60, deadline=None)
@given(costs())
def test_all_in_all_no_more_than_flying_on_until_the_battery_says_turn_back(given_costs: SortieCosts) -> None:
    simple = simple_cut(given_costs)
    assert sorted(itertools.chain(*simple)) == list(range(given_costs.count))
    assert given_costs.total_s(best_sorties(given_costs, iterations=20)) <= given_costs.total_s(simple) + 1e-9


@settings(max_examples=20, deadline=None)
@given(costs())
def test_another_order_is_not_taken_where_the_map_loses_by_it(given_costs: SortieCosts) -> None:
    def error(flights: list[list[int]]) -> float:
        return float(any(second != first + 1 for flight in flights for first, second in itertools.pairwise(flight)))

    found = best_sorties(given_costs, iterations=20, error=error)
    assert error(found) == 0.0
    assert given_costs.total_s(found) <= given_costs.total_s(cut_route(given_costs))
    assert best_sorties(given_costs, iterations=20, error=lambda _: 1.0) == best_sorties(given_costs, iterations=20)


@settings(max_examples=60, deadline=None)
@given(costs())
def test_a_flight_begins_and_ends_at_the_best_home(given_costs: SortieCosts) -> None:
    for flight in best_sorties(given_costs, iterations=20):
        used_s = [given_costs.used_s(flight, home) for home in range(given_costs.homes)]
        assert given_costs.used_s(flight) == used_s[given_costs.home_of(flight)] == min(used_s)
    fewer = replace(given_costs, out_s=given_costs.out_s[:1], back_s=given_costs.back_s[:1])
    if not fewer.beyond_reach.size:
        assert given_costs.total_s(cut_route(given_costs)) <= fewer.total_s(cut_route(fewer)) + 1e-9


@settings(max_examples=40, deadline=None)
@given(costs(most=6, homes=1), st.integers(1, 3), st.integers(1, 2), st.booleans(), st.integers(0, 99))
def test_no_cut_for_several_vehicles_has_a_shorter_longest_flight(given_costs, vehicles, rounds, own, seed) -> None:
    own = own and vehicles > 1
    if own:
        farther = np.random.default_rng(seed).uniform(0, 300, (vehicles, 1))
        given_costs = replace(
            given_costs, out_s=given_costs.out_s + farther, back_s=given_costs.back_s + farther
        )  # fmt: skip
    count = given_costs.count
    taken = [home for home in range(vehicles) for _ in range(rounds)] if own else [0] * (vehicles * rounds)
    least = min(
        max(given_costs.used_s(part, home) for part, home in zip(parts, homes, strict=True))
        for cuts in itertools.product([False, True], repeat=count - 1)
        for parts in [_parts(count, cuts)]
        if len(parts) <= vehicles * rounds
        for homes in set(itertools.permutations(taken, len(parts)))
    )
    even = cut_evenly(given_costs, vehicles, rounds)
    assert longest_s(given_costs, even) >= least - 1e-6
    if not own or rounds == 1:
        assert np.isclose(longest_s(given_costs, even), least)
    assert all(flown == sorted(flown) for _, flown in even)
    found = balanced_flights(given_costs, vehicles, rounds=rounds, iterations=20)
    assert longest_s(given_costs, found) <= longest_s(given_costs, even) + 1e-9
    by_round = in_rounds(found, vehicles, own=own)
    assert len(by_round) <= rounds
    assert sorted(itertools.chain(*(stops for one in by_round for _, stops in one))) == list(range(count))
    for flights in by_round:
        assert 1 <= len(flights) <= vehicles
        assert not own or len({home for home, _ in flights}) == len(flights)


def simple_cut(given_costs: SortieCosts) -> list[list[int]]:
    """Along the route, each flight as far as it can and still come home."""
    flights, flight = [], []
    for stop in range(given_costs.count):
        if flight and given_costs.used_s([*flight, stop]) > given_costs.limit_s:
            flights.append(flight)
            flight = []
        flight.append(stop)
    return [*flights, flight]


def test_a_leg_that_may_not_be_flown_is_not() -> None:
    leg = np.ones((3, 3))
    leg[0, 2] = leg[2, 0] = np.inf
    ways = np.full(3, 10.0)
    found = best_sorties(SortieCosts(leg, ways, ways, np.zeros(3), 0.0, 100.0), iterations=50)
    assert all({first, second} != {0, 2} for flight in found for first, second in itertools.pairwise(flight))


def test_what_is_too_far_is_named() -> None:
    ways = np.array([10.0, 60.0])
    assert SortieCosts(np.ones((2, 2)), ways, ways, np.zeros(2), 5.0, 100.0).beyond_reach.tolist() == [1]
