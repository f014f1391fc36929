"""The refined search: better than what it starts from, within what it is given, the same from the same seed."""

from __future__ import annotations

from _thread import interrupt_main
from dataclasses import replace
from itertools import combinations, pairwise, product
from threading import Event

import numpy as np
import pytest
import shapely

from sparsor.design import Budget, unit_legs
from sparsor.design.decoders.covariance import kernel_covariance
from sparsor.design.refined import Sensor, Task, refine
from sparsor.design.refined.annealing import route_error
from sparsor.design.refined.costs import costs, shortest_pair, used
from sparsor.design.refined.crossings import crosses
from sparsor.design.refined.flyover import flyover
from sparsor.design.refined.inducing import inducing_tour, placed
from sparsor.design.refined.posterior import belief
from sparsor.design.refined.starts import most_telling, pivots, starts, tour_within
from sparsor.errors import BudgetError, DesignError
from sparsor.prior.statistics import Kernel

SHAPE = (12, 12)
LEGS = unit_legs(SHAPE)
ALL = np.ones(LEGS.size, dtype=bool)
LIMIT = 30.0
SENSOR = Sensor(1e-3)


def task(legs=LEGS, budget=None, sensor=SENSOR, **options):
    covariance = kernel_covariance(SHAPE, Kernel(1.0, 5.0, 0.0), legs.allowed)
    return Task(covariance, legs, budget or Budget(LIMIT, "distance"), sensor, **options)


def expected(one, stops):
    """The error of the last stage's model, as a route states it."""
    known = belief(one.covariance, one.legs.allowed, rank=128, least=one.least_telling)
    return route_error(known, flyover(one.legs), one.sensor, stops)


def test_the_route_is_within_the_budget_and_better_than_every_start():
    one = task()
    route = refine(one, seed=0, iterations=4000)
    assert route.used == pytest.approx(LEGS.path_length(route.stops))
    assert route.used <= LIMIT
    begun = starts(belief(one.covariance, ALL, rank=128), costs(one.budget, LEGS), SHAPE, 1e-3)
    assert len(begun) > 4
    assert route.expected_error == pytest.approx(expected(one, route.stops))
    assert route.expected_error < 0.98 * min(expected(one, stops) for stops in begun)


def test_the_same_seed_gives_the_same_route_on_any_number_of_workers():
    one, two = (refine(task(), seed=4, iterations=1200, workers=workers) for workers in (1, 3))
    assert one.stops.tolist() == two.stops.tolist()
    other = refine(task(), seed=5, iterations=1200)
    assert other.stops.tolist() != one.stops.tolist()


def test_no_two_legs_of_the_route_cross():
    stops = refine(task(budget=Budget(60.0, "distance")), seed=1, iterations=3000).stops
    row, column = np.divmod(stops, SHAPE[1])
    legs = [shapely.LineString(pair) for pair in pairwise(np.stack([column, row], axis=1))]
    assert not any(one.crosses(other) for one, other in combinations(legs, 2))


def test_crossing_legs_are_seen_and_clear_ones_are_not():
    bow_tie = np.array([0, 13, 1, 12])
    assert crosses(np.array([0, 26, 2, 24]), LEGS.length, 12, 0, 3)
    assert crosses(bow_tie, LEGS.length, 12, 0, 3)
    assert not crosses(np.array([0, 2, 26, 24]), LEGS.length, 12, 0, 3)


def blown(wind):
    """Legs in seconds with a wind from the west, as a share of the speed through the air."""
    column = np.arange(LEGS.size) % SHAPE[1]
    east = column - column[:, None]
    # Ground speed along a leg that is held against the wind (the triangle of velocities).
    along = np.divide(east, LEGS.length, out=np.zeros_like(LEGS.length), where=LEGS.length > 0) * wind
    across = wind**2 - along**2
    return replace(LEGS, seconds=LEGS.length / (along + np.sqrt(1 - across)))


def test_with_wind_no_crossing_is_left_that_turning_a_stretch_round_would_shorten():
    legs = blown(0.5)
    budget = Budget(70.0, "time", home=np.zeros(LEGS.size))
    route = refine(task(legs, budget), seed=3, iterations=4000)
    stops = route.stops
    assert route.used == pytest.approx(legs.path_seconds(stops))
    assert route.used <= 70.0
    row, column = np.divmod(stops, SHAPE[1])
    lines = [shapely.LineString(pair) for pair in pairwise(np.stack([column, row], axis=1))]
    for a, b in combinations(range(len(lines)), 2):
        if b > a + 1 and lines[a].intersects(lines[b]):
            turned = np.concatenate([stops[: a + 1], stops[a + 1 : b + 1][::-1], stops[b + 1 :]])
            assert legs.path_seconds(turned) >= legs.path_seconds(stops) * (1 - 1e-9)


def test_wind_makes_a_route_and_its_way_back_cost_different():
    legs = blown(0.5)
    there = np.array([0, 11])
    assert legs.path_seconds(there) == pytest.approx(11 / 1.5)
    assert used(costs(Budget(99.0, "time", home=np.zeros(LEGS.size)), legs), there[::-1]) == pytest.approx(22.0)


def test_the_route_stays_on_allowed_cells():
    allowed = ALL.reshape(SHAPE).copy()
    allowed[3:8, 4:9] = False
    legs = replace(LEGS, allowed=allowed.ravel()).kept_inside()
    route = refine(task(legs), seed=0, iterations=2000)
    assert allowed.ravel()[legs.cells_under(route.stops)].all()
    assert route.used <= LIMIT


def test_a_time_budget_counts_stops_and_the_way_home():
    home = np.full(LEGS.size, 3.0)
    budget = Budget(60.0, "time", per_stop=2.0, fixed=5.0, home=home)
    route = refine(task(budget=budget), seed=0, iterations=1000)
    assert route.used == pytest.approx(budget.used(route.stops, LEGS))
    assert route.used <= 60.0
    closed = Budget(60.0, "time", per_stop=2.0)
    stops = np.array([0, 5, 40])
    assert used(costs(closed, LEGS), stops) == pytest.approx(closed.used(stops, LEGS))


def test_dwells_are_chosen_where_they_pay_and_count_as_way_flown():
    legs, sensor = unit_legs((3, 3)), Sensor(1e-3, 1.0, 2.0)
    known = kernel_covariance((3, 3), Kernel(1.0, 1.0, 0.0), legs.allowed)
    budget = Budget(LIMIT, "distance")  # far more than the nine cells need
    route = refine(Task(known, legs, budget, sensor, hold_s=1.5), seed=0, iterations=3000)
    dwells = int((np.diff(route.stops) == 0).sum())
    assert dwells > 3
    assert route.used == pytest.approx(legs.path_length(route.stops) + 1.5 * dwells)
    assert route.used <= LIMIT
    without = refine(Task(known, legs, budget, sensor), seed=0, iterations=3000)
    assert (np.diff(without.stops) != 0).all()
    assert route.expected_error < without.expected_error


def test_a_slow_sensor_tells_less_of_the_same_budget():
    fast, slow = (refine(task(sensor=Sensor(1e-3, 0.0, tau)), seed=0, iterations=2000) for tau in (0.0, 5.0))
    assert slow.expected_error > fast.expected_error


def test_a_route_of_one_s_own_is_never_made_worse():
    one = task()
    good = refine(one, seed=0, iterations=4000)
    again = refine(one, seed=9, iterations=100, begin=[good.stops])
    assert again.expected_error <= good.expected_error * (1 + 1e-9)


def test_an_interruption_gives_the_best_so_far():
    pressed = Event()

    def press(_task, done, _total):
        if done > 1000 and not pressed.is_set():
            pressed.set()
            interrupt_main()  # what Ctrl-C does

    route = refine(task(), seed=0, iterations=40_000, progress=press)
    assert route.interrupted
    assert route.used <= LIMIT


def test_with_a_time_to_spend_it_goes_on():
    route = refine(task(), seed=0, iterations=200, seconds=0.5)
    assert route.expected_error <= refine(task(), seed=0, iterations=200).expected_error
    assert not route.interrupted


def test_rankings_name_each_cell_once():
    prior = belief(task().covariance, ALL, rank=20)
    for ranking in (pivots(prior, 1e-3), most_telling(prior, 1e-3)):
        assert np.unique(ranking).size == ranking.size == 21
        assert LEGS.path_length(tour_within(ranking, costs(Budget(LIMIT, "distance"), LEGS))) <= LIMIT


@pytest.mark.parametrize("seed", range(4))
def test_inducing_points_go_where_they_tell_more(seed):
    prior = belief(task().covariance, ALL, rank=40)
    begin = np.random.default_rng(seed).choice(LEGS.size, 8, replace=False)

    def error(cells):
        return route_error_of(prior, cells)

    found = placed(prior, SHAPE, 1e-3, begin)
    assert error(found) < error(begin)
    assert error(placed(prior, SHAPE, 1e-3, found)) < 1.05 * error(found)  # it is a resting place, but for rounding


def route_error_of(prior, cells):
    """Expected error with single readings of some cells, whatever the way between them."""
    rows = prior.factor[cells]
    information = np.diag(1 / prior.spread) + rows.T @ (rows / (prior.residual[cells, None] + 1e-3))
    return np.linalg.inv(information).diagonal() @ prior.size


def test_a_tour_of_inducing_points_keeps_the_budget_and_stays_inside():
    allowed = ALL.reshape(SHAPE).copy()
    allowed[:, 7:] = False
    legs = replace(LEGS, allowed=allowed.ravel()).kept_inside()
    one = task(legs)
    prior = belief(one.covariance, legs.allowed, rank=40)
    spent = costs(one.budget, legs)
    tour = inducing_tour(prior, spent, SHAPE, 1e-3, most_telling(prior, 1e-3))
    assert tour.size > 4
    assert used(spent, tour) <= LIMIT
    assert legs.allowed[tour].all()


def test_the_shortest_pair_is_the_cheapest_of_all():
    legs = blown(0.3)
    spent = costs(Budget(99.0, "time", home=np.arange(LEGS.size) * 0.01), legs)
    pair = shortest_pair(spent, ALL)
    every = [used(spent, np.array(both)) for both in product(range(LEGS.size), repeat=2) if both[0] != both[1]]
    assert used(spent, pair) == pytest.approx(min(every))


def test_what_cannot_be_searched_is_refused():
    with pytest.raises(BudgetError, match="the shortest of two cells takes 1 m"):
        refine(task(budget=Budget(0.5, "distance")), seed=0)
    with pytest.raises(DesignError, match="at least 10"):
        refine(task(), seed=0, iterations=3)
    with pytest.raises(DesignError, match="noise is -1"):
        task(sensor=Sensor(-1.0))
