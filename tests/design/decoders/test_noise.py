"""Noise with a drift that all measurements share, against dense matrices."""

from __future__ import annotations

import numpy as np
import pytest

from sparsor.design.decoders.noise import Noise


@pytest.fixture(params=[0.0, 0.3, 50.0])
def noise(request):
    rng = np.random.default_rng(2)
    return Noise(rng.uniform(0.1, 3.0, 7), request.param * rng.normal(size=7))


def test_whitened_noise_has_variance_1_each_its_own(noise):
    A = noise.whitened(np.eye(7)).T
    np.testing.assert_allclose(A @ noise.covariance @ A.T, np.eye(7), atol=1e-9)
    np.testing.assert_allclose(noise.transposed(np.eye(7)), A, atol=1e-12)


def test_the_drift_to_expect_is_the_conditional_mean(noise):
    values = np.random.default_rng(3).normal(size=(4, 7))
    expected = values @ np.linalg.inv(noise.covariance) @ np.outer(noise.drift, noise.drift)
    np.testing.assert_allclose(noise.drift_in(values), expected, atol=1e-9)
