from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from design.conftest import SHAPE
from sparsor.design.decoders.blend import LENGTHS_CELLS, MIXES, choose_blend
from sparsor.design.decoders.covariance import (
    contrast_variance,
    kernel_covariance,
    training_covariance,
    unit_kernel,
    unit_shapes,
    within_cell_variance,
)
from sparsor.design.decoders.linear import LinearDecoder, kriging, mmse
from sparsor.design.decoders.measurements import Measurements
from sparsor.design.decoders.rehearsal import rehearse
from sparsor.design.decoders.setting import Setting
from sparsor.prior.statistics import Kernel

N = SHAPE[0] * SHAPE[1]
EVERYWHERE = np.ones(N, dtype=bool)
HALF = np.arange(N) % SHAPE[1] < SHAPE[1] // 2


@pytest.mark.parametrize("allowed", [EVERYWHERE, HALF])
def test_covariances_are_of_contrasts_with_unit_variance(model, allowed):
    for C in (training_covariance(model, allowed), kernel_covariance(SHAPE, Kernel(3.0, 5.0, 0.2), allowed)):
        np.testing.assert_allclose(C, C.T, atol=1e-12)
        assert C.diagonal()[allowed].mean() == pytest.approx(1)
        np.testing.assert_allclose(C[:, allowed].sum(axis=1), 0, atol=1e-8)
        assert np.linalg.eigvalsh(C).min() > -1e-9


def test_the_training_covariance_knows_no_direction(model):
    C = training_covariance(model, EVERYWHERE).reshape(*SHAPE, *SHAPE)
    np.testing.assert_allclose(C, C[::-1, :, ::-1, :], atol=1e-12)
    np.testing.assert_allclose(C, C[:, ::-1, :, ::-1], atol=1e-12)


def test_a_unit_kernel_draws_maps_of_unit_variance():
    unit = unit_kernel(Kernel(7.0, 4.0, 1.0), SHAPE, EVERYWHERE)
    place = np.indices(SHAPE).reshape(2, -1)
    distance = np.hypot(*(place[:, :, None] - place[:, None, :]))
    raw = unit.variance * np.exp(-distance / 4.0) + unit.nugget * np.eye(N)
    assert contrast_variance(raw, EVERYWHERE) == pytest.approx(1)
    maps = np.random.default_rng(0).multivariate_normal(np.zeros(N), raw, size=2000)
    assert maps.var(axis=1).mean() == pytest.approx(1, rel=0.05)


def test_shapes_have_no_level_and_unit_spread():
    maps = np.stack([np.arange(N) * 3.0 + 5, np.full(N, 0.1)])
    (only,) = unit_shapes(maps, HALF)
    assert only[HALF].mean() == pytest.approx(0)
    assert only[HALF].std() == pytest.approx(1)


def test_rough_fields_vary_more_within_a_cell(model):
    smooth, rough = (
        within_cell_variance(replace(model, kernel=Kernel(1.0, length, 0.0)), EVERYWHERE) for length in (20.0, 1.0)
    )
    assert 0 < smooth < 0.5 * rough


def test_the_blend_is_as_good_on_the_validation_maps_as_either_of_its_parts(model):
    cells = np.random.default_rng(2).choice(N, 25, replace=False)
    measured = Measurements(np.eye(N)[cells], np.zeros(25), np.full(25, 0.01))
    setting = Setting(model, measured, EVERYWHERE, np.zeros(25), 0)
    rehearsal = rehearse(setting, 1.0)
    best = choose_blend(setting, rehearsal)
    assert best.alpha in MIXES
    assert best.length_cells in LENGTHS_CELLS

    def error(covariance, nugget):
        decoded = LinearDecoder(setting, covariance, {}, nugget=nugget).decode(rehearsal.values)
        return rehearsal.mean_error(decoded.mean)

    kernel = kernel_covariance(SHAPE, Kernel(1.0, best.length_cells, 0.0), EVERYWHERE)
    own = error(best.alpha * setting.training + (1 - best.alpha) * kernel, best.nugget)
    assert own <= 1.02 * rehearsal.mean_error(kriging(setting).decode(rehearsal.values).mean)
    assert own <= 1.02 * rehearsal.mean_error(mmse(setting).decode(rehearsal.values).mean)
