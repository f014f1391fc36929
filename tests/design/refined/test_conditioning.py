"""Readings in two flights say what the same readings in one flight say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.design import Budget, unit_legs
from sparsor.design.decoders.covariance import contrasts, kernel_covariance
from sparsor.design.decoders.noise import Noise
from sparsor.design.refined import Sensor, Task, refine
from sparsor.design.refined.annealing import route_error
from sparsor.design.refined.conditioning import conditioned
from sparsor.design.refined.flyover import flyover
from sparsor.design.refined.posterior import LEVEL_VARIANCE, belief
from sparsor.prior.statistics import Kernel

SHAPE = (6, 7)
CELLS = SHAPE[0] * SHAPE[1]
LEGS = unit_legs(SHAPE)
ALL = np.ones(CELLS, dtype=bool)
COVARIANCE = kernel_covariance(SHAPE, Kernel(1.0, 4.0, 0.0), ALL)
FIRST, SECOND = np.array([8, 12, 33]), np.array([40, 36, 15, 1])


def task(sensor=Sensor(0.01, 0.02, 1.7), limit=12.0):  # noqa: B008 (a tuple)
    return Task(COVARIANCE, LEGS, Budget(limit, "distance"), sensor)


def noise(variance, drift=0.0):
    return Noise(variance, np.broadcast_to(drift, variance.shape).astype(float))


@pytest.mark.parametrize("sensor", [Sensor(0.01, 0.02), Sensor(0.01, 0.02, 1.7)])
def test_two_flights_leave_what_one_of_all_their_readings_leaves(sensor):
    one = task(sensor)
    (rows, variance), (more, of_more) = one.readings(FIRST), one.readings(SECOND)
    after = one.after(rows, noise(variance))
    assert after.level_variance == 0
    known = belief(after.covariance, ALL, rank=CELLS, level_variance=0.0)
    together = conditioned(
        COVARIANCE, LEVEL_VARIANCE, np.vstack((rows, more)), noise(np.concatenate((variance, of_more)))
    )
    found = route_error(known, flyover(LEGS), sensor, SECOND)
    assert found == pytest.approx(together.trace() / CELLS, rel=1e-3)
    # What was measured first counts: without it the second flight alone leaves far more.
    assert found < 0.8 * route_error(belief(COVARIANCE, ALL, rank=CELLS), flyover(LEGS), sensor, SECOND)


@pytest.mark.parametrize("sensor", [Sensor(0.01, 0.02), Sensor(0.01, 0.02, 1.7)])
def test_a_sensor_whose_zero_moved_in_between_is_a_drift_of_the_second_flight_alone(sensor):
    one = task(sensor)
    (rows, variance), (more, of_more) = one.readings(FIRST), one.readings(SECOND)
    after = one.after(rows, noise(variance), zero_variance=0.7)
    drift = np.sqrt(0.7) * np.repeat([0.0, 1.0], [len(rows), len(more)])
    together = conditioned(
        COVARIANCE, LEVEL_VARIANCE, np.vstack((rows, more)), Noise(np.concatenate((variance, of_more)), drift)
    )
    known = belief(after.covariance, ALL, rank=CELLS, level_variance=0.0, zero_variance=0.7)
    found = route_error(known, flyover(LEGS), sensor, SECOND)
    assert found == pytest.approx(together.trace() / CELLS, rel=1e-3)
    steady = belief(after.covariance, ALL, rank=CELLS, level_variance=0.0)
    assert found > 1.05 * route_error(steady, flyover(LEGS), sensor, SECOND)


@pytest.mark.parametrize("sensor", [Sensor(0.01, 0.02), Sensor(0.01, 0.02, 1.7)])
def test_the_ways_from_and_to_home_are_measured_and_cost_nothing_of_a_distance(sensor):
    one, home = task(sensor), 24
    rows, variance = one.readings(FIRST)
    after = one.after(rows, noise(variance), home=home)
    way = np.concatenate(([home], SECOND, [home]))
    for found, wanted in zip(after.readings(SECOND), one.readings(way), strict=True):
        np.testing.assert_array_equal(found, wanted)
    for found, wanted in zip(after.readings(way), one.readings(way), strict=True):  # no dwell at home
        np.testing.assert_array_equal(found, wanted)
    barred = np.zeros((CELLS, CELLS), dtype=bool)
    barred[home, SECOND[-1]] = barred[SECOND[-1], home] = True
    shut = Task(COVARIANCE, one.legs.kept_inside(barred), one.budget, sensor, home=home)
    np.testing.assert_array_equal(shut.readings(SECOND)[0], one.readings(way[:-1])[0])  # it leads round something
    route = refine(after, seed=0, iterations=200)
    assert route.used == pytest.approx(LEGS.path_length(route.stops))


@settings(max_examples=30, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 60),
    st.floats(-6, 3).map(lambda power: 10.0**power),
    st.floats(0, 10),
)
def test_it_is_a_covariance_that_no_reading_makes_larger(seed, count, scale, drift):
    draw = np.random.default_rng(seed)
    shapes = draw.standard_normal((5, CELLS))
    covariance = contrasts(shapes.T @ shapes, ALL)  # of low rank: most directions have no variance to lose
    rows = draw.dirichlet(np.full(CELLS, 0.1), count)
    found = conditioned(covariance, LEVEL_VARIANCE, rows, noise(scale * draw.uniform(0.1, 10, count), drift))
    assert np.array_equal(found, found.T)
    rounding = 1e-9 * LEVEL_VARIANCE
    assert np.linalg.eigvalsh(found).min() > -rounding
    assert np.linalg.eigvalsh(covariance + LEVEL_VARIANCE - found).min() > -rounding


def test_a_drift_leaves_the_level_open_and_the_contrasts_known():
    rows, variance = np.eye(CELLS), np.full(CELLS, 1e-4)
    sharp = conditioned(COVARIANCE, LEVEL_VARIANCE, rows, noise(variance))
    drifted = conditioned(COVARIANCE, LEVEL_VARIANCE, rows, noise(variance, 2.0))
    assert sharp.mean() < 1e-4
    assert drifted.mean() == pytest.approx(1 / (1 / 2.0**2 + 1 / (COVARIANCE.mean() + LEVEL_VARIANCE)), rel=1e-2)
    centre = np.eye(CELLS) - 1 / CELLS
    assert np.trace(centre @ drifted @ centre) == pytest.approx(np.trace(centre @ sharp @ centre), rel=1e-6)


def test_the_search_goes_where_nothing_is_known_yet():
    one = task(Sensor(1e-3))
    west = np.flatnonzero(np.arange(CELLS) % SHAPE[1] < 4)
    after = one.after(np.eye(CELLS)[west], noise(np.full(west.size, 1e-3)))
    route = refine(after, seed=0, iterations=400)
    over = LEGS.cells_under(route.stops)
    assert route.used <= 12.0
    assert (over % SHAPE[1] >= 4).mean() > 0.8
    assert route.expected_error < after.covariance.trace() / CELLS


def test_where_everything_is_known_there_is_a_route_still():
    one = task(Sensor(1e-3, 1.0))
    after = one.after(np.eye(CELLS), noise(np.full(CELLS, 1e-9)))
    assert refine(after, seed=0, iterations=40).used <= 12.0
