"""What flights read, and the study's decoders: against their equations, and blind to the test maps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sparsor.core.metrics import squared_error
from sparsor.design import unit_legs
from sparsor.study.baselines.lawnmower import lawnmower_of
from sparsor.study.decoding import LINEAR, _Seen, decode_lasso, decode_linear, validation_error
from sparsor.study.observing import flown_at, of_cells, readings, task_of

LEGS = unit_legs()
STOPS = lawnmower_of((32, 32), 4)


def test_legs_read_every_cell_flown_over_and_stops_only_themselves():
    legs, stops = (readings(LEGS, STOPS, measured, sd=0.1) for measured in ("legs", "stops"))
    assert legs.rows.shape == (LEGS.cells_under(STOPS).size, 1024)
    assert np.flatnonzero(stops.rows.sum(axis=0)).tolist() == sorted(STOPS.tolist())
    np.testing.assert_allclose(legs.variance, 0.01)


def test_a_slow_sensor_reads_shares_of_cells_behind_it_and_at_no_response_time_the_cells():
    slow = flown_at(LEGS, 9.4)
    made = readings(slow, STOPS, "legs", sd=0.1, t90_s=30.0)
    rows = made.rows.toarray()
    np.testing.assert_allclose(rows.sum(axis=1), 1)
    assert rows.min() >= 0
    assert (np.count_nonzero(rows > 1e-6, axis=1)[1:] > 1).all()
    fast = readings(slow, STOPS, "legs", sd=0.1, t90_s=1e-3).rows.toarray()
    np.testing.assert_allclose(fast.max(axis=1), 1, atol=1e-3)


def test_noise_is_as_stated_and_other_for_validation_and_test():
    made = of_cells(np.arange(1024), 1024, 0.3)
    maps = np.zeros((40, 1024))
    drawn = made.of(maps, "validation")
    assert drawn.std() == pytest.approx(0.3, rel=0.02)
    assert not np.allclose(drawn, made.of(maps, "test"))


def test_decoded_maps_solve_the_equations_of_universal_kriging(case):
    made = readings(LEGS, STOPS, "legs", sd=0.0)
    covariance, other = case.training["shapes"], case.training["maps"]
    values, noise = made.of(case.sets.test, "test"), np.full(made.variance.size, 1e-3)
    decoded = _Seen.of(covariance, made).decode(_Seen.of(other, made), 0.3, noise, values)
    mixed = 0.3 * covariance + 0.7 * other
    towards = np.asarray(made.rows @ mixed)
    count = len(noise)
    system = np.zeros((count + 1, count + 1))
    system[:count, :count] = (made.rows @ towards.T) + np.diag(noise)
    system[count, :count] = system[:count, count] = 1
    weights = np.linalg.solve(system, np.vstack([towards, np.ones(1024)]))[:count]
    np.testing.assert_allclose(weights.sum(axis=0), 1, atol=1e-8)
    np.testing.assert_allclose(decoded, values @ weights, atol=1e-6)


@pytest.mark.parametrize("decoder", LINEAR)
def test_test_maps_decide_nothing(case, decoder):
    made = readings(LEGS, STOPS, "legs", sd=0.01)
    part = replace(case, sets=replace(case.sets, test=case.sets.test[:3]))
    np.testing.assert_allclose(
        decode_linear(case, made, decoder)[:1], decode_linear(part, made, decoder)[:1], atol=0.05
    )
    assert validation_error(case, made, decoder) == validation_error(part, made, decoder)


def test_the_blend_is_on_validation_maps_no_worse_than_its_parts(case):
    made = readings(LEGS, STOPS, "legs", sd=0.01)
    blend, *parts = (validation_error(case, made, name) for name in ("blend", "kriging", "mmse"))
    assert blend <= min(parts) * 1.02  # one setting is chosen at a time


def test_the_lasso_decodes_sums_and_single_cells_better_than_the_mean_map(case):
    psi = case.dictionary(24, 0)
    cells = LEGS.cells_under(STOPS)
    phi = np.random.default_rng(0).random((20, cells.size)) < 0.1
    made = of_cells(cells, 1024, 0.0)
    mean_map = squared_error(case.sets.test, np.broadcast_to(case.mean, case.sets.test.shape)).mean()
    for sums in (None, phi):
        assert squared_error(case.sets.test, decode_lasso(case, made, psi, sums=sums)).mean() < mean_map


def test_the_search_is_given_the_noise_in_the_unit_of_the_maps_spread(case):
    task = task_of(case, LEGS, 50.0, sd=0.1, t90_s=23.0)
    assert task.sensor.noise == pytest.approx(0.01 / case.typical_variance, rel=1e-2)
    assert task.sensor.tau_s == pytest.approx(10, rel=0.01)
