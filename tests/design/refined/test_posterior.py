"""The expected error by low-rank updates against the textbook's formula."""

from __future__ import annotations

import numpy as np
import pytest

from sparsor.design import unit_legs
from sparsor.design.decoders.covariance import kernel_covariance
from sparsor.design.refined.annealing import route_error
from sparsor.design.refined.dense import inner_products, inverse, solve
from sparsor.design.refined.flyover import flyover, response
from sparsor.design.refined.posterior import belief, changed, expected_error, posterior
from sparsor.prior.statistics import Kernel

SHAPE = (6, 7)
CELLS = SHAPE[0] * SHAPE[1]
LEGS = unit_legs(SHAPE)
ALL = np.ones(CELLS, dtype=bool)
NOISE = 0.01


def prior(allowed=ALL, rank=CELLS):
    return belief(kernel_covariance(SHAPE, Kernel(1.0, 4.0, 0.0), allowed), allowed, rank=rank, noise=NOISE)


def textbook_error(cells):
    """Trace of the posterior covariance with a level of large variance, by inverting the readings' covariance."""
    covariance = kernel_covariance(SHAPE, Kernel(1.0, 4.0, 0.0), ALL) + 100.0
    towards = covariance[:, cells]
    inner = covariance[np.ix_(cells, cells)] + (NOISE + 1e-6) * np.eye(len(cells))
    return (covariance - towards @ np.linalg.solve(inner, towards.T)).trace() / CELLS


def test_a_route_s_error_is_the_posterior_trace_of_the_cells_under_its_legs():
    stops = np.array([8, 12, 33, 29])
    error = route_error(prior(), flyover(LEGS), stops)
    assert error == pytest.approx(textbook_error(LEGS.cells_under(stops)), rel=1e-4)


def test_a_change_of_cells_is_what_starting_afresh_gives():
    share = np.zeros(CELLS)
    share[[3, 9, 20, 30]] = 1.0
    known = prior(rank=20)
    before = posterior(known, share)
    cells, difference = np.array([3, 5, 9, 40]), np.array([-1.0, 1.0, -0.4, 0.7])
    rise, left, inner = changed(known, before, cells, difference)
    share[cells] += difference
    after = posterior(known, share)
    assert expected_error(known, before) + rise == pytest.approx(expected_error(known, after), rel=1e-9)
    np.testing.assert_allclose(before - left.T @ np.linalg.solve(inner, left), after, atol=1e-9)


def test_more_cells_never_raise_the_error():
    known, over = prior(), flyover(LEGS)
    short, longer = np.array([0, 3]), np.array([0, 3, 38])
    assert route_error(known, over, longer) < route_error(known, over, short)


def test_cells_outside_the_area_count_for_nothing():
    allowed = ALL.copy()
    allowed[:14] = False
    known = prior(allowed)
    assert not known.factor[:14].any()
    assert not known.precision[:14].any()


def test_a_slow_sensor_takes_in_what_a_first_order_response_lets_it():
    assert response(0, 9.0, 0.0) == 0.0
    assert response(1, 0.0, 0.0) == 1.0
    assert response(1, 13.0, 13.0) == pytest.approx((1 - np.exp(-1)) ** 2)
    assert response(1, 2.0, 13.0) < 0.03


def test_dwelling_helps_a_slow_sensor():
    known, stops = prior(), np.array([8, 12, 33, 29])
    passing, dwelling = (route_error(known, flyover(LEGS, hold_s=hold, tau_s=5.0), stops) for hold in (0.0, 20.0))
    assert dwelling < passing
    assert route_error(known, flyover(LEGS), stops) < dwelling


def test_the_compiled_algebra_is_numpy_s():
    rng = np.random.default_rng(3)
    a, b, square = rng.normal(size=(5, 7)), rng.normal(size=(6, 4)), rng.normal(size=(6, 6))
    np.testing.assert_allclose(inner_products(a, a[:3]), a @ a[:3].T)
    np.testing.assert_allclose(solve(square, b), np.linalg.solve(square, b))
    np.testing.assert_allclose(inverse(square @ square.T), np.linalg.inv(square @ square.T), rtol=1e-6)
