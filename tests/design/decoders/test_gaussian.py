"""The linear system against textbook formulas written out with dense matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.stats import multivariate_normal

from design.conftest import SHAPE
from sparsor.design.decoders import Measurements
from sparsor.design.decoders.covariance import unit_kernel
from sparsor.design.decoders.gaussian import System
from sparsor.design.decoders.linear import kriging
from sparsor.design.decoders.setting import Setting
from sparsor.prior.statistics import Kernel


@pytest.fixture
def case():
    """Covariance, weights and noise of a small grid with cells measured twice and rows over several cells."""
    rng = np.random.default_rng(3)
    place = np.stack(np.divmod(np.arange(30), 6))
    distance = np.hypot(*(place[:, :, None] - place[:, None, :]))
    C = np.exp(-distance / 3.0)
    H = np.eye(30)[[0, 4, 4, 9, 17, 22, 29, 0]]
    H[-1] = rng.dirichlet(np.ones(30))
    noise = rng.uniform(0.01, 0.3, len(H))
    values = rng.multivariate_normal(7 * np.ones(len(H)), 4 * H @ C @ H.T + np.diag(noise), size=3)
    return C, H, noise, values


def given_amplitude(C, H, noise, y, tau):
    """Mean and variance of f = a + g by conditioning one joint Gaussian, with a flat prior on a as its limit."""
    vague = 1e5  # larger ones cost more digits than they gain
    prior = tau**2 * C + vague
    V = H @ prior @ H.T + np.diag(noise)
    gain = prior @ H.T @ np.linalg.inv(V)
    return gain @ y, np.diag(prior - gain @ H @ prior)


def universal_kriging(C, H, noise, y, tau):
    """Kriging weights from the textbook's bordered system; `noise` is variances or a covariance."""
    m = len(H)
    system = np.zeros((m + 1, m + 1))
    system[:m, :m] = tau**2 * H @ C @ H.T + (np.diag(noise) if noise.ndim == 1 else noise)
    system[m, :m] = system[:m, m] = 1
    right = np.vstack([tau**2 * H @ C, np.ones(len(C))])
    solved = np.linalg.solve(system, right)
    return solved[:m].T @ y, tau**2 * np.diag(C) - (solved * right).sum(axis=0)


def restricted_likelihood(C, H, noise, y, tau):
    """The density of contrasts of y, which do not depend on the level."""
    V = tau**2 * H @ C @ H.T + np.diag(noise)
    contrasts = np.linalg.qr(np.column_stack([np.ones(len(y)), np.eye(len(y))[:, :-1]]))[0][:, 1:].T
    return multivariate_normal.logpdf(contrasts @ y, cov=contrasts @ V @ contrasts.T)


def fixed(monkeypatch, tau):
    """Let the system know tau."""
    known = np.array([[tau]])
    monkeypatch.setattr(
        System, "_amplitudes", lambda _self, values, _scale: (known.repeat(len(values), 0), np.ones((len(values), 1)))
    )


def test_given_the_amplitude_it_is_universal_kriging(case, monkeypatch):
    C, H, noise, values = case
    fixed(monkeypatch, 1.7)
    found = System(C, H, noise).posterior(values)
    for y, mean, variance in zip(values, found.mean, found.variance, strict=True):
        expected, expected_variance = universal_kriging(C, H, noise, y, 1.7)
        np.testing.assert_allclose(mean, expected, rtol=1e-9)
        np.testing.assert_allclose(variance, expected_variance, rtol=1e-8)


def test_given_the_amplitude_it_is_a_conditional_gaussian_with_a_vague_level(case, monkeypatch):
    C, H, noise, values = case
    fixed(monkeypatch, 2.0)
    found = System(C, H, noise).posterior(values)
    for y, mean, variance in zip(values, found.mean, found.variance, strict=True):
        expected, expected_variance = given_amplitude(C, H, noise, y, 2.0)
        np.testing.assert_allclose(mean, expected, atol=1e-3)
        np.testing.assert_allclose(variance, expected_variance, atol=1e-3)


def test_the_level_is_generalised_least_squares(case, monkeypatch):
    C, H, noise, values = case
    fixed(monkeypatch, 0.8)
    inverse = np.linalg.inv(0.8**2 * H @ C @ H.T + np.diag(noise))
    expected = values @ inverse.sum(axis=1) / inverse.sum()
    np.testing.assert_allclose(System(C, H, noise).posterior(values).level, expected, rtol=1e-10)


def test_the_nugget_is_noise_that_grows_with_the_amplitude(case, monkeypatch):
    C, H, noise, values = case
    fixed(monkeypatch, 3.0)
    nugget = np.linspace(0, 0.2, len(H))
    found, expected = System(C, H, noise, nugget).posterior(values), System(C, H, noise + 9 * nugget).posterior(values)
    np.testing.assert_allclose(found.mean, expected.mean, rtol=1e-9)
    np.testing.assert_allclose(found.variance, expected.variance, rtol=1e-9)


def test_a_drift_is_noise_that_all_readings_share(case, monkeypatch):
    C, H, noise, values = case
    fixed(monkeypatch, 1.3)
    drift = np.linspace(0, 2, len(H))
    found = System(C, H, noise, drift=drift).posterior(values)
    for y, mean, variance in zip(values, found.mean, found.variance, strict=True):
        expected, expected_variance = universal_kriging(C, H, np.diag(noise) + np.outer(drift, drift), y, 1.3)
        np.testing.assert_allclose(mean, expected, rtol=1e-9)
        np.testing.assert_allclose(variance, expected_variance, rtol=1e-8)
    np.testing.assert_allclose(found.mean, found.level[:, None] + found.pull @ H @ C, rtol=1e-9)


def test_the_likelihood_of_the_amplitude_is_that_of_contrasts(case):
    C, H, noise, values = case
    system, tau = System(C, H, noise), np.geomspace(0.1, 10, 9)
    rotated = (values / np.sqrt(noise)) @ system._axes
    found = system.log_likelihood(rotated, tau[None])
    for y, row in zip(values, found, strict=True):
        expected = np.array([restricted_likelihood(C, H, noise, y, one) for one in tau])
        np.testing.assert_allclose(row - row[0], expected - expected[0], atol=1e-8)


def test_the_amplitude_is_integrated_out(case):
    C, H, noise, values = case
    found = System(C, H, noise).posterior(values)
    for number, y in enumerate(values):
        tau = y.std() * np.geomspace(1e-2, 1e2, 1500)
        height = np.array([restricted_likelihood(C, H, noise, y, one) for one in tau])
        density = np.exp(height - height.max())
        density /= trapezoid(density, np.log(tau))
        parts = [universal_kriging(C, H, noise, y, one) for one in tau]
        means, variances = (np.array(part) for part in zip(*parts, strict=True))
        mean = trapezoid(density[:, None] * means, np.log(tau), axis=0)
        second = trapezoid(density[:, None] * (variances + means**2), np.log(tau), axis=0)
        np.testing.assert_allclose(found.mean[number], mean, atol=0.01 * y.std())
        # Eight readings leave a long tail of large amplitudes; it is cut where the density is below e^-12.5.
        np.testing.assert_allclose(found.variance[number], second - mean**2, rtol=0.05)


def test_maps_drawn_from_the_prior_lie_within_the_stated_uncertainty(case):
    C, H, noise, _ = case
    rng = np.random.default_rng(9)
    maps = 50 + 3 * rng.multivariate_normal(np.zeros(len(C)), C, size=400)
    values = maps @ H.T + np.sqrt(noise) * rng.standard_normal((len(maps), len(H)))
    found = System(C, H, noise).posterior(values)
    covered = np.mean(np.abs(maps - found.mean) <= 1.96 * np.sqrt(found.variance))
    assert 0.93 < covered < 0.98


def test_what_is_pulled_gives_the_mean(case):
    C, H, noise, values = case
    found = System(C, H, noise).posterior(values)
    np.testing.assert_allclose(found.mean, found.level[:, None] + found.pull @ H @ C, rtol=1e-9)
    np.testing.assert_allclose(found.pull.sum(axis=1), 0, atol=1e-9)


def test_a_finer_map_is_kriging_at_the_finer_places(model, fresh, monkeypatch):
    fixed(monkeypatch, 5.0)
    N, cells = SHAPE[0] * SHAPE[1], np.arange(3, SHAPE[0] * SHAPE[1], 7)
    measured = Measurements(np.eye(N)[cells], 60 * fresh[0][cells], np.full(cells.size, 4.0))
    plain = replace(model, kernel=Kernel(1.0, 4.0, 0.0))
    setting = Setting(plain, measured, np.ones(N, dtype=bool), np.zeros(cells.size), 0)
    decoder = kriging(setting)
    fine = decoder.finer(decoder.decode(measured.values[None]), 2)
    centres = [np.indices(SHAPE), (np.indices((2 * SHAPE[0], 2 * SHAPE[1])) + 0.5) / 2 - 0.5]
    place = np.concatenate([part.reshape(2, -1) for part in centres], axis=1)
    unit = unit_kernel(plain.kernel, SHAPE, setting.allowed)
    C = unit.variance * np.exp(-np.hypot(*(place[:, :, None] - place[:, None, :])) / 4.0)
    expected, _ = universal_kriging(C, np.eye(place.shape[1])[cells], measured.variance, measured.values, 5.0)
    np.testing.assert_allclose(fine, expected[N:], rtol=1e-8)
