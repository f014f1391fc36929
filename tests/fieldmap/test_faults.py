"""Spikes, frozen, saturated and cold sensors are found, and good readings are left alone."""

from __future__ import annotations

import numpy as np
import pytest

from fieldmap.flights import flight, profile
from sparsor.fieldmap.faults import Reason, fit_without_spikes, frozen, sensor_faults
from sparsor.fieldmap.path import path_of


@pytest.mark.parametrize("t90_s", [0.0, 30.0])
def test_spikes_are_found_and_nothing_else(t90_s):
    for seed in range(4):
        samples, _ = flight(seed, t90_s=t90_s, noise=2.0, keep=0.9)
        value = samples.value.copy()
        spiked = np.random.default_rng(seed).choice(value.size, 5, replace=False)
        value[spiked] += 25.0 * np.where(np.arange(5) % 2, 1, -1)
        usable = np.ones(value.size, dtype=bool)
        _, air, spike = fit_without_spikes(path_of(samples), value, usable, t90_s=t90_s, noise_sd=2.0)
        assert set(np.flatnonzero(spike)) == set(spiked)
        assert np.abs(air.reading[spiked] - value[spiked]).min() > 15  # the estimate did not follow them


def test_a_real_step_is_no_spike():
    samples, _ = flight(1, noise=1.0)
    value = samples.value + np.where(np.arange(samples.value.size) > 400, 30.0, 0.0)
    usable = np.ones(value.size, dtype=bool)
    _, _, spike = fit_without_spikes(path_of(samples), value, usable, t90_s=0.0, noise_sd=1.0)
    assert spike.sum() <= 2


def test_readings_without_noise_have_no_spikes():
    samples, air = flight(1, noise=0.0)
    usable = np.ones(air.size, dtype=bool)
    _, _, spike = fit_without_spikes(path_of(samples), air, usable, t90_s=0.0, noise_sd=5.0)
    assert not spike.any()


def test_a_freeze_is_found_but_for_its_first_reading():
    draw = np.random.default_rng(2)
    value = 30 + draw.standard_normal(600)
    value[200:260] = value[200]
    found = frozen(np.arange(600.0), value)
    assert np.array_equal(np.flatnonzero(found), np.arange(201, 260))


def test_a_coarse_sensor_is_not_frozen():
    value = np.round(30 + 0.6 * np.random.default_rng(2).standard_normal(5000))
    assert not frozen(np.arange(5000.0), value).any()


def test_a_sensor_without_noise_is_not_frozen():
    value = np.repeat(np.arange(10.0), 60)  # dwelling in still air
    assert not frozen(np.arange(600.0), value).any()


def test_a_freeze_of_a_coarse_sensor_is_found():
    value = np.round(30 + 2.0 * np.random.default_rng(2).standard_normal(600))
    value[100:160] = value[100]
    assert frozen(np.arange(600.0), value)[105:155].all()


def test_saturation_and_warm_up():
    time_s = np.concatenate((np.arange(100.0), np.arange(50.0)))
    boot = np.repeat([0, 1], [100, 50])
    reading = np.linspace(-10, 200, 150)
    found = sensor_faults(time_s, boot, reading, profile(range=[0.0, 150.0], warm_up_s=20.0))
    warm = ((time_s < 20) | (boot < 0)).astype(bool)
    assert np.array_equal(found == Reason.WARM_UP, warm)
    assert np.array_equal(found == Reason.SATURATED, ~warm & ((reading <= 0) | (reading >= 150)))


def test_few_readings_are_not_judged_by_their_own_noise():
    samples, _ = flight(1)
    few = slice(0, 8)
    usable = np.ones(8, dtype=bool)
    model, _, spike = fit_without_spikes(
        path_of(samples).take(few), samples.value[few], usable, t90_s=0.0, noise_sd=2.0
    )
    assert model.noise_sd == 2.0
    assert not spike.any()
