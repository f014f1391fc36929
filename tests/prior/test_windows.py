"""Resampling and windows: means are kept, planes stay planes, and windows are as large as they say."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.errors import FieldError
from sparsor.geodesy import BoundingBox, Grid
from sparsor.prior.field import Field
from sparsor.prior.resampling import cell_means, fill_gaps, resample_bilinear, sample_at
from sparsor.prior.windows import (
    LEAST_WINDOWS,
    MOST_WINDOWS,
    ground_windows,
    nearest_resolved_m,
    pixel_windows,
)


def plane_field(
    rows: int,
    columns: int,
    west: float = 45.0,
    north: float = 31.0,
    pixel: float = 0.1,
    slope: tuple[float, float] = (2.0, -3.0),
) -> Field:
    lon = west + (np.arange(columns) + 0.5) * pixel
    lat = north - (np.arange(rows) + 0.5) * pixel
    values = slope[0] * lon[None, :] + slope[1] * lat[:, None]
    return Field(values, lon, lat, "ppb", "plane")


def plane(rows: int, columns: int) -> np.ndarray:
    row, column = np.mgrid[0:rows, 0:columns]
    return 3.0 * row - 2.0 * column + 7.0


def test_bilinear_resampling_is_exact_on_a_plane_between_the_outer_centres() -> None:
    wide = resample_bilinear(plane(9, 12), (99, 139))
    row = (np.arange(99) + 0.5) * 9 / 99 - 0.5
    column = (np.arange(139) + 0.5) * 12 / 139 - 0.5
    truth = 3.0 * np.clip(row, 0, 8)[:, None] - 2.0 * np.clip(column, 0, 11) + 7.0
    np.testing.assert_allclose(wide, truth, atol=1e-12)
    np.testing.assert_array_equal(resample_bilinear(plane(9, 12), (9, 12)), plane(9, 12))


def test_bilinear_resampling_keeps_gaps_and_spoils_nothing_else() -> None:
    values = np.full((6, 6), 5.0)
    values[2, 3] = np.nan
    wide = resample_bilinear(values, (60, 60))
    assert np.isnan(wide[25, 35])
    assert 0 < np.isnan(wide).mean() < 0.04
    np.testing.assert_allclose(wide[np.isfinite(wide)], 5.0)


def test_samples_of_a_field_are_bilinear_any_turn_of_longitude_and_nothing_outside() -> None:
    field = plane_field(20, 30)
    lon, lat = np.array([45.3, 46.77]), np.array([30.2, 29.33])
    for turn in (-360, 0, 360):
        np.testing.assert_allclose(sample_at(field, lon + turn, lat), 2 * lon - 3 * lat, atol=1e-9)
    assert np.isnan(sample_at(field, [44.9, 48.1, 46, 46], [30, 30, 31.1, 28.9])).all()
    corners = sample_at(field, [45.0, 48.0, 45.0, 48.0], [31.0, 31.0, 29.0, 29.0])
    np.testing.assert_allclose(corners, field.values[[0, 0, -1, -1], [0, -1, 0, -1]], atol=1e-9)


bounds = st.tuples(*[st.floats(0, 8)] * 2, *[st.floats(11, 20)] * 2).map(lambda b: (b[0], b[2], b[1], b[3]))


@given(bounds=bounds, shape=st.tuples(st.integers(1, 9), st.integers(1, 9)))
@settings(max_examples=60, deadline=None)
def test_cell_means_keep_the_mean_symmetry_and_planes(
    bounds: tuple[float, float, float, float], shape: tuple[int, int]
) -> None:
    noise = np.random.default_rng(1).random((20, 20))
    means = cell_means(noise, bounds, shape)
    np.testing.assert_allclose(means.mean(), cell_means(noise, bounds, (1, 1))[0, 0], rtol=1e-9)
    turned = cell_means(noise.T, bounds[2:] + bounds[:2], shape[::-1]).T
    np.testing.assert_allclose(means, turned, rtol=1e-9)
    np.testing.assert_allclose(cell_means(np.full((20, 20), 4.0), bounds, shape), 4.0, rtol=1e-12)
    top, bottom, left, right = bounds
    row = top + (np.arange(shape[0]) + 0.5) * (bottom - top) / shape[0] - 0.5
    column = left + (np.arange(shape[1]) + 0.5) * (right - left) / shape[1] - 0.5
    truth = 3.0 * row[:, None] - 2.0 * column + 7.0
    np.testing.assert_allclose(cell_means(plane(20, 20), bounds, shape), truth, atol=1e-9)


def test_cell_means_of_whole_pixels_are_their_plain_means() -> None:
    values = np.random.default_rng(2).random((12, 15))
    expected = values[2:11, 1:13].reshape(3, 3, 4, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(cell_means(values, (2, 11, 1, 13), (3, 4)), expected, rtol=1e-12)


def test_gaps_inside_are_filled_linearly_and_beyond_the_hull_by_the_nearest() -> None:
    values = plane(20, 20)
    values[5:9, 6:11] = np.nan
    values[15, 15] = np.nan
    np.testing.assert_allclose(fill_gaps(values), plane(20, 20), atol=1e-9)
    values = np.array([[np.nan, np.nan, np.nan], [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    np.testing.assert_array_equal(fill_gaps(values)[0], [1, 2, 3])


def test_the_papers_grid_gives_1120_maps() -> None:
    maps = pixel_windows(np.zeros((994, 1390)))
    assert maps.maps.shape == (1120, 1024)
    assert (maps.row.max() + 1, maps.column.max() + 1) == (28, 40)
    assert (maps.dropped, maps.filled) == (0, 0)


def test_pixel_windows_are_means_of_squares_in_place() -> None:
    values = np.random.default_rng(3).random((40, 50))
    maps = pixel_windows(values, window=16, stride=8, factor=4, unit="ppb")
    assert maps.unit == "ppb"
    for k in (0, 7, len(maps.maps) - 1):
        top, left = 8 * maps.row[k], 8 * maps.column[k]
        expected = values[top : top + 16, left : left + 16].reshape(4, 4, 4, 4).mean(axis=(1, 3))
        np.testing.assert_allclose(maps.maps[k].reshape(4, 4), expected, rtol=1e-12)


def test_windows_with_large_gaps_are_dropped_and_small_ones_filled() -> None:
    values = plane(64, 128)
    values[10:12, 10:12] = np.nan  # 4 of 1024 pixels
    values[40:50, 70:80] = np.nan  # 100 of 1024
    maps = pixel_windows(values, window=32, stride=32, factor=4)
    assert (len(maps.maps), maps.dropped, maps.filled) == (7, 1, 1)
    whole = pixel_windows(plane(64, 128), window=32, stride=32, factor=4)
    kept = ~((whole.row == 1) & (whole.column == 2))
    np.testing.assert_allclose(maps.maps, whole.maps[kept], atol=1e-9)
    with pytest.raises(FieldError, match=r"no window without large gaps: 8 had more than 5%"):
        pixel_windows(np.where(np.arange(128) % 2, values, np.nan), window=32, stride=32, factor=4)


def test_a_raster_smaller_than_a_window_is_refused() -> None:
    with pytest.raises(FieldError, match=r"100 x 90 pixels hold no window of 128 x 128"):
        pixel_windows(np.zeros((90, 100)))


def test_ground_windows_are_the_boxes_they_stand_for() -> None:
    field = plane_field(120, 140)
    maps = ground_windows(field, 420_000.0, 400_000.0)
    assert maps.window_m == (420_000.0, 400_000.0)
    assert maps.unit == "ppb"
    west, _, _, north = field.edges_deg
    first = maps.maps[0].reshape(32, 32)
    # Means over a plane: the window's extent is its steps from cell to cell times the number of cells.
    width, height = (first[0, 1] - first[0, 0]) / 2 * 32, (first[1, 0] - first[0, 0]) / 3 * 32
    box = BoundingBox(west, north - height, west + width, north)
    assert box.east_m == pytest.approx(420_000, rel=1e-6)
    assert box.north_m == pytest.approx(400_000, rel=1e-6)
    lon, lat = Grid(box).centres_deg()
    np.testing.assert_allclose(first.ravel(), 2 * lon - 3 * lat, atol=1e-6)


def test_ground_windows_of_a_plane_are_planes_a_quarter_side_apart() -> None:
    maps = ground_windows(plane_field(120, 140), 420_000.0, 400_000.0)
    cells = maps.maps.reshape(-1, 32, 32)
    np.testing.assert_allclose(np.diff(cells, 2, axis=1), 0, atol=1e-7)
    np.testing.assert_allclose(np.diff(cells, 2, axis=2), 0, atol=1e-7)
    first_row = cells[maps.row == 0]
    width = (first_row[0, 0, 1] - first_row[0, 0, 0]) * 32
    np.testing.assert_allclose(np.diff(first_row[:, 0, 0]), width / 4, rtol=1e-6)


@pytest.mark.parametrize("pixel", [0.5, 0.25])
def test_windows_four_columns_apart_share_no_ground(pixel: float) -> None:
    field = plane_field(int(150 / pixel), int(160 / pixel), west=-20.0, north=75.0, pixel=pixel, slope=(1.0, 0.0))
    side = 2_000_000.0
    maps = ground_windows(field, side, side, (16, 16))
    cells = maps.maps.reshape(-1, 16, 16)[:, 0]
    half = (cells[:, 1] - cells[:, 0]) / 2
    west, east = cells[:, 0] - half, cells[:, -1] + half
    for column in range(maps.column.max() - 3):
        ends = east[maps.column == column].max()
        assert (west[maps.column >= column + 4] >= ends - 1e-6).all()
    assert west.min() == pytest.approx(-20.0)
    assert east.max() <= 140.0 + 1e-6


def test_the_number_of_windows_is_bounded() -> None:
    field = plane_field(800, 800, pixel=0.01)
    east_m, north_m = nearest_resolved_m(field, 100.0, 100.0)
    assert MOST_WINDOWS * 0.8 < len(ground_windows(field, east_m, north_m).maps) <= MOST_WINDOWS


def test_a_resolved_size_is_kept() -> None:
    field = plane_field(120, 140)
    assert nearest_resolved_m(field, 420_000.0, 400_000.0) == (420_000.0, 400_000.0)


@given(
    east_m=st.floats(200, 3e6),
    aspect=st.floats(0.5, 2),
    north=st.floats(-60, 80),
    shape=st.tuples(st.integers(8, 40), st.integers(8, 40)),
)
@settings(max_examples=40, deadline=None)
def test_the_nearest_size_is_resolved_has_windows_and_keeps_its_aspect(
    east_m: float, aspect: float, north: float, shape: tuple[int, int]
) -> None:
    field = plane_field(200, 260, north=north)
    east, tall = nearest_resolved_m(field, east_m, east_m * aspect, shape)
    assert tall / east == pytest.approx(aspect)
    maps = ground_windows(field, east, tall, shape)
    assert len(maps.maps) >= LEAST_WINDOWS
    if east > east_m * (1 + 1e-9):  # scaled up no more than it had to be
        with pytest.raises(FieldError, match=r"span fewer than"):
            ground_windows(field, east * 0.99, tall * 0.99, shape)
    assert nearest_resolved_m(field, east, tall, shape) == pytest.approx((east, tall), rel=1e-6)


def test_a_field_that_is_too_small_says_how_large_it_is() -> None:
    with pytest.raises(FieldError, match=r"40 x 40 pixels. A window needs 32 x 32 .* 12 such windows"):
        nearest_resolved_m(plane_field(40, 40), 3000.0, 3000.0)
    with pytest.raises(FieldError, match=r"no size"):
        nearest_resolved_m(plane_field(40, 40), 0.0, 3000.0)
