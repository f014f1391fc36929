"""The packaged models: there, small, and of the sizes that their names say."""

from __future__ import annotations

import math
from importlib import resources

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sparsor.prior.builtin import SHAPE, SIDES_M, VALIDATION_MAPS, builtin_model, file_name, nearest_side_m

MODELS = resources.files("sparsor.prior") / "models"
lengths = st.floats(math.log(200), math.log(3e6)).map(math.exp)


@given(lengths, lengths)
def test_no_other_side_is_nearer_in_ratio_whichever_way_the_box_lies(east_m, north_m):
    chosen = nearest_side_m(east_m, north_m)
    size = math.sqrt(east_m * north_m)
    apart = {side: abs(math.log(side / size)) for side in SIDES_M}
    assert apart[chosen] <= min(apart.values()) + 1e-12
    assert nearest_side_m(north_m, east_m) == chosen


@given(st.floats(math.log(1000), math.log(1.3e6)).map(math.exp))
def test_no_box_from_1_to_1300_km_is_far_from_a_model(side):
    assert abs(math.log(nearest_side_m(side, side) / side)) <= math.log(1.57)


@pytest.mark.parametrize("side", SIDES_M)
def test_a_box_of_a_models_size_gets_that_model(side):
    assert nearest_side_m(side, side) == side
    assert nearest_side_m(side * 1.9, side / 1.9) == side


def test_sizes_outside_get_the_outermost_models():
    assert nearest_side_m(200, 200) == SIDES_M[0]
    assert nearest_side_m(3e6, 3e6) == SIDES_M[-1]


def test_every_size_has_its_file_no_file_is_without_a_size_and_all_fit_the_wheel():
    found = {entry.name: len(entry.read_bytes()) for entry in MODELS.iterdir() if entry.name.endswith(".npz")}
    assert sorted(found) == sorted(file_name(side) for side in SIDES_M)
    assert sum(found.values()) <= 8_000_000


@pytest.mark.parametrize("side", SIDES_M)
def test_a_packaged_model_is_what_its_name_says(side):
    model = builtin_model(side)
    assert f"{model.window_m[0] / 1000:g}km" in file_name(side)
    assert model.window_m == (side, side)
    assert (model.shape, model.atoms, model.centred) == (SHAPE, 256, True)
    assert len(model.validation) == VALIDATION_MAPS
    assert "synthetic" in model.provenance["source"]
    # Validation maps are on the scale of the training maps, which may be left a little at either end.
    assert -0.5 < model.validation.min() < model.validation.max() < 1.5
    np.testing.assert_allclose(np.linalg.norm(model.dictionary, axis=0), 1, atol=1e-2)
