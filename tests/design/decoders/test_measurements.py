from __future__ import annotations

import numpy as np
import pytest

from sparsor.design.decoders import Measurements
from sparsor.errors import DesignError


def cells(*which):
    return np.eye(9)[list(which)]


def test_a_drift_that_fits_no_measurement_is_refused():
    with pytest.raises(DesignError, match="do not fit"):
        Measurements(cells(1, 2), np.ones(2), np.ones(2), np.ones(3))
    with pytest.raises(DesignError, match="the drift's shares hold"):
        Measurements(cells(1, 2), np.ones(2), np.ones(2), np.array([0.0, np.nan]))


@pytest.mark.parametrize(
    ("weights", "values", "variance", "words"),
    [
        (cells(1, 2), [1.0], [0.0, 0.0], "do not fit"),
        (cells(1), [1.0], [0.0], r"at least 2 cells.* found: 1 measurement over 1 cell\."),
        (cells(1, 1), [1.0, 2.0], [0.0, 0.0], r"found: 2 measurements over 1 cell\."),
        (cells(1, 2), [1.0, np.nan], [0.0, 0.0], "the values hold something that is not a number"),
        (cells(1, 2), [1.0, 2.0], [0.0, np.inf], "the variances hold"),
        (cells(1, 2), [1.0, 2.0], [0.0, -2.0], "noise variance is -2"),
        (2 * cells(1, 2), [1.0, 2.0], [0.0, 0.0], r"rows that sum to 2\.\.2"),
        (cells(1, 2) - cells(3, 3) + cells(4, 4), [1.0, 2.0], [0.0, 0.0], "weights from -1"),
    ],
)
def test_what_cannot_be_decoded_is_refused(weights, values, variance, words):
    with pytest.raises(DesignError, match=words):
        Measurements(weights, np.array(values), np.array(variance))


def test_the_order_does_not_depend_on_the_one_they_came_in():
    rng = np.random.default_rng(1)
    weights = np.concatenate([cells(1, 1, 4, 8), rng.dirichlet(np.ones(9), 12)])
    values, variance, drift = rng.normal(size=16), rng.uniform(0, 1, 16), rng.normal(size=16)
    first = Measurements(weights, values, variance, drift).in_order()
    for _ in range(5):
        order = rng.permutation(16)
        other = Measurements(weights[order], values[order], variance[order], drift[order]).in_order()
        np.testing.assert_array_equal(other.weights, first.weights)
        np.testing.assert_array_equal(other.values, first.values)
        np.testing.assert_array_equal(other.variance, first.variance)
        np.testing.assert_array_equal(other.drift_sd, first.drift_sd)
    assert sorted(first.values) == sorted(values)
