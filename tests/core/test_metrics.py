"""Each figure by hand on small maps, and what must not change it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.core.metrics import centred_relative_error, relative_error, rmse, squared_error

PER_MAP = (squared_error, relative_error, centred_relative_error)
TRUTH = np.array([[1.0, 3.0, 1.0, 3.0], [0.0, 0.0, 0.0, 4.0]])
ESTIMATE = np.array([[2.0, 3.0, 1.0, 3.0], [0.0, 3.0, 0.0, 0.0]])


@st.composite
def pairs(draw):
    """Maps with contrast and estimates of them."""
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    shape = draw(st.integers(1, 5)), draw(st.integers(2, 30))
    truth = rng.random(shape)
    return truth, truth + draw(st.floats(1e-3, 1.0)) * rng.normal(size=shape)


def test_the_figures_of_a_case_done_by_hand():
    np.testing.assert_allclose(squared_error(TRUTH, ESTIMATE), [1, 9 + 16])
    np.testing.assert_allclose(relative_error(TRUTH, ESTIMATE), [1 / np.sqrt(20), 5 / 4])
    # The means are 2 and 1, so |s - mean(s)| is sqrt(4) and sqrt(1 + 1 + 1 + 9).
    np.testing.assert_allclose(centred_relative_error(TRUTH, ESTIMATE), [1 / 2, 5 / np.sqrt(12)])
    assert rmse(TRUTH, ESTIMATE) == pytest.approx(np.sqrt(26 / 8))


@settings(max_examples=40, deadline=None)
@given(pairs())
def test_nothing_but_a_perfect_estimate_is_without_error(pair):
    truth, estimate = pair
    for metric in PER_MAP:
        assert metric(truth, estimate).shape == (len(truth),)
        assert (metric(truth, estimate) > 0).all()
        assert (metric(truth, truth) == 0).all()
    assert rmse(truth, estimate) > 0 == rmse(truth, truth)


@settings(max_examples=40, deadline=None)
@given(pairs())
def test_maps_are_scored_one_by_one_and_in_any_order_of_cells(pair):
    truth, estimate = pair
    cells = np.random.default_rng(0).permutation(truth.shape[1])
    for metric in PER_MAP:
        together = metric(truth, estimate)
        alone = [metric(truth[i : i + 1], estimate[i : i + 1])[0] for i in range(len(truth))]
        np.testing.assert_allclose(together, alone, rtol=1e-12)
        np.testing.assert_allclose(together, metric(truth[:, cells], estimate[:, cells]), rtol=1e-12)


@settings(max_examples=60, deadline=None)
@given(pairs(), st.floats(-100, 100), st.floats(0.01, 100), st.sampled_from([-1, 1]))
def test_the_centred_error_depends_on_neither_zero_nor_size_of_the_unit(pair, shift, size, sign):
    truth, estimate = pair
    moved = [shift + sign * size * one for one in pair]
    before = centred_relative_error(truth, estimate)
    # A shift far larger than the contrast costs digits, and only those.
    digits = 1e-13 * (1 + abs(shift) / size) / truth.std(axis=1).min()
    np.testing.assert_allclose(centred_relative_error(*moved), before, rtol=1e-9, atol=10 * digits)


@settings(max_examples=40, deadline=None)
@given(pairs(), st.floats(0.01, 100))
def test_the_others_follow_the_size_of_the_unit(pair, size):
    truth, estimate = pair
    scaled = truth * size, estimate * size
    np.testing.assert_allclose(squared_error(*scaled), size**2 * squared_error(truth, estimate), rtol=1e-9)
    np.testing.assert_allclose(relative_error(*scaled), relative_error(truth, estimate), rtol=1e-9)
    assert rmse(*scaled) == pytest.approx(size * rmse(truth, estimate), rel=1e-9)
    assert rmse(truth, estimate) ** 2 * truth.size == pytest.approx(squared_error(truth, estimate).sum(), rel=1e-9)


def test_the_relative_error_depends_on_the_zero_of_the_unit():
    assert (relative_error(TRUTH + 10, ESTIMATE + 10) < 0.5 * relative_error(TRUTH, ESTIMATE)).all()


@settings(max_examples=30, deadline=None)
@given(pairs())
def test_knowing_only_the_mean_is_a_centred_error_of_one_and_no_constant_does_better(pair):
    truth, _ = pair
    mean = np.broadcast_to(truth.mean(axis=1, keepdims=True), truth.shape)
    np.testing.assert_allclose(centred_relative_error(truth, mean), 1.0)
    for constant in (0.0, 0.3, 1.0):
        assert (centred_relative_error(truth, np.full(truth.shape, constant)) >= 1.0 - 1e-12).all()


@pytest.mark.parametrize("level", [0.0, 1.0, 0.1, 0.3, 1 / 3, 0.7, 1e15])
def test_a_map_without_contrast_has_no_centred_error(level):
    for cells in (3, 9, 100, 1024):  # the mean of equal values may be a rounding away from them
        flat = np.full((1, cells), level)
        assert np.isnan(centred_relative_error(flat, flat + 0.1)).all()
        assert np.isnan(centred_relative_error(flat, flat)).all()
