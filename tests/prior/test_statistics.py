"""Second-order statistics against maps whose statistics are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.errors import ModelError
from sparsor.prior.statistics import Kernel, covariance_factor, fit_kernel, shape_covariance, unit_shapes, variogram

SHAPE = (16, 18)
LAGS = np.arange(1, 9)


def exponential_maps(length, *, variance=1.0, nugget=0.0, count=400, seed=0):
    """Gaussian maps with the covariance ``variance exp(-d / length)``, and a nugget."""
    place = np.stack([axis.ravel() for axis in np.indices(SHAPE)], axis=1).astype(float)
    apart = np.linalg.norm(place[:, None] - place, axis=2)
    root = np.linalg.cholesky(variance * np.exp(-apart / length) + nugget * np.eye(len(place)))
    return np.random.default_rng(seed).normal(size=(count, len(place))) @ root.T


def white_maps(seed, size=0.1, count=100):
    return size * np.random.default_rng(seed).normal(size=(count, SHAPE[0] * SHAPE[1]))


def modelled(kernel, lags=LAGS):
    return kernel.nugget + kernel.variance * (1 - np.exp(-lags / kernel.length_cells))


@pytest.mark.parametrize("length", [1.5, 3.0, 5.0])
def test_the_kernel_of_exponential_maps_is_found_again(length):
    kernel = fit_kernel(exponential_maps(length, variance=0.04), SHAPE)
    assert kernel.length_cells == pytest.approx(length, rel=0.2)
    assert kernel.variance == pytest.approx(0.04, rel=0.15)
    assert kernel.nugget < 0.05 * kernel.variance


@pytest.mark.parametrize("nugget", [0.02, 0.04])
def test_noise_from_cell_to_cell_is_found_as_the_nugget(nugget):
    kernel = fit_kernel(exponential_maps(4.0, variance=0.04, nugget=nugget), SHAPE)
    assert kernel.nugget == pytest.approx(nugget, rel=0.2)
    assert kernel.length_cells == pytest.approx(4.0, rel=0.3)


def test_the_variogram_of_exponential_maps_is_the_kernels():
    measured = variogram(exponential_maps(3.0, variance=2.0), SHAPE, LAGS)
    np.testing.assert_allclose(measured, modelled(Kernel(2.0, 3.0, 0.0)), rtol=0.05)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6))
def test_the_variogram_of_white_noise_is_flat_at_its_variance(seed):
    np.testing.assert_allclose(variogram(white_maps(seed), SHAPE, LAGS), 0.01, rtol=0.05)


@pytest.mark.parametrize("seed", range(12))
def test_the_kernel_of_white_noise_has_its_variogram(seed):
    """Whatever mixture of nugget and short or long kernel is chosen, it says 0.01 at the lags it was fitted to."""
    np.testing.assert_allclose(modelled(fit_kernel(white_maps(seed), SHAPE)), 0.01, rtol=0.1)


def test_the_variogram_of_a_plane_grows_with_the_square_of_the_lag():
    row, column = np.indices(SHAPE)
    plane = (3.0 * row - 2.0 * column + 7.0).reshape(1, -1)
    np.testing.assert_allclose(variogram(plane, SHAPE, LAGS), (9 + 4) * LAGS**2 / 4, rtol=1e-12)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6), st.floats(-5, 5), st.floats(0.01, 50))
def test_the_variogram_forgets_the_level_and_squares_the_size(seed, level, size):
    maps = white_maps(seed, count=6)
    expected = size**2 * variogram(maps, SHAPE, LAGS)
    np.testing.assert_allclose(variogram(level + size * maps, SHAPE, LAGS), expected, rtol=1e-6)
    levels = np.random.default_rng(seed).normal(size=(6, 1))  # each map its own
    np.testing.assert_allclose(variogram(levels + size * maps, SHAPE, LAGS), expected, rtol=1e-6)


def test_the_variogram_does_not_depend_on_which_way_the_maps_lie():
    maps = exponential_maps(3.0, count=5)
    cube = maps.reshape(-1, *SHAPE)
    expected = variogram(maps, SHAPE, LAGS)
    for turned in (cube[:, ::-1], cube[:, :, ::-1], cube.transpose(0, 2, 1)):
        flat = np.ascontiguousarray(turned).reshape(len(maps), -1)
        np.testing.assert_allclose(variogram(flat, turned.shape[1:], LAGS), expected, rtol=1e-12)


@pytest.mark.parametrize("size", [1e-3, 30.0])
@pytest.mark.parametrize(
    "maps", [exponential_maps(3.0, count=40), white_maps(0), white_maps(1)], ids=["exponential", "white-0", "white-1"]
)
def test_the_kernel_scales_with_the_square_of_the_maps(maps, size):
    one, other = fit_kernel(maps, SHAPE), fit_kernel(size * maps, SHAPE)
    assert other.length_cells == pytest.approx(one.length_cells)
    assert other.variance == pytest.approx(size**2 * one.variance, rel=1e-6)
    assert other.nugget == pytest.approx(size**2 * one.nugget, rel=1e-6, abs=1e-12 * size**2)


def test_maps_without_contrast_have_no_kernel():
    with pytest.raises(ModelError, match="the training maps have no contrast"):
        fit_kernel(np.full((5, 288), 0.4), SHAPE)


@pytest.mark.parametrize("shape", [(2, 2), (2, 9), (3, 3), (3, 40)])
def test_the_smallest_grids_have_a_kernel_too(shape):
    maps = np.random.default_rng(0).normal(size=(60, shape[0] * shape[1]))
    kernel = fit_kernel(maps, shape)
    assert kernel.variance + kernel.nugget == pytest.approx(1.0, rel=0.3)


def test_maps_that_repeat_themselves_have_a_kernel_too():
    """A checkerboard does not differ from itself two cells on."""
    board = (np.indices(SHAPE).sum(axis=0) % 2).reshape(1, -1).astype(float)
    kernel = fit_kernel(np.concatenate([board, 1 - board]), SHAPE)
    assert 0 < kernel.variance + kernel.nugget < 1


@pytest.mark.parametrize("wrong", [{"variance": 0.0}, {"length_cells": -1.0}, {"nugget": -0.1}])
def test_a_kernel_outside_its_range_is_refused(wrong):
    with pytest.raises(ModelError, match="is not a kernel: variance and length have to be above 0"):
        Kernel(**{"variance": 1.0, "length_cells": 2.0, "nugget": 0.0} | wrong)


@pytest.mark.parametrize("name", ["variance", "length_cells", "nugget"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_kernel_is_of_finite_numbers(name, value):
    with pytest.raises(ModelError, match="is not a kernel"):
        Kernel(**{"variance": 1.0, "length_cells": 2.0, "nugget": 0.0} | {name: value})


def test_a_kernel_says_its_length_and_nugget_in_words():
    assert Kernel(3.0, 4.26, 1.0).words == "exponential, decay over 4.3 cells, nugget 25.0% of the sill"
    assert "more than 100 cells" in Kernel(3.0, 256.0, 0.0).words


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 20), st.integers(25, 60), st.integers(0, 10**6))
def test_the_factor_gives_a_covariance_of_low_rank_back(rank, count, seed):
    rng = np.random.default_rng(seed)
    maps = rng.normal(size=(count, rank)) @ rng.normal(size=(rank, 72)) + rng.normal(size=72)
    covariance = np.cov(maps, rowvar=False)
    factor = covariance_factor(covariance)
    np.testing.assert_allclose(factor @ factor.T, covariance, atol=1e-10 * np.abs(covariance).max())


def test_of_many_components_the_leading_384_are_kept_largest_first():
    draw = np.random.default_rng(3).normal(size=(600, 400))
    covariance = draw.T @ draw / 600
    factor = covariance_factor(covariance)
    assert factor.shape == (400, 384)
    values = np.linalg.eigvalsh(covariance)[::-1]
    np.testing.assert_allclose(np.square(factor).sum(axis=0), values[:384], rtol=1e-8)
    # No other factor of that size is nearer (Eckart and Young): what is left has the remaining eigenvalues.
    left = covariance - factor @ factor.T
    np.testing.assert_allclose(np.linalg.norm(left), np.linalg.norm(values[384:]), rtol=1e-8)


def test_shapes_know_no_level_and_count_as_much_as_their_spread():
    rng = np.random.default_rng(4)
    maps = exponential_maps(3.0, count=9)
    level, amplitude = rng.normal(size=(9, 1)), rng.uniform(0.1, 9.0, (9, 1))
    spread = amplitude[:, 0] * maps.std(axis=1)
    shapes = unit_shapes(maps)
    expected = np.einsum("k,ki,kj->ij", spread / spread.sum(), shapes, shapes)
    np.testing.assert_allclose(shape_covariance([level + amplitude * maps]), expected, atol=1e-9)
    np.testing.assert_allclose(shape_covariance([7.0 * (level + amplitude * maps)]), expected, atol=1e-9)
    assert np.trace(expected) == pytest.approx(288)
    np.testing.assert_allclose(expected.sum(axis=0), 0.0, atol=1e-9)


def test_the_covariance_of_shapes_adds_up_from_any_parts_and_leaves_flat_maps_out():
    maps = exponential_maps(3.0, count=9)
    parts = shape_covariance(iter([maps[:2], maps[2:3], np.vstack([maps[3:], np.full((2, 288), 7.0)])]))
    np.testing.assert_allclose(parts, shape_covariance([maps]), atol=1e-12)
    with pytest.raises(ModelError, match="no contrast"):
        shape_covariance([np.full((3, 288), 7.0)])
