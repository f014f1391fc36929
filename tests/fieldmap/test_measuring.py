"""From samples to measurements: what is handed on is true, weighted by where the air came from, and complete."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldmap.flights import GRID, field, flight, lines, profile, samples_at
from sparsor.errors import DesignError, LogError
from sparsor.fieldmap.faults import Reason
from sparsor.fieldmap.measuring import measure
from sparsor.fieldmap.observing import interpolation_variance
from sparsor.fieldmap.response import AirModel


def cell_means():
    """The field's mean in every cell, row 0 northmost."""
    fine = (np.arange(32 * 8) + 0.5) / (32 * 8)
    values = field(*np.meshgrid(fine, fine[::-1]))
    return values.reshape(32, 8, 32, 8).mean(axis=(1, 3)).ravel()


@pytest.mark.parametrize("t90_s", [0.0, 20.0, 60.0])
def test_what_is_handed_on_meets_the_truth_within_its_variance(t90_s):
    ratios = []
    for seed in range(6):
        samples, _ = flight(seed, t90_s=t90_s, keep=0.9)
        rows = measure(samples, GRID, profile(t90_s=t90_s)).measurements
        off = rows.values - rows.weights @ cell_means()
        ratios.append(np.mean(off**2 / rows.variance))
    assert 0.8 < np.sqrt(np.mean(ratios)) < 1.2


def test_the_cells_own_air_is_nearer_to_the_truth_than_the_readings():
    samples, air = flight(1, t90_s=40.0)
    found = measure(samples, GRID, profile(t90_s=40.0))
    cell = GRID.cell_at(samples.lon_deg, samples.lat_deg)
    truth, readings = (
        np.bincount(cell, values, GRID.size)[found.cells] / found.counts for values in (air, samples.value)
    )
    assert np.sqrt(np.mean((found.cell_value - truth) ** 2)) < 0.3 * np.sqrt(np.mean((readings - truth) ** 2))
    assert 0.75 < np.sqrt(np.mean((found.cell_value - truth) ** 2 / found.cell_sd**2)) < 1.3


def test_dwelling_in_the_middle_of_a_cell_is_a_row_of_that_cell():
    cells = np.repeat([40, 300, 700], 50)
    lon, lat = GRID.centres_deg(cells)
    samples = replace(samples_at(0.0, 0.0, np.repeat([10.0, 20.0, 30.0], 50)), lon_deg=lon, lat_deg=lat)
    samples.value[:] += np.random.default_rng(0).standard_normal(150)
    found = measure(samples, GRID, profile())
    np.testing.assert_allclose(found.measurements.weights[:, [40, 300, 700]], np.eye(3), atol=1e-6)
    assert found.cells.tolist() == [40, 300, 700]
    assert found.counts.tolist() == [50, 50, 50]
    np.testing.assert_allclose(found.measurements.values, [10, 20, 30], atol=0.6)
    own = found.model.noise_sd**2 / 50 + interpolation_variance(GRID, found.model)
    np.testing.assert_allclose(found.measurements.variance, own)
    assert found.dwelling.sum() > 140


def test_a_place_between_middles_is_known_as_well_as_stated():
    """Against the kernel itself: half-way between two middles, along one side."""
    cell_m = GRID.box.east_m / 32
    model = AirModel(0.0, 0.0, 3.0, 40 * cell_m, 1.0)

    def kernel(apart_m):
        return 9.0 * (1 + model.rate * apart_m) * np.exp(-model.rate * apart_m)

    between = 1.5 * kernel(0.0) + 0.5 * kernel(cell_m) - 2 * kernel(cell_m / 2)
    assert interpolation_variance(GRID, model) == pytest.approx(between, rel=0.1)


def test_a_slow_sensor_holds_the_air_of_cells_behind_it():
    samples, _ = flight(1, t90_s=30.0)
    found = measure(samples, GRID, profile(t90_s=30.0))
    at_once = measure(samples, GRID, profile(), t90_s=0.0)
    largest = [one.measurements.weights.max(axis=1).mean() for one in (found, at_once)]
    assert largest[0] < 0.5 < largest[1]
    np.testing.assert_allclose(found.measurements.weights.sum(axis=1), 1)


@settings(max_examples=10, deadline=None)
@given(offset=st.floats(-100, 100), scale=st.floats(0.1, 10), t90_s=st.sampled_from([0.0, 20.0]))
def test_another_unit_gives_the_same_in_it(offset, scale, t90_s):
    samples, _ = flight(3, t90_s=t90_s)
    one = measure(samples, GRID, profile(t90_s=t90_s))
    two = measure(samples, GRID, profile(t90_s=t90_s), value=offset + scale * samples.value)
    np.testing.assert_allclose(two.measurements.weights, one.measurements.weights)
    expected = offset + scale * one.measurements.values
    np.testing.assert_allclose(
        two.measurements.values, expected, atol=0.02 * scale * np.sqrt(one.measurements.variance.max())
    )
    np.testing.assert_allclose(two.measurements.variance, scale**2 * one.measurements.variance, rtol=0.02)


def test_every_sample_is_accounted_for():
    samples, _ = flight(2, noise=2.0)
    n = samples.value.size
    samples.height_m[:60] = np.linspace(0, 50, 60)
    samples.lon_deg[300:310] -= 1.0
    samples.value[500] += 60
    samples.value[700:760] = samples.value[700]
    value = samples.value.copy()
    value[900:905] = np.nan
    found = measure(samples, GRID, profile(), value=value, altitude_m=50.0)
    assert np.array_equal(found.used, found.reason == Reason.USED)
    assert found.used.sum() + sum(found.left_out.values()) == n
    assert found.counts.sum() == found.used.sum()
    assert found.left_out == {
        Reason.NOT_IN_FLIGHT: (np.abs(samples.height_m - 50) > 10).sum(),
        Reason.OUTSIDE: 10,
        Reason.SPIKE: 1,
        Reason.FROZEN: 59,
        Reason.UNCALIBRATED: 5,
    }
    assert any("65 of" in one and "59 sensor frozen" in one and "1 spike" in one for one in found.warnings)


def test_a_spike_does_not_reach_the_measurements():
    samples, _ = flight(2, t90_s=20.0, keep=0.9)
    clean = measure(samples, GRID, profile(t90_s=20.0)).measurements
    samples.value[400] += 500
    spiked = measure(samples, GRID, profile(t90_s=20.0))
    assert spiked.left_out == {Reason.SPIKE: 1}
    both = np.abs(spiked.measurements.values - clean.values)
    assert both.max() < 2.0


def test_a_partial_flight_lists_the_stops_it_missed():
    samples, _ = flight(2)
    cell = GRID.cell_at(samples.lon_deg, samples.lat_deg)
    stops = np.array([cell[10], cell[100], cell[-1], 5])
    half = replace(
        samples, **{one.name: getattr(samples, one.name)[:300] for one in fields(samples) if one.name in ARRAYS}
    )
    found = measure(half, GRID, profile(), stops=stops)
    assert found.missed.tolist() == [cell[-1], 5]
    assert any("2 planned stop(s) were missed" in warning for warning in found.warnings)


ARRAYS = {"time_s", "lon_deg", "lat_deg", "alt_m", "value", "clock", "boot", "unix_s", "height_m"}


def test_the_passes_of_several_flights_come_together():
    one, _ = flight(1, t90_s=20.0)
    two, _ = flight(2, t90_s=20.0)
    both = {name: np.concatenate((getattr(one, name), getattr(two, name))) for name in ARRAYS}
    both["boot"] = np.repeat([0, 1], [one.value.size, two.value.size])
    found = measure(replace(one, **both), GRID, profile(t90_s=20.0))
    alone = measure(one, GRID, profile(t90_s=20.0))
    assert np.array_equal(found.cells, alone.cells)
    assert np.array_equal(found.counts, 2 * alone.counts)
    assert found.measurements.variance.mean() < 0.7 * alone.measurements.variance.mean()


def test_passes_that_disagree_are_less_certain():
    east, north = lines()
    draw = np.random.default_rng(0)
    calm = field(east, north)
    pair = [calm + 6.0 * level + draw.standard_normal(calm.size) for level in (-1, 1)]
    boot = np.repeat([0, 1], calm.size)
    time_s = np.tile(np.arange(calm.size, dtype=float), 2)
    samples = samples_at(np.tile(east, 2), np.tile(north, 2), np.concatenate(pair), time_s=time_s, boot=boot)
    found = measure(samples, GRID, profile(noise_sd=1.0))
    assert found.scatter_sd == pytest.approx(6.0 * np.sqrt(2), rel=0.25)
    assert np.sqrt(found.measurements.variance).mean() == pytest.approx(6.0, rel=0.25)


def test_what_makes_no_map_says_why():
    samples, _ = flight(1)
    with pytest.raises(LogError, match=r"none of the \d+ samples is of use: \d+ sensor saturated"):
        measure(samples, GRID, profile(range=[1000.0, 2000.0]))
    lon, lat = GRID.centres_deg(np.full(100, 77))
    still = replace(samples_at(0, 0, 20 + np.random.default_rng(0).standard_normal(100)), lon_deg=lon, lat_deg=lat)
    with pytest.raises(DesignError, match=r"found: 1 measurement over 1 cell\."):
        measure(still, GRID, profile())


def test_a_log_shorter_than_the_sensors_answer_says_so():
    east, north = lines()
    with pytest.raises(LogError, match="hold mostly air from before the mission: with a t90 of 600 s its 40 samples"):
        measure(samples_at(east[:40], north[:40], field(east, north)[:40]), GRID, profile(t90_s=600.0))


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_whatever_was_logged_is_measured_or_refused_in_words(data):
    n = data.draw(st.sampled_from([1, 2, 5, 31, 120]))
    draw = np.random.default_rng(data.draw(st.integers(0, 10_000)))
    way = np.cumsum(draw.normal(0, data.draw(st.sampled_from([0.0, 1e-3, 0.05])), (2, n)), axis=1) + 0.5
    value = draw.choice([0.0, 1e6, -3.0]) + data.draw(st.sampled_from([0.0, 1e-9, 1.0, 1e5])) * draw.standard_normal(n)
    time_s = np.cumsum(draw.choice([0.0, 0.1, 1.0, 200.0], n))
    height_m = data.draw(st.sampled_from([50.0, np.nan, 0.0]))
    samples = samples_at(*way, value, time_s=time_s, height_m=height_m)
    one = profile(t90_s=data.draw(st.sampled_from([0.0, 5.0, 60.0])), noise_sd=data.draw(st.sampled_from([0.0, 2.0])))
    try:
        found = measure(samples, GRID, one, altitude_m=50.0)
    except (LogError, DesignError):
        return
    assert np.isfinite(found.cell_value).all()
    assert np.isfinite(found.cell_sd).all()
    assert np.isfinite(found.measurements.values).all()


@pytest.mark.parametrize(("true_s", "said_s", "doubted"), [(0.0, 30.0, True), (30.0, 30.0, False), (0.0, 0.0, False)])
def test_a_response_time_that_the_readings_contradict_is_said(true_s, said_s, doubted):
    warned = []
    for seed in range(3):
        samples, _ = flight(seed, t90_s=true_s, noise=1.0)
        found = measure(samples, GRID, profile(t90_s=said_s, noise_sd=1.0))
        warned.append(any("change faster than a t90 of 30 s lets them" in one for one in found.warnings))
    assert warned == [doubted] * 3


def test_a_louder_sensor_than_stated_is_said():
    samples, _ = flight(1, noise=6.0)
    found = measure(samples, GRID, profile(noise_sd=1.0))
    assert any("noise is 6" in warning or "noise is 5.9" in warning for warning in found.warnings)
