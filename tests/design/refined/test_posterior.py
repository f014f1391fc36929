"""The expected error by low-rank updates against the textbook's formula, for fast sensors and slow ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.design import Budget, unit_legs
from sparsor.design.decoders.covariance import kernel_covariance
from sparsor.design.refined import Sensor, Task
from sparsor.design.refined.annealing import route_error
from sparsor.design.refined.dense import gram, inner_products, inverse_root, solve
from sparsor.design.refined.flyover import flyover, passes
from sparsor.design.refined.posterior import belief, changed, posterior_root, root_error
from sparsor.design.refined.readings import readings, readings_after, weights
from sparsor.prior.statistics import Kernel

SHAPE = (6, 7)
CELLS = SHAPE[0] * SHAPE[1]
LEGS = unit_legs(SHAPE)
ALL = np.ones(CELLS, dtype=bool)
FAST, SLOW = Sensor(0.01, 0.02), Sensor(0.01, 0.02, 1.7)
OVER = flyover(LEGS, hold_s=3.0)
STOPS = np.array([8, 12, 33, 33, 29])
ROUTES = st.lists(st.integers(0, CELLS - 1), min_size=2, max_size=7).map(np.array)


def covariance():
    return kernel_covariance(SHAPE, Kernel(1.0, 4.0, 0.0), ALL)


def prior(allowed=ALL, rank=CELLS):
    return belief(kernel_covariance(SHAPE, Kernel(1.0, 4.0, 0.0), allowed), allowed, rank=rank)


def textbook_error(rows, variance):
    """Trace of the posterior covariance with a level of large variance, by inverting the readings' covariance."""
    known = covariance() + 100.0
    towards = known @ rows.T
    # What the factor leaves of each cell, 1e-6, counts as noise.
    inner = rows @ known @ rows.T + np.diag(variance + 1e-6 * np.square(rows).sum(axis=1))
    return (known - towards @ np.linalg.solve(inner, towards.T)).trace() / CELLS


@pytest.mark.parametrize("sensor", [FAST, SLOW])
def test_a_route_s_error_is_the_posterior_trace_of_what_its_flight_measures(sensor):
    rows, variance = Task(covariance(), LEGS, Budget(99.0, "distance"), sensor, hold_s=3.0).readings(STOPS)
    np.testing.assert_allclose(rows.sum(axis=1), 1.0)
    assert route_error(prior(), OVER, sensor, STOPS) == pytest.approx(textbook_error(rows, variance), rel=1e-4)


def test_a_fast_sensor_reads_each_cell_under_the_legs_better_the_longer_it_is_there():
    stops = np.array([8, 12, 8])  # there and back
    rows, variance = weights(FAST, *passes(OVER, stops), CELLS)
    assert rows.argmax(axis=1).tolist() == [8, 9, 10, 11, 12]
    np.testing.assert_allclose(variance, 0.01 + 0.02 / np.array([1.0, 2.0, 2.0, 2.0, 1.0]))


def test_a_slow_sensor_s_rows_are_the_means_of_a_first_order_response():
    """Against the differential equation, ``dx/dt = (air - x) / tau``, in small steps."""
    stops = np.array([8, 12, 33, 33])
    cell, seconds = passes(OVER, stops)
    assert seconds.sum() == pytest.approx(LEGS.path_length(stops) + 3.0)
    rows, variance = weights(SLOW, cell, seconds, CELLS)
    air, steps = np.random.default_rng(0).normal(size=CELLS), 20_000
    held, means = air[cell[0]], []
    for under, time in zip(cell, seconds, strict=True):
        total = 0.0
        for _ in range(steps):
            middle = held + (air[under] - held) * time / steps / SLOW.tau_s / 2
            held += (air[under] - middle) * time / steps / SLOW.tau_s
            total += middle
        means.append(total / steps)
    np.testing.assert_allclose(rows @ air, means, atol=1e-6)
    np.testing.assert_allclose(variance, 0.01 + 0.02 / seconds)


@settings(max_examples=40, deadline=None)
@given(ROUTES, ROUTES, st.sampled_from([FAST, SLOW]))
def test_a_change_of_route_is_what_starting_afresh_gives(one, other, sensor):
    known = prior(rank=20)
    start = readings(known, sensor, *passes(OVER, one))
    made, rows, difference = readings_after(known, sensor, *passes(OVER, other), start)
    fresh = readings(known, sensor, *passes(OVER, other))
    assert made.cell.tolist() == fresh.cell.tolist()
    np.testing.assert_allclose(made.precision, fresh.precision, rtol=1e-3)
    np.testing.assert_allclose(made.row, fresh.row, atol=0.03)

    def after(one):
        return posterior_root(known, known.factor[one.cell] if sensor.tau_s == 0 else one.row, one.precision)

    before, expected = gram(after(start)), gram(after(fresh))
    if not difference.size:
        np.testing.assert_allclose(before, expected, atol=1e-9)
        return
    rise, left, inner = changed(known, before, rows, difference)
    assert root_error(known, after(start)) == pytest.approx(before.diagonal() @ known.size)
    assert before.diagonal() @ known.size + rise == pytest.approx(expected.diagonal() @ known.size, rel=0.02)
    if sensor.tau_s == 0:  # what a slow sensor still holds long after a change is neglected
        np.testing.assert_allclose(before - left.T @ np.linalg.solve(inner, left), expected, atol=1e-8)


def test_a_small_change_touches_few_readings_of_a_slow_sensor():
    known, stops = prior(rank=20), np.array([0, 6, 13, 7, 14, 20, 27, 21, 28, 34])
    start = readings(known, SLOW, *passes(OVER, stops))
    moved = stops.copy()
    moved[1] = 5
    _, _, difference = readings_after(known, SLOW, *passes(OVER, moved), start)
    assert 0 < difference.size < 1.2 * start.cell.size  # the old ones and the new ones: all would be twice as many


def test_more_cells_never_raise_the_error():
    short, longer = np.array([0, 3]), np.array([0, 3, 38])
    assert route_error(prior(), OVER, FAST, longer) < route_error(prior(), OVER, FAST, short)


def test_cells_outside_the_area_count_for_nothing():
    allowed = ALL.copy()
    allowed[:14] = False
    known = prior(allowed)
    assert not known.factor[:14].any()
    assert known.size == pytest.approx(np.square(known.factor[14:]).mean(axis=0))


def test_components_below_the_noise_are_left_out():
    values = np.linalg.eigvalsh(covariance())
    assert belief(covariance(), ALL, least=0.3).spread.size - 1 == (values > 0.3).sum() < CELLS


def test_dwelling_helps_a_slow_sensor():
    passing, dwelling = np.array([8, 12, 33, 29]), np.array([8, 12, 12, 33, 33, 29, 29])
    assert route_error(prior(), OVER, SLOW, dwelling) < route_error(prior(), OVER, SLOW, passing)
    assert route_error(prior(), OVER, FAST, passing) < route_error(prior(), OVER, SLOW, passing)


def test_the_compiled_algebra_is_numpy_s():
    rng = np.random.default_rng(3)
    a, b, square = rng.normal(size=(5, 7)), rng.normal(size=(6, 4)), rng.normal(size=(6, 6))
    np.testing.assert_allclose(inner_products(a, a[:3]), a @ a[:3].T)
    np.testing.assert_allclose(solve(square, b), np.linalg.solve(square, b))
    root = inverse_root(square @ square.T)
    np.testing.assert_allclose(root, np.tril(root))
    np.testing.assert_allclose(gram(root), np.linalg.inv(square @ square.T), rtol=1e-6)
