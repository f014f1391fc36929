from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from design import plain
from design.conftest import SHAPE
from sparsor.design import Budget, Weights, fixed_sparsity, search, searched_sparsity
from sparsor.errors import BudgetError, DesignError

P, THETA = 0.12, 3


@pytest.mark.parametrize("paper", [False, True])
@pytest.mark.parametrize("weights", [(1.0, 0.0, 0.0), (1.0, 0.02, 0.5), (0.0, 1.0, 0.0)])
def test_same_phi_path_and_cost_as_the_papers_pseudocode(problem, paper, weights):
    ours = search(
        replace(problem, unit_rows=not paper, improve=not paper),
        fixed_sparsity(P, THETA),
        Weights(*weights),
        seed=3,
        iterations=25,
        workers=2,
    )
    phi, path, sample, cost = plain.algorithm_1(
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
    assert ours.sample == sample
    np.testing.assert_array_equal(ours.phi, phi)
    np.testing.assert_array_equal(ours.stops, path)
    assert ours.cost == pytest.approx(cost, rel=1e-9)


def test_the_answer_does_not_depend_on_the_number_of_workers(problem):
    found = [
        search(problem, fixed_sparsity(P, THETA), Weights(1, 0.01, 0.1), seed=5, iterations=80, workers=n)
        for n in (1, 2, 5)
    ]
    for other in found[1:]:
        assert (other.sample, other.cost) == (found[0].sample, found[0].cost)
        np.testing.assert_array_equal(other.phi, found[0].phi)
        np.testing.assert_array_equal(other.stops, found[0].stops)


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
    found = search(
        replace(problem, legs=legs, budget=budget),
        searched_sparsity(budget.stops_within(legs), int(allowed.sum()), problem.rows),
        Weights(),
        seed=4,
        iterations=300,
        workers=2,
    )
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
