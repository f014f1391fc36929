"""From windows to a model: validation is apart from training, and nothing leaks from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.errors import ModelError
from sparsor.prior.field import Field
from sparsor.prior.learning import TrainingMaps, maps_of_fields, split_maps, untuned_model, with_mirror_images
from sparsor.prior.model import arrays_to_npz, model_arrays
from sparsor.prior.statistics import shape_covariance
from sparsor.prior.windows import ground_windows, pixel_windows

SHAPE = (6, 7)


def longitudes(rows, columns, *, south=20.0, pixel=0.05, unit="ppb"):
    """A field whose value at a pixel is its longitude, so that a map says where it was cut."""
    lon = 50.0 + (np.arange(columns) + 0.5) * pixel
    lat = south + (np.arange(rows)[::-1] + 0.5) * pixel
    return Field(np.tile(lon, (rows, 1)), lon, lat, unit, "longitudes")


def edges_deg(maps, shape):
    """Western and eastern edge of each map of `longitudes`."""
    rows = maps.reshape(-1, *shape)
    west, east = rows[..., 0].mean(axis=1), rows[..., -1].mean(axis=1)
    half = (east - west) / (shape[1] - 1) / 2
    return west - half, east + half


@pytest.fixture(scope="module")
def split():
    rng = np.random.default_rng(2)
    place = np.arange(SHAPE[0] * SHAPE[1])
    maps = 3.0 + np.exp(-np.square(place - rng.uniform(0, 42, (40, 1))) / 20) + 0.2 * rng.random((40, 1))
    return TrainingMaps(maps[:30], maps[30:], SHAPE, (3000.0, 2000.0), "ppb", "bumps")


@settings(max_examples=15, deadline=None)
@given(st.integers(70, 160), st.integers(90, 200), st.floats(-70, 70), st.floats(0.8, 1.6), st.floats(0.8, 1.6))
def test_no_validation_window_overlaps_a_training_window_on_the_ground(rows, columns, south, wide, high):
    """At any latitude, where windows are of different width in degrees within one field."""
    field = longitudes(rows, columns, south=south, pixel=0.1)
    maps = ground_windows(field, wide * 140_000, high * 140_000, (4, 5))
    try:
        parts = split_maps([maps], (4, 5))
    except ModelError:  # too few windows; what that says is tested below
        return
    _, training_east = edges_deg(parts.training, (4, 5))
    validation_west, _ = edges_deg(parts.validation, (4, 5))
    # In double precision a mean of longitudes is only so good.
    assert training_east.max() <= validation_west.min() + 1e-6


@pytest.mark.parametrize("count", [1, 3])
def test_each_field_gives_its_share_and_no_map_is_in_both_sets(count):
    sets = [
        pixel_windows(np.random.default_rng(i).random((40, 100)), window=12, stride=3, factor=3) for i in range(count)
    ]
    parts = split_maps(sets, (4, 4))
    training, validation = ({one.tobytes() for one in maps} for maps in (parts.training, parts.validation))
    assert not training & validation
    for maps in sets:
        own = {one.tobytes(): column for one, column in zip(maps.maps, maps.column.tolist(), strict=True)}
        learned, held = ({own[one] for one in part if one in own} for part in (training, validation))
        assert learned, "nothing to learn from this field"
        assert held, "nothing to validate on from this field"
        assert min(held) - max(learned) == 4
        assert len(set(range(int(maps.column.max()) + 1)) - set(range(max(learned) + 1))) <= 0.15 * 30 + 4
    assert len(parts.validation) <= 56


def test_the_covariance_is_learned_from_dense_windows_west_of_all_validation_windows():
    rng = np.random.default_rng(1)
    field = replace(longitudes(100, 160), values=rng.normal(size=(100, 160)))
    windows = ground_windows(field, 60_000, 50_000, (4, 5))
    parts = maps_of_fields([(field, windows)], (4, 5))
    held_west = windows.west[windows.column > windows.column.max() - round(0.15 * (windows.column.max() + 1))].min()
    # Whatever lies in the east, under the validation windows, is not seen.
    values = field.values.copy()
    values[:, int(np.ceil(held_west)) :] = 9e9
    elsewhere = replace(field, values=values)
    np.testing.assert_array_equal(maps_of_fields([(elsewhere, windows)], (4, 5)).shapes, parts.shapes)
    assert not np.allclose(parts.shapes, shape_covariance([parts.training]), atol=0.02)
    model = untuned_model(parts, atoms=8, dictionary="polynomial")
    np.testing.assert_allclose(model.covariance_factor @ model.covariance_factor.T, parts.shapes, atol=1e-9)


def test_what_is_known_of_the_windows_goes_on():
    field = longitudes(100, 160)
    maps = ground_windows(field, 60_000, 50_000, (4, 5))
    parts = split_maps([maps, replace(maps, source="again")], (4, 5))
    assert (parts.shape, parts.window_m, parts.unit) == ((4, 5), (60_000, 50_000), "ppb")
    assert parts.source == "longitudes; again"


def test_fields_of_different_units_are_refused():
    one = pixel_windows(np.random.default_rng(0).random((40, 100)), window=12, stride=3, factor=3, unit="ppb")
    with pytest.raises(
        ModelError, match=r"the fields differ in unit \('ppb', 'ug/m3'\); learn from fields of one unit"
    ):
        split_maps([one, replace(one, unit="ug/m3"), one], (4, 4))


def test_fields_of_different_window_size_are_refused():
    field = longitudes(100, 160)
    with pytest.raises(ModelError, match="window"):
        split_maps([ground_windows(field, side, side, (4, 5)) for side in (50_000, 90_000)], (4, 5))


@pytest.mark.parametrize("columns", [12, 21, 26])
def test_too_few_windows_says_how_many_of_what_size_and_what_to_do(columns):
    field = longitudes(14, columns)
    maps = ground_windows(field, 55_000, 55_000, (4, 4))
    with pytest.raises(
        ModelError,
        match=r"the field holds \d training and \d+ validation windows of 55 x 55 km; at least 8 and 1 are "
        r"needed: take a larger or finer field, several fields, or a smaller box",
    ):
        split_maps([maps], (4, 4))


def test_mirror_images_are_each_other_and_the_maps_come_first():
    maps = np.random.default_rng(0).random((3, 42))
    images = with_mirror_images(maps, SHAPE)
    assert images.shape == (12, 42)
    np.testing.assert_array_equal(images[:3], maps)
    cube = images.reshape(4, 3, *SHAPE)
    np.testing.assert_array_equal(cube[1], cube[0, :, :, ::-1])
    np.testing.assert_array_equal(cube[2], cube[0, :, ::-1])
    np.testing.assert_array_equal(cube[3], cube[1, :, ::-1])
    # Mirroring all of them again gives the same set.
    again = {one.tobytes() for one in with_mirror_images(images, SHAPE)}
    assert again == {one.tobytes() for one in images}


def test_the_scale_is_that_of_the_training_maps_alone(split):
    wide = replace(split, validation=split.validation * 100 - 50)
    for maps in (split, wide):
        model = untuned_model(maps, atoms=8, dictionary="dct")
        assert model.scale == (split.training.min(), split.training.max())
        low, high = model.scale
        np.testing.assert_allclose(model.validation * (high - low) + low, maps.validation, rtol=1e-12)


@pytest.mark.parametrize("dictionary", ["learned", "dct"])
def test_nothing_but_the_validation_maps_depends_on_the_validation_maps(split, dictionary):
    other = replace(split, validation=split.validation[::-1] ** 2)
    one, two = (model_arrays(untuned_model(maps, atoms=8, dictionary=dictionary)) for maps in (split, other))
    assert {name for name in one if not np.array_equal(one[name], two[name])} == {"validation"}


@settings(max_examples=10, deadline=None)
@given(st.floats(-1e3, 1e3), st.floats(1e-3, 1e3))
def test_the_unit_of_the_field_changes_the_scale_and_nothing_else(split, shift, size):
    moved = replace(split, training=shift + size * split.training, validation=shift + size * split.validation)
    one, other = (untuned_model(maps, atoms=8, dictionary="polynomial") for maps in (split, moved))
    digits = 1e-12 * (1 + abs(shift) / size)
    np.testing.assert_allclose(other.scale, shift + size * np.array(one.scale), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(other.mean, one.mean, atol=digits)
    np.testing.assert_allclose(other.validation, one.validation, atol=digits)
    factors = [model.covariance_factor @ model.covariance_factor.T for model in (other, one)]
    np.testing.assert_allclose(*factors, atol=10 * digits)
    assert other.kernel.variance == pytest.approx(one.kernel.variance, rel=1e-5)
    assert other.kernel.length_cells == one.kernel.length_cells


@pytest.mark.parametrize("dictionary", ["learned", "dct", "polynomial"])
def test_the_same_seed_gives_the_same_bytes(split, dictionary):
    one, other = (untuned_model(split, atoms=8, dictionary=dictionary, seed=3) for _ in range(2))
    assert arrays_to_npz(model_arrays(one)) == arrays_to_npz(model_arrays(other))


def test_the_mean_is_that_of_the_training_maps_or_none(split):
    model = untuned_model(split, atoms=8)
    low, high = model.scale
    np.testing.assert_allclose(model.mean, (split.training.mean(axis=0) - low) / (high - low), atol=1e-12)
    assert model.centred
    assert not untuned_model(split, atoms=8, centred=False).centred


def test_few_windows_are_mirrored_for_many_atoms(split):
    few, many = untuned_model(split, atoms=8), untuned_model(split, atoms=100)
    assert (few.provenance["mirror_images"], many.provenance["mirror_images"]) == ("0", "90")
    assert few.provenance["training_maps"] == many.provenance["training_maps"] == "30"
    assert (few.atoms, many.atoms) == (8, 100)
    assert many.validation.shape == few.validation.shape


def test_the_kernel_does_not_count_the_levels_of_the_maps(split):
    levels = 0.5 * np.random.default_rng(0).random((30, 1))
    shifted = replace(split, training=split.training + levels)
    one, other = (untuned_model(maps, atoms=8, dictionary="dct") for maps in (split, shifted))
    of_unit = [model.kernel.variance * (model.scale[1] - model.scale[0]) ** 2 for model in (one, other)]
    assert of_unit[0] == pytest.approx(of_unit[1], rel=1e-6)


def test_what_the_caller_says_is_added_to_the_provenance(split):
    about = untuned_model(split, atoms=8, seed=5, dictionary="dct", provenance={"made": "here"}).provenance
    assert (about["made"], about["source"], about["seed"], about["dictionary"]) == ("here", "bumps", "5", "dct")


def test_maps_of_one_value_are_refused(split):
    with pytest.raises(ModelError, match=r"bumps: the training windows hold one value only, 2\.5: nothing to learn"):
        replace(split, training=np.full_like(split.training, 2.5))


@pytest.mark.parametrize("level", [0.0, 0.1, 1 / 3, 1.0])
def test_validation_maps_without_contrast_are_refused(split, level):
    low, high = split.training.min(), split.training.max()
    flat = replace(split, validation=np.full_like(split.validation, low + level * (high - low)))
    with pytest.raises(ModelError, match="bumps: the validation windows have no contrast"):
        untuned_model(flat, atoms=8, dictionary="dct")


@pytest.mark.parametrize(("dictionary", "atoms"), [("learned", 1), ("dct", 43), ("polynomial", 0)])
def test_atoms_out_of_range_are_refused(split, dictionary, atoms):
    with pytest.raises(ModelError, match=f"atoms is {atoms}"):
        untuned_model(split, atoms=atoms, dictionary=dictionary)
