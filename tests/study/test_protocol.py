"""The protocol of every figure: as many maps as the paper has, and sets that share no pixel where they must not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sparsor.errors import InputError
from sparsor.prior.field import Field
from sparsor.prior.windows import MapSet
from sparsor.study import blocked_split, random_split, scaled, study_maps
from sparsor.study.protocol import PAPER_PIXELS

FOLDS = range(3)
# method.md, Protocol: window columns of the test, validation and training sets.
TABLE = {
    0: (range(13), range(36, 40), range(16, 33)),
    1: (range(13, 27), range(36, 40), [*range(10), 30, 31, 32]),
    2: (range(27, 40), range(4), range(7, 24)),
}


def field_of(values):
    rows, columns = values.shape
    return Field(values, 45 + 0.01 * np.arange(columns), 30 - 0.01 * np.arange(rows), "ppb", "made")


@pytest.fixture(scope="module")
def places():
    """Maps of a field whose value is the pixel column, so that a map itself says which pixels it is of."""
    return study_maps(field_of(np.tile(np.arange(PAPER_PIXELS[1], dtype=float), (PAPER_PIXELS[0], 1))))


@pytest.fixture(scope="module")
def maps():
    """As many maps in as many places as the paper's, of a few cells."""
    row, column = (place.ravel() for place in np.indices((28, 40)))
    values = np.random.default_rng(0).normal(7.0, 2.0, (1120, 4))
    return MapSet(values, (float("nan"),) * 2, row, column, 32.0 * column, 0, 0, "ppb", "made")


def pixels(maps, index):
    """The pixel columns under some of the maps, from their values: cells are means of four pixels."""
    rows = maps.maps[index].reshape(-1, 32, 32)
    first, last = rows.min(axis=(1, 2)) - 1.5, rows.max(axis=(1, 2)) + 1.5
    np.testing.assert_allclose(last - first, 127)
    covered = np.zeros(PAPER_PIXELS[1], dtype=bool)
    for left, right in zip(first.round().astype(int), last.round().astype(int), strict=True):
        covered[left : right + 1] = True
    return covered


def test_the_papers_grid_gives_28_rows_of_40_maps(places):
    assert places.maps.shape == (1120, 1024)
    assert sorted(zip(places.row.tolist(), places.column.tolist(), strict=True)) == [
        (row, column) for row in range(28) for column in range(40)
    ]
    assert (places.dropped, places.filled) == (0, 0)


def test_a_coarse_field_is_first_resampled_and_a_fine_one_only_on_request(places):
    coarse = field_of(np.tile(np.linspace(0, 1, 139), (99, 1)))
    assert study_maps(coarse).maps.shape == places.maps.shape
    small = study_maps(field_of(np.random.default_rng(0).random((160, 200))), pixels=None)
    assert small.maps.shape == (2 * 3, 1024)
    assert study_maps(coarse, (160, 200)).maps.shape == small.maps.shape


def test_maps_that_keep_their_pixels_are_means_of_four_by_four():
    values = np.random.default_rng(0).random((128, 160))
    maps = study_maps(field_of(values), pixels=None)
    for one, left in zip(maps.maps, (0, 32), strict=True):
        cells = values[:, left : left + 128].reshape(32, 4, 32, 4).mean(axis=(1, 3))
        np.testing.assert_allclose(one.reshape(32, 32), cells, rtol=1e-12)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_random_split_is_disjoint_complete_and_of_the_papers_shares(maps, seed):
    split = random_split(maps, seed)
    assert [len(part) for part in (split.training, split.validation, split.test)] == [784, 56, 280]
    together = np.concatenate([split.training, split.validation, split.test])
    np.testing.assert_array_equal(np.sort(together), np.arange(1120))
    assert str(seed) in split.name


@pytest.mark.parametrize("count", [1, 2, 7, 19, 60, 1120])
def test_the_random_split_of_any_number_of_maps_is_disjoint_and_complete(maps, count):
    fewer = replace(
        maps, maps=maps.maps[:count], row=maps.row[:count], column=maps.column[:count], west=maps.west[:count]
    )
    split = random_split(fewer, 4)
    together = np.concatenate([split.training, split.validation, split.test])
    np.testing.assert_array_equal(np.sort(together), np.arange(count))
    shares = np.array([len(split.training), len(split.validation), len(split.test)]) / count
    np.testing.assert_allclose(shares, [0.70, 0.05, 0.25], atol=1 / count)


def test_the_random_split_follows_its_seed(maps):
    splits = [random_split(maps, seed) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(splits[0].test, splits[1].test)
    assert set(splits[0].test.tolist()) != set(splits[2].test.tolist())


@pytest.mark.parametrize("fold", FOLDS)
def test_blocked_sets_are_the_columns_of_the_table(maps, fold):
    split = blocked_split(maps, fold)
    for index, columns in zip((split.test, split.validation, split.training), TABLE[fold], strict=True):
        assert set(index.tolist()) == {row * 40 + column for row in range(28) for column in columns}
        assert len(index) == len(set(index.tolist()))
    assert str(fold) in split.name


@pytest.mark.parametrize("fold", FOLDS)
def test_no_test_window_shares_a_pixel_with_training_or_validation(places, fold):
    split = blocked_split(places, fold)
    test, validation, training = (pixels(places, part) for part in (split.test, split.validation, split.training))
    assert not (test & validation).any()
    assert not (test & training).any()
    assert not (validation & training).any()


def test_every_column_is_tested_once_and_most_of_the_rest_is_learned_from(maps):
    splits = [blocked_split(maps, fold) for fold in FOLDS]
    tested = np.concatenate([split.test for split in splits])
    np.testing.assert_array_equal(np.sort(tested), np.arange(1120))
    for split in splits:
        # No column is left out without need: each of those that are touches a window of another set.
        used = [set(maps.column[part].tolist()) for part in (split.test, split.validation, split.training)]
        for column in set(range(40)) - set.union(*used):
            near = [any(abs(column - other) <= 3 for other in columns) for columns in used]
            assert sum(near) >= 2


def test_the_random_split_does_share_pixels(places):
    """Which is why it is never the accuracy to expect, and that this test would notice."""
    split = random_split(places, 0)
    assert (pixels(places, split.test) & pixels(places, split.training)).any()


def test_maps_left_out_for_gaps_leave_the_other_maps_in_their_sets(maps):
    whole = blocked_split(maps, 1)
    kept = np.random.default_rng(1).random(1120) < 0.9
    fewer = replace(maps, maps=maps.maps[kept], row=maps.row[kept], column=maps.column[kept], west=maps.west[kept])
    split = blocked_split(fewer, 1)
    for part in ("training", "validation", "test"):
        members = np.zeros(1120, dtype=bool)
        members[getattr(whole, part)] = True
        np.testing.assert_array_equal(getattr(split, part), np.flatnonzero(members[kept]))


@pytest.mark.parametrize("fold", FOLDS)
def test_the_scale_is_that_of_the_training_maps_alone(maps, fold):
    split = blocked_split(maps, fold)
    one = scaled(maps, split)
    assert (one.training.min(), one.training.max()) == (0.0, 1.0)
    others = np.setdiff1d(np.arange(1120), split.training)
    moved = maps.maps.copy()
    moved[others] = (moved[others] - 7.0) * 50
    other = scaled(replace(maps, maps=moved), split)
    assert other.scale == one.scale
    np.testing.assert_array_equal(other.training, one.training)
    assert other.test.min() < 0 < 1 < other.test.max()


def test_scaled_maps_are_the_maps_again_in_the_fields_unit(maps):
    split = random_split(maps, 0)
    sets = scaled(maps, split)
    low, high = sets.scale
    for part in ("training", "validation", "test"):
        back = low + getattr(sets, part) * (high - low)
        np.testing.assert_allclose(back, maps.maps[getattr(split, part)], rtol=1e-12)


def test_the_fields_unit_makes_no_difference_to_scaled_maps(maps):
    split = blocked_split(maps, 0)
    one, other = scaled(maps, split), scaled(replace(maps, maps=3.0 * maps.maps - 40.0), split)
    for part in ("training", "validation", "test"):
        np.testing.assert_allclose(getattr(other, part), getattr(one, part), atol=1e-12)
    np.testing.assert_allclose(other.scale, 3.0 * np.array(one.scale) - 40.0)


@pytest.mark.parametrize("fold", [-1, 3])
def test_a_fold_that_is_not_there_is_said_so(maps, fold):
    with pytest.raises(InputError, match=rf"fold is {fold}; the blocked protocol has folds 0\.\.2"):
        blocked_split(maps, fold)


def test_the_blocked_protocol_is_for_the_papers_columns_only(maps):
    narrow = maps.column < 20
    fewer = replace(
        maps, maps=maps.maps[narrow], row=maps.row[narrow], column=maps.column[narrow], west=maps.west[narrow]
    )
    with pytest.raises(InputError, match=r"made for the 40 window columns of a raster of 1390 pixels; there are 20"):
        blocked_split(fewer, 0)


def test_training_maps_of_one_value_cannot_be_a_scale(maps):
    flat = replace(maps, maps=np.full_like(maps.maps, 3.0))
    with pytest.raises(InputError, match="one value"):
        scaled(flat, random_split(maps, 0))
