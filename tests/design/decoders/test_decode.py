"""Laws that hold for every decoder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from design.conftest import SHAPE
from sparsor.core.metrics import centred_relative_error
from sparsor.design.decoders import Measurements, decode, decode_each
from sparsor.design.decoders.decode import CHOICES
from sparsor.design.decoders.fine import upsampled
from sparsor.errors import DesignError

N = SHAPE[0] * SHAPE[1]
ALL = (*CHOICES, "lasso-sums")


def measured(truth, cells, noise_sd=0.0, seed=0):
    noise = noise_sd * np.random.default_rng(seed).standard_normal(len(cells))
    return Measurements(np.eye(N)[cells], truth[cells] + noise, np.full(len(cells), noise_sd**2))


@pytest.fixture(scope="module")
def cells():
    return np.random.default_rng(4).choice(N, 30, replace=False)


@pytest.fixture(scope="module")
def phi():
    return np.random.default_rng(5).random((16, N)) < 0.1


@pytest.fixture(scope="module")
def ppb(fresh):
    return 20 + 60 * fresh[0]


@pytest.mark.parametrize("decoder", ALL)
@pytest.mark.parametrize(("offset", "gain"), [(-300.0, 0.01), (5.0, 1000.0)])
def test_another_unit_gives_the_same_map_in_that_unit(model, ppb, cells, phi, decoder, offset, gain):
    one = measured(ppb, cells, 2.0)
    other = Measurements(one.weights, offset + gain * one.values, gain**2 * one.variance)
    first = decode(one, model, decoder, phi=phi)
    second = decode(other, model, decoder, phi=phi)
    spread = np.ptp(ppb)
    np.testing.assert_allclose((second.values - offset) / gain, first.values, atol=1e-6 * spread)
    np.testing.assert_allclose(second.standard_deviation / gain, first.standard_deviation, rtol=1e-6)
    assert second.expected_relative_error == pytest.approx(first.expected_relative_error, rel=1e-6)
    assert second.amplitude / gain == pytest.approx(first.amplitude, rel=1e-6)


@pytest.mark.parametrize("decoder", ["auto", *ALL])
def test_the_order_of_measurements_does_not_matter(model, ppb, cells, phi, decoder):
    one = measured(ppb, cells, 2.0)
    order = np.random.default_rng(6).permutation(one.count)
    other = Measurements(one.weights[order], one.values[order], one.variance[order])
    first, second = (decode(it, model, decoder, phi=phi) for it in (one, other))
    np.testing.assert_array_equal(second.values, first.values)
    np.testing.assert_array_equal(second.standard_deviation, first.standard_deviation)


@pytest.mark.parametrize("decoder", ["kriging", "mmse", "blend"])
def test_every_cell_measured_without_noise_is_the_map_itself(model, ppb, decoder):
    decoded = decode(measured(ppb, np.arange(N)), model, decoder)
    np.testing.assert_allclose(decoded.values, ppb, atol=2e-3 * np.ptp(ppb))
    assert decoded.standard_deviation.max() < 0.01 * np.ptp(ppb)


def test_the_lasso_comes_as_near_as_its_dictionary_can(model, fresh):
    each = [decode(measured(one, np.arange(N)), model, "lasso") for one in fresh[:5]]
    errors = centred_relative_error(fresh[:5], np.array([one.values for one in each]))
    assert errors.max() < 0.2


@pytest.mark.parametrize("decoder", CHOICES)
@pytest.mark.parametrize("count", [2, 3])
def test_few_measurements_give_a_wide_uncertainty(model, ppb, cells, decoder, count):
    few = decode(measured(ppb, cells[:count], 1.0), model, decoder)
    many = decode(measured(ppb, cells, 1.0), model, decoder)
    assert np.isfinite(few.values).all()
    assert few.standard_deviation.mean() > 1.2 * many.standard_deviation.mean()
    assert few.expected_relative_error > many.expected_relative_error


@pytest.mark.parametrize("decoder", CHOICES)
@pytest.mark.parametrize("noise_sd", [0.0, 2.0])
def test_equal_values_give_a_flat_map(model, cells, decoder, noise_sd):
    flat = Measurements(np.eye(N)[cells], np.full(30, 41.0), np.full(30, noise_sd**2))
    decoded = decode(flat, model, decoder)
    np.testing.assert_allclose(decoded.values, 41.0, atol=1e-6)
    assert (decoded.standard_deviation <= 4 * max(noise_sd, 1e-3)).all()
    assert np.isfinite(decoded.standard_deviation).all()


@pytest.mark.parametrize("noise_sd", [0.0, 6.0])
def test_the_uncertainty_holds_on_maps_that_were_never_seen(model, fresh, cells, noise_sd):
    covered, expected, realised = ({name: [] for name in CHOICES} for _ in range(3))
    for number, one in enumerate(fresh[:14]):
        truth = 20 + 60 * one
        for name, decoded in decode_each(measured(truth, cells, noise_sd, number), model).items():
            covered[name].append(np.mean(np.abs(truth - decoded.values) <= 1.96 * decoded.standard_deviation))
            expected[name].append(decoded.expected_relative_error)
            realised[name].append(centred_relative_error(truth[None], decoded.values[None])[0])
    for name in CHOICES:
        assert 0.90 < np.mean(covered[name]) < 0.99, name
        error = np.std(realised[name]) / np.sqrt(len(realised[name]))
        assert abs(np.mean(expected[name]) - np.mean(realised[name])) < 3 * error, name


def test_a_drift_that_is_stated_does_not_break_the_uncertainty(model, fresh, cells):
    rng = np.random.default_rng(8)
    drift = np.linspace(0, 25, cells.size)
    covered, errors, ignored = ({name: [] for name in CHOICES} for _ in range(3))
    for number, one in enumerate(fresh[:14]):
        truth = 20 + 60 * one
        steady = measured(truth, cells, 2.0, number)
        values = steady.values + drift * rng.standard_normal()
        stated = decode_each(Measurements(steady.weights, values, steady.variance, drift), model)
        unstated = decode_each(replace(steady, values=values), model)
        for name, decoded in stated.items():
            covered[name].append(np.mean(np.abs(truth - decoded.values) <= 1.96 * decoded.standard_deviation))
            errors[name].append(centred_relative_error(truth[None], decoded.values[None])[0])
            ignored[name].append(centred_relative_error(truth[None], unstated[name].values[None])[0])
    for name in CHOICES:
        assert 0.88 < np.mean(covered[name]) < 0.995, name
        assert np.mean(errors[name]) < 0.9 * np.mean(ignored[name]), name


def test_auto_takes_the_decoder_with_the_lowest_score(model, ppb, cells):
    one = measured(ppb, cells, 1.0)
    decoded = decode(one, model)
    assert set(decoded.scores) == set(CHOICES)
    assert decoded.scores[decoded.decoder] == min(decoded.scores.values()) == decoded.expected_relative_error
    alone = decode(one, model, decoded.decoder)
    np.testing.assert_array_equal(alone.values, decoded.values)
    np.testing.assert_array_equal(alone.standard_deviation, decoded.standard_deviation)


def test_cells_outside_the_area_do_not_count(model, ppb, cells):
    allowed = np.zeros(SHAPE, dtype=bool)
    allowed[:, :6] = True
    inside = cells[allowed.ravel()[cells]]
    outside = replace(model, validation=np.where(allowed.ravel(), model.validation, 5.0))
    for name in ("kriging", "lasso"):  # the others' covariance is learned from whole maps
        first = decode(measured(ppb, inside, 1.0), model, name, allowed=allowed.ravel())
        second = decode(measured(ppb, inside, 1.0), outside, name, allowed=allowed.ravel())
        assert second.expected_relative_error == pytest.approx(first.expected_relative_error, rel=1e-9)
        assert second.recalibration == pytest.approx(first.recalibration, rel=1e-9)


def test_readings_at_points_are_trusted_less_than_cell_means(model, ppb, cells):
    one = measured(ppb, cells)
    means, points = (decode(one, model, "kriging", within_cell=share) for share in (0.0, 1.0))
    at = cells[np.argmax(np.abs(ppb[cells] - ppb.mean()))]
    assert abs(means.values[at] - ppb[at]) < abs(points.values[at] - ppb[at])
    assert points.standard_deviation[cells].mean() > 5 * means.standard_deviation[cells].mean()


def test_widening_widens(model, ppb, cells):
    one, wide = (decode(measured(ppb, cells), model, "mmse", widening=factor) for factor in (1.0, 1.5))
    np.testing.assert_allclose(wide.standard_deviation, 1.5 * one.standard_deviation)
    assert wide.expected_relative_error == pytest.approx(1.5 * one.expected_relative_error)


@pytest.mark.parametrize("decoder", ["kriging", "blend", "mmse"])
def test_a_finer_map_goes_through_the_cells(model, ppb, cells, decoder):
    decoded = decode(measured(ppb, cells, 1.0), model, decoder, finer=3)
    fine = decoded.finer.reshape(3 * SHAPE[0], 3 * SHAPE[1])
    np.testing.assert_allclose(fine[1::3, 1::3].ravel(), decoded.values, atol=1e-6 * np.ptp(ppb))


def test_kriging_between_cells_is_not_interpolation(model, ppb, cells):
    decoded = decode(measured(ppb, cells, 1.0), model, "kriging", finer=2)
    plain = upsampled(decoded.values, SHAPE, 2)
    assert 1e-3 * np.ptp(ppb) < np.abs(decoded.finer - plain).max() < 0.5 * np.ptp(ppb)


def test_bilinear_interpolation_keeps_planes():
    row, column = np.indices(SHAPE)
    fine_row, fine_column = ((np.indices((4 * SHAPE[0], 4 * SHAPE[1])) + 0.5) / 4) - 0.5
    fine = upsampled((2.0 * row - 3.0 * column).ravel(), SHAPE, 4)
    np.testing.assert_allclose(fine, (2.0 * fine_row - 3.0 * fine_column).ravel(), atol=1e-9)


def test_the_lasso_knows_cells_only(model, ppb, cells):
    assert decode(measured(ppb, cells), model, "lasso", finer=2).finer is None


def test_sums_with_one_cell_a_row_are_the_single_cells(model, ppb, cells):
    one = measured(ppb, cells, 1.0)
    single = np.eye(N, dtype=bool)[one.in_order().cells]
    sums = decode(one, model, "lasso-sums", phi=single)
    plain = decode(one, model, "lasso")
    np.testing.assert_allclose(sums.values, plain.values, atol=1e-6 * np.ptp(ppb))


def test_a_missed_cell_leaves_the_sums(model, ppb, cells, phi):
    one = measured(ppb, cells, 1.0)
    without = phi.copy()
    without[:, np.setdiff1d(np.arange(N), cells)] = False
    first, second = (decode(one, model, "lasso-sums", phi=it) for it in (phi, without))
    np.testing.assert_array_equal(first.values, second.values)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"decoder": "cubic"}, "decoder 'cubic'; known are auto, lasso"),
        ({"decoder": "lasso-sums"}, "give it, or take lasso"),
        ({"decoder": "lasso-sums", "phi": np.zeros((4, N), dtype=bool)}, r"0 row\(s\) of Phi hold a measured cell"),
        ({"decoder": "lasso-sums", "phi": np.ones((4, 9), dtype=bool)}, "Phi has 9 columns"),
        ({"within_cell": 2.0}, "within_cell is 2"),
        ({"widening": 0.5}, "widening is 0.5"),
        ({"finer": 0}, "finer is 0"),
        ({"allowed": np.zeros(N, dtype=bool)}, "allowed marks 0"),
    ],
)
def test_options_out_of_range_are_refused(model, ppb, cells, options, words):
    with pytest.raises(DesignError, match=words):
        decode(measured(ppb, cells), model, **options)


def test_another_grid_is_refused(model):
    with pytest.raises(DesignError, match="weigh 9 cells, the model's grid has 120"):
        decode(Measurements(np.eye(9)[:3], np.ones(3), np.ones(3)), model)


def test_validation_maps_without_contrast_inside_the_area_are_refused(model, ppb, cells):
    flat = replace(model, validation=np.zeros_like(model.validation))
    with pytest.raises(DesignError, match="no contrast inside the area"):
        decode(measured(ppb, cells), flat, "kriging")
