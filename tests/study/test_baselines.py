"""Baselines: each against its reference, every route within its budget, and the same one every time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import qr

from sparsor.core.streams import stream
from sparsor.design import Budget, Problem, unit_legs
from sparsor.errors import BudgetError, DesignError
from sparsor.study.baselines import (
    GaussianProcess,
    best_within,
    greedy_route,
    lawnmower,
    qr_pivot_tour,
    random_tour,
    tuned_ipp,
)
from sparsor.study.baselines.ipp import KERNELS
from sparsor.study.baselines.lawnmower import lawnmower_of
from sparsor.study.baselines.placement import modes, qr_pivots

SHAPE = (12, 12)
LEGS = unit_legs(SHAPE)
PROCESS = GaussianProcess("exponential", 4.0, 0.01)


@pytest.fixture(scope="module")
def maps():
    """Maps of a Gaussian process: a few dozen, on 12 x 12 cells."""
    root = np.linalg.cholesky(PROCESS.covariance(SHAPE) + 1e-9 * np.eye(LEGS.size))
    return np.random.default_rng(3).standard_normal((60, LEGS.size)) @ root.T


def routes(maps, limit):
    budget = Budget(limit, "distance")
    psi = np.linalg.qr(np.random.default_rng(0).standard_normal((LEGS.size, 24)))[0]
    problem = Problem(psi, maps[:6], 1e-2, LEGS, rows=8, budget=budget)
    return {
        "lawnmower": lawnmower(LEGS, budget),
        "random": random_tour(LEGS, budget, stream(0, 1)),
        "qr": qr_pivot_tour(maps, LEGS, budget),
        "ipp": tuned_ipp(maps[:10], LEGS, budget)[0],
        "algorithm 1": best_within(problem, seed=0, iterations=200).stops,
    }


@pytest.mark.parametrize("limit", [15.0, 33.3, 80.0])
def test_every_route_is_within_its_budget_visits_cells_once_and_comes_out_the_same_again(maps, limit):
    again = routes(maps, limit)
    for name, stops in routes(maps, limit).items():
        assert LEGS.path_length(stops) <= limit + 1e-9, name
        assert len(set(stops.tolist())) == stops.size >= 2, name
        assert set(stops.tolist()) <= set(range(LEGS.size)), name
        np.testing.assert_array_equal(stops, again[name], err_msg=name)


def test_a_lawnmower_keeps_half_a_spacing_to_every_side_and_the_next_line_would_not_fit():
    stops = lawnmower_of((32, 32), 4)
    row, column = np.divmod(stops, 32)
    assert sorted(set(row.tolist())) == [4, 12, 20, 28]
    assert set(column.tolist()) == {4, 27}
    for limit in (30.0, 77.0):
        lines = lawnmower(LEGS, Budget(limit, "distance")).size // 2
        assert LEGS.path_length(lawnmower_of(SHAPE, lines + 1)) > limit


def test_qr_pivots_are_scipys(maps):
    basis = modes(maps)
    count = basis.shape[1]
    np.testing.assert_array_equal(qr_pivots(basis)[:count], qr(basis.T, mode="r", pivoting=True)[1][:count])
    assert sorted(qr_pivots(basis).tolist()) == list(range(LEGS.size))
    np.testing.assert_allclose(basis.T @ basis, np.eye(count), atol=1e-12)


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_gains_along_a_route_sum_to_the_determinant_form(kernel):
    process = GaussianProcess(kernel, 3.0, 0.05)
    covariance = process.covariance(SHAPE)
    stops, gains = greedy_route(covariance, process.noise, LEGS, Budget(40.0, "distance"), 30)
    for count in (1, 2, stops.size):
        inner = covariance[np.ix_(stops[:count], stops[:count])]
        _, logarithm = np.linalg.slogdet(np.eye(count) + inner / process.noise)
        assert gains[:count].sum() == pytest.approx(logarithm / 2, rel=1e-9)


def test_each_greedy_step_is_the_best_gain_for_its_distance():
    covariance = PROCESS.covariance(SHAPE)
    budget = Budget(25.0, "distance")
    stops, gains = greedy_route(covariance, PROCESS.noise, LEGS, budget, 0)
    for count in range(1, 5):
        known = stops[:count]
        inner = covariance[np.ix_(known, known)] + PROCESS.noise * np.eye(count)
        variance = 1 - np.einsum("ij,ji->i", covariance[:, known], np.linalg.solve(inner, covariance[known]))
        rate = 0.5 * np.log1p(variance / PROCESS.noise) / np.maximum(LEGS.length[stops[count - 1]], 1e-300)
        rate[known] = -1
        assert rate[stops[count]] == pytest.approx(rate.max())
        assert gains[count] == pytest.approx(rate.max() * LEGS.length[stops[count - 1], stops[count]])


def test_a_prediction_repeats_readings_without_noise_and_follows_the_level(maps):
    cells = np.array([0, 17, 40, 99])
    covariance = PROCESS.covariance(SHAPE)
    predicted = PROCESS.predict(covariance, cells, maps[:3, cells], 1e-10)
    np.testing.assert_allclose(predicted[:, cells], maps[:3, cells], atol=1e-6)
    np.testing.assert_allclose(PROCESS.predict(covariance, cells, 5 + maps[:3, cells], 1e-10), 5 + predicted, atol=1e-9)


def test_a_budget_too_small_or_of_time_is_refused_in_words(maps):
    none = Budget(0.5, "distance")
    with pytest.raises(BudgetError, match="no two of the cells placed"):
        random_tour(LEGS, none, stream(0))
    with pytest.raises(BudgetError, match="no two of the cells placed"):
        qr_pivot_tour(maps, LEGS, none)
    with pytest.raises(BudgetError, match="of the start"):
        greedy_route(PROCESS.covariance(SHAPE), 0.1, LEGS, none, 0)
    with pytest.raises(BudgetError, match="no lawnmower"):
        lawnmower(LEGS, none)
    with pytest.raises(DesignError, match="not by time"):
        greedy_route(PROCESS.covariance(SHAPE), 0.1, LEGS, Budget(9.0, "time"), 0)
