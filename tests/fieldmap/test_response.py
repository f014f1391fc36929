"""The response of a slow sensor undone: against the Gaussian conditioning it stands for, and by its laws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldmap.flights import flight, shown
from sparsor.fieldmap.path import Path, path_of
from sparsor.fieldmap.response import AirModel, estimate_air, fit_air

TAU_PER_T90 = 1 / math.log(10)


def straight(n, *, step_m=10.0, interval_s=1.0):
    start = np.arange(n) == 0
    return Path(np.arange(n) * interval_s, np.where(start, 0.0, step_m), np.ones(n), start)


def conditioned(model, path, reading, usable):
    """Mean and covariance of the air given the readings, by the textbook, for a straight way."""
    way = np.cumsum(path.step_m)
    apart = model.rate * np.abs(way[:, None] - way[None, :])
    prior = model.spread**2 * (1 + apart) * np.exp(-apart)
    n = way.size
    # What the sensor shows is linear in the air and in what it held at the start.
    to_shown = np.zeros((n, n + 1))
    for i in range(n + 1):
        unit = np.zeros(n)
        if i < n:
            unit[i] = 1.0
        to_shown[:, i] = shown(unit, model.tau_s / TAU_PER_T90) if model.tau_s else unit
    if model.tau_s:
        kept = math.exp(-1.0 / model.tau_s)
        to_shown[:, 0] -= kept ** np.arange(n)  # it does not begin with the air there
        to_shown[:, n] = kept ** np.arange(n)
    everything = np.zeros((n + 1, n + 1))
    everything[:n, :n] = prior
    everything[n, n] = 100.0 * (model.spread**2 + model.noise_sd**2)
    H = to_shown[usable]
    gain = everything @ H.T @ np.linalg.inv(H @ everything @ H.T + model.noise_sd**2 * np.eye(H.shape[0]))
    mean = gain @ (reading[usable] - model.level) + model.level
    return mean[:n], (everything - gain @ H @ everything)[:n, :n]


@pytest.mark.parametrize("tau_s", [0.0, 7.0])
def test_it_is_gaussian_conditioning(tau_s):
    draw = np.random.default_rng(3)
    path = straight(40)
    path.step_m[20:25] = 0.0  # dwelling
    reading = 30 + np.cumsum(draw.standard_normal(40))
    usable = draw.random(40) > 0.2
    model = AirModel(tau_s, 31.0, 6.0, 80.0, 1.5)
    air = estimate_air(model, path, reading, usable)
    mean, covariance = conditioned(model, path, reading, usable)
    np.testing.assert_allclose(air.value, mean, atol=1e-8)
    np.testing.assert_allclose(air.variance, np.diag(covariance), atol=1e-8)
    first, last = np.array([0, 5, 18]), np.array([0, 12, 39])
    blocks = [covariance[a : b + 1, a : b + 1].mean() for a, b in zip(first, last, strict=True)]
    np.testing.assert_allclose(air.mean_variance(first, last), blocks, atol=1e-8)


@pytest.mark.parametrize("t90_s", [10.0, 30.0])
@pytest.mark.parametrize("shape", ["step", "ramp"])
def test_a_step_and_a_ramp_come_back(t90_s, shape):
    n = 240
    path = straight(n)
    air = np.where(np.arange(n) < 120, 20.0, 50.0) if shape == "step" else np.linspace(20.0, 50.0, n)
    reading = shown(air, t90_s) + 0.2 * np.random.default_rng(1).standard_normal(n)
    usable = np.ones(n, dtype=bool)
    model = fit_air(path, reading, usable, t90_s=t90_s)
    found = estimate_air(model, path, reading, usable).value
    settled = np.abs(np.arange(n) - 120) > 15 if shape == "step" else np.ones(n, dtype=bool)
    settled[:5] = settled[-5:] = False
    assert np.abs(found - air)[settled].max() < 3.0
    assert np.sqrt(np.mean((found - air)[settled] ** 2)) < 0.25 * np.sqrt(np.mean((reading - air) ** 2))


def test_a_fast_sensor_without_noise_is_believed():
    path = straight(50)
    reading = 40 + 10 * np.sin(np.arange(50) / 5)
    model = AirModel(0.0, 40.0, 10.0, 200.0, 1e-6)
    air = estimate_air(model, path, reading, np.ones(50, dtype=bool))
    np.testing.assert_allclose(air.value, reading, atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(offset=st.floats(-1e3, 1e3), scale=st.floats(0.01, 100))
def test_another_unit_gives_the_same_air_in_it(offset, scale):
    samples, _ = flight(4, t90_s=20.0)
    path, usable = path_of(samples), np.ones(samples.value.size, dtype=bool)
    model = AirModel(8.7, 40.0, 12.0, 300.0, 2.0)
    other = AirModel(8.7, offset + scale * 40.0, scale * 12.0, 300.0, scale * 2.0)
    one = estimate_air(model, path, samples.value, usable)
    two = estimate_air(other, path, offset + scale * samples.value, usable)
    np.testing.assert_allclose(two.value, offset + scale * one.value, rtol=1e-9, atol=1e-6 * scale)
    np.testing.assert_allclose(two.variance, scale**2 * one.variance, rtol=1e-6)


def test_the_stated_variance_is_the_error():
    """Over flights with drop-outs, the error in stated standard deviations is 1 within a fifth."""
    squares, noises = [], []
    for seed in range(12):
        samples, air = flight(seed, t90_s=20.0, noise=2.0, keep=0.9)
        path, usable = path_of(samples), np.ones(air.size, dtype=bool)
        model = fit_air(path, samples.value, usable, t90_s=20.0)
        found = estimate_air(model, path, samples.value, usable)
        squares.append(np.mean((found.value - air) ** 2 / found.variance))
        noises.append(model.noise_sd)
    assert 0.8 < math.sqrt(np.mean(squares)) < 1.2
    assert np.mean(noises) == pytest.approx(2.0, rel=0.05)


def test_pieces_know_nothing_of_each_other():
    samples, _ = flight(5, t90_s=20.0)
    n = samples.value.size
    path = path_of(samples)
    path.start[n // 2] = True
    usable = np.ones(n, dtype=bool)
    model = AirModel(8.7, 40.0, 12.0, 300.0, 2.0)
    whole = estimate_air(model, path, samples.value, usable)
    second = slice(n // 2, n)
    alone = estimate_air(model, path.take(second), samples.value[second], usable[second])
    np.testing.assert_allclose(whole.value[second], alone.value)
    np.testing.assert_allclose(whole.variance[second], alone.variance)


def test_a_turn_forgets_the_slope():
    """Behind a right angle the slope so far says nothing, so the air there is less certain than straight on."""
    ahead, around = straight(30), straight(30)
    around.turn[20] = 0.0
    usable = np.arange(30) < 20
    model = AirModel(0.0, 0.0, 10.0, 400.0, 0.5)
    reading = np.arange(30.0)
    one, two = (estimate_air(model, path, reading, usable).variance[25] for path in (ahead, around))
    assert two > 1.5 * one


def test_many_samples_in_little_time():
    import time

    n = 100_000
    path = straight(n)
    reading = np.cumsum(np.random.default_rng(0).standard_normal(n))
    usable = np.ones(n, dtype=bool)
    model = AirModel(10.0, 0.0, 100.0, 300.0, 1.0)
    estimate_air(model, path.take(slice(0, 10)), reading[:10], usable[:10])  # compiles
    began = time.process_time()
    estimate_air(model, path, reading, usable)
    assert time.process_time() - began < 5.0  # about 0.6 s on one quiet core
