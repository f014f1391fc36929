from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from design import plain
from design.conftest import SHAPE
from sparsor.core.streams import stream
from sparsor.design import Budget, Weights, evaluate, fixed_sparsity, search, searched_sparsity
from sparsor.design.monte_carlo import Found, search_range
from sparsor.errors import BudgetError, DesignError

P, THETA = 0.12, 3


@pytest.fixture(scope="module")
def plain_answer(problem):
    """Return what the paper's pseudocode finds, each setting computed once."""

    @cache
    def answer(paper, weights):
        return plain.algorithm_1(
            problem.psi,
            problem.maps,
            SHAPE,
            M=problem.rows,
            p=P,
            theta=THETA,
            n_iter=25,
            lambdas=weights,
            lasso=problem.lasso_weight,
            seed=3,
            paper=paper,
        )

    return answer


@pytest.mark.parametrize("paper", [False, True])
@pytest.mark.parametrize("weights", [(1.0, 0.0, 0.0), (1.0, 0.02, 0.5), (0.0, 1.0, 0.0)])
@pytest.mark.parametrize(("workers", "skip"), [(1, False), (1, True), (2, True), (3, True), (3, False)])
def test_same_phi_path_and_cost_as_the_papers_pseudocode(problem, plain_answer, paper, weights, workers, skip):
    ours = search(
        replace(problem, unit_rows=not paper, improve=not paper),
        fixed_sparsity(P, THETA),
        Weights(*weights),
        seed=3,
        iterations=25,
        workers=workers,
        skip=skip,
    )
    phi, path, sample, cost = plain_answer(paper, weights)
    assert ours.sample == sample
    np.testing.assert_array_equal(ours.phi, phi)
    np.testing.assert_array_equal(ours.stops, path)
    assert ours.cost == pytest.approx(cost, rel=1e-9)


def same(one, other):
    """Whether two candidates are the same to the last bit."""
    return (one.sample, one.cost, one.error, one.length_cells, one.incoherence) == (
        other.sample,
        other.cost,
        other.error,
        other.length_cells,
        other.incoherence,
    ) and all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("phi", "stops"))


@pytest.mark.parametrize("weights", [(1, 0, 0), (1, 0.01, 0.1), (0, 1, 1)])
def test_neither_workers_nor_skipping_change_a_bit_of_the_answer(problem, weights):
    found = [
        search(problem, fixed_sparsity(P, THETA), Weights(*weights), seed=5, iterations=80, workers=workers, skip=skip)
        for workers in (1, 2, 3, 5)
        for skip in (True, False)
    ]
    assert all(same(other, found[0]) for other in found[1:])


def one_of_four(rng):
    """Let every sample draw one of four Phi."""
    rng.bit_generator.state = stream(0, int(rng.integers(4))).bit_generator.state
    return P, THETA


@pytest.mark.parametrize("weights", [(1, 0, 0), (1, 0.01, 0.1), (0, 0, 0)])
@pytest.mark.parametrize("skip", [True, False])
def test_of_equal_costs_the_lowest_sample_wins(problem, weights, skip):
    alone = [
        evaluate(problem, one_of_four, Weights(*weights), rng=stream(8, sample), sample=sample) for sample in range(40)
    ]
    first = min(alone, key=lambda one: (one.cost, one.sample))
    assert sum(one.cost == first.cost for one in alone) > 4  # there are ties
    for workers in (1, 2, 3):
        found = search(problem, one_of_four, Weights(*weights), seed=8, iterations=40, workers=workers, skip=skip)
        assert same(found, first)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_ranges_searched_apart_give_the_answer_of_the_whole(problem, order):
    sparsity, weights = fixed_sparsity(P, THETA), Weights(1, 0.01, 0.1)
    ranges = (range(20), range(20, 47), range(47, 60))
    found = Found(None)
    for number in order:
        part = search_range(problem, sparsity, weights, seed=6, samples=ranges[number], before=found)
        found = found.merged(part)
    assert same(found.candidate, search(problem, sparsity, weights, seed=6, iterations=60))


def test_a_range_that_cannot_win_finds_nothing(problem):
    sparsity = fixed_sparsity(P, THETA)
    cheap = Found(replace(evaluate(problem, sparsity, Weights(), rng=stream(6, 0)), cost=1e-9))
    found = search_range(problem, sparsity, Weights(), seed=6, samples=range(5, 15), before=cheap)
    assert found.candidate is None


def test_a_bound_that_is_just_met_is_kept(problem):
    sparsity, samples = fixed_sparsity(P, THETA), range(30)
    best = search_range(problem, sparsity, Weights(), seed=6, samples=samples).candidate
    again = search_range(problem, sparsity, Weights(), seed=6, samples=samples, before=Found(best))
    assert same(again.candidate, best)


def test_more_iterations_never_give_a_higher_cost(problem):
    costs = [
        search(problem, fixed_sparsity(P, THETA), Weights(1, 0.01, 0.1), seed=9, iterations=n).cost
        for n in (1, 5, 20, 60)
    ]
    assert costs == sorted(costs, reverse=True)


def test_other_seeds_give_other_answers(problem):
    first, second = (search(problem, fixed_sparsity(P, THETA), Weights(), seed=seed, iterations=5) for seed in (0, 1))
    assert not np.array_equal(first.phi, second.phi)


def test_phi_is_pruned_and_the_path_visits_its_columns(problem):
    found = search(problem, fixed_sparsity(P, THETA), Weights(), seed=2, iterations=10)
    ones = found.phi.sum(axis=0)
    assert set(np.unique(ones)) <= {0, *range(THETA, problem.rows + 1)}
    np.testing.assert_array_equal(np.sort(found.stops), np.flatnonzero(ones))


def test_routes_stay_within_the_budget_and_off_forbidden_cells(problem):
    allowed = np.ones(problem.legs.size, dtype=bool)
    allowed[::7] = False
    legs = replace(problem.legs, allowed=allowed)
    budget = Budget(25.0, "distance")
    sparsity = searched_sparsity(budget.stops_within(legs), int(allowed.sum()), problem.rows)
    found, unskipped = (
        search(
            replace(problem, legs=legs, budget=budget),
            sparsity,
            Weights(),
            seed=4,
            iterations=300,
            workers=2,
            skip=skip,
        )
        for skip in (True, False)
    )
    assert same(found, unskipped)
    assert legs.path_length(found.stops) <= 25.0
    assert allowed[found.stops].all()


def test_error_counts_allowed_cells_only(problem):
    half = np.arange(problem.legs.size) < problem.legs.size // 2
    restricted = replace(problem, legs=replace(problem.legs, allowed=half))
    found = search(restricted, fixed_sparsity(0.2, THETA), Weights(), seed=1, iterations=3)
    from sparsor.design import lasso

    phi = found.phi.astype(float)
    estimate = lasso(phi @ problem.psi, problem.maps @ phi.T, problem.lasso_weight) @ problem.psi.T
    assert found.error == pytest.approx(((problem.maps - estimate)[:, half] ** 2).sum(axis=1).mean())


def test_a_budget_nobody_meets_names_the_shortest_found(problem):
    with pytest.raises(BudgetError, match=r"no route within 1 m among 40 samples: the shortest found is \d+ m"):
        search(
            replace(problem, budget=Budget(0.5 + 0.5, "distance")),
            fixed_sparsity(P, THETA),
            Weights(),
            seed=0,
            iterations=40,
        )


def test_an_empty_phi_never_wins(problem):
    with pytest.raises(DesignError, match="visits two cells"):
        search(problem, fixed_sparsity(1e-9, 1), Weights(1, 1e9, 0), seed=0, iterations=20)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lasso_weight": 0.0}, "lasso weight is 0"),
        ({"rows": 0}, "rows is 0"),
        ({"maps": np.zeros((2, 5))}, "do not fit a grid"),
    ],
)
def test_a_problem_that_does_not_fit_is_refused(problem, change, message):
    with pytest.raises(DesignError, match=message):
        replace(problem, **change)


def test_weights_are_checked():
    with pytest.raises(DesignError, match="lambda_path is -1"):
        Weights(1.0, -1.0, 0.0)
