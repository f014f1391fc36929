"""Laws of the grid: round trips, geodesic lengths, full coverage."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Geod

from sparsor.errors import BoxError
from sparsor.geodesy import BoundingBox, Grid
from sparsor.geodesy.lengths import distance_m, offset_deg, path_length_m
from strategies import boxes, grids

GEOD = Geod(ellps="WGS84")
UNIT = st.floats(0.0, 1.0)


@given(grids())
def test_cells_to_places_and_back(grid: Grid) -> None:
    lon, lat = grid.centres_deg()
    assert np.all((lon >= -180) & (lon <= 180))
    np.testing.assert_array_equal(grid.cell_at(lon, lat), np.arange(grid.size))


@given(grids(across=True))
def test_cells_to_places_and_back_across_the_antimeridian(grid: Grid) -> None:
    lon, lat = grid.centres_deg()
    np.testing.assert_array_equal(grid.cell_at(lon, lat), np.arange(grid.size))
    assert np.ptp(lon) <= 360


@given(grids(), UNIT, UNIT)
def test_places_to_positions_and_back_within_a_millimetre(grid: Grid, across: float, down: float) -> None:
    box = grid.box
    lon = (box.west_deg + across * box.width_deg + 180) % 360 - 180
    lat = box.north_deg - down * box.height_deg
    row, column = grid.position_of(lon, lat)
    back_lon = box.west_deg + (column + 0.5) * box.width_deg / grid.shape[1]
    back_lat = box.north_deg - (row + 0.5) * box.height_deg / grid.shape[0]
    assert GEOD.inv(lon, lat, float(back_lon), float(back_lat))[2] < 1e-3


@given(grids(), UNIT, UNIT)
def test_every_place_in_the_box_has_the_cell_whose_centre_is_nearest_in_degrees(
    grid: Grid, across: float, down: float
) -> None:
    box = grid.box
    lon, lat = box.west_deg + across * box.width_deg, box.north_deg - down * box.height_deg
    cell = int(grid.cell_at(lon, lat))
    assert cell >= 0
    row, column = grid.position_of(lon, lat)
    assert abs(row - cell // grid.shape[1]) <= 0.5 + 1e-6
    assert abs(column - cell % grid.shape[1]) <= 0.5 + 1e-6


@given(grids(), st.floats(0.01, 0.4), UNIT)
def test_places_outside_the_box_have_no_cell(grid: Grid, beyond: float, along: float) -> None:
    box = grid.box
    lat = box.south_deg + along * box.height_deg
    lon = box.west_deg + along * box.width_deg
    outside_lon = [box.west_deg - beyond * box.width_deg, box.east_deg + beyond * box.width_deg]
    outside_lat = [box.south_deg - beyond * box.height_deg, box.north_deg + beyond * box.height_deg]
    assert np.all(grid.cell_at(outside_lon, lat) == -1)
    assert np.all(grid.cell_at(lon, outside_lat) == -1)


def test_row_0_is_northmost_and_column_0_westmost() -> None:
    grid = Grid(BoundingBox(179.0, -1.0, -179.0, 1.0), (2, 4))
    lon, lat = grid.centres_deg()
    np.testing.assert_allclose(lon.reshape(2, 4)[0], [179.25, 179.75, -179.75, -179.25])
    np.testing.assert_allclose(lat.reshape(2, 4)[:, 0], [0.5, -0.5])


@given(grids(largest=9))
@settings(max_examples=50)
def test_lengths_are_those_of_pyproj(grid: Grid) -> None:
    lon, lat = grid.centres_deg()
    rng = np.random.default_rng(0)
    i, j = rng.integers(grid.size, size=(2, 200))
    expected = GEOD.inv(lon[i], lat[i], lon[j], lat[j])[2]
    np.testing.assert_allclose(grid.lengths_m()[i, j], expected, rtol=1e-9, atol=1e-4)


@given(boxes(), st.tuples(st.integers(2, 6), st.integers(2, 6)))
@settings(max_examples=50)
def test_lengths_are_a_metric(box: BoundingBox, shape: tuple[int, int]) -> None:
    lengths = Grid(box, shape).lengths_m()
    assert np.all(np.diag(lengths) == 0)
    np.testing.assert_array_equal(lengths, lengths.T)
    assert np.all(lengths[~np.eye(len(lengths), dtype=bool)] > 0)
    detours = lengths[:, :, None] + lengths[None, :, :]
    assert np.all(lengths[:, None, :] <= detours * (1 + 1e-9) + 1e-4)


@given(grids())
def test_full_coverage_visits_every_cell_once_in_steps_of_one_cell(grid: Grid) -> None:
    order = grid.boustrophedon()
    np.testing.assert_array_equal(np.sort(order), np.arange(grid.size))
    row, column = np.divmod(order, grid.shape[1])
    np.testing.assert_array_equal(np.abs(np.diff(row)) + np.abs(np.diff(column)), 1)


@given(grids())
def test_full_coverage_goes_to_and_fro_along_the_shorter_side(grid: Grid) -> None:
    order = grid.boustrophedon()
    along_a_row = order[1] // grid.shape[1] == order[0] // grid.shape[1]
    if not math.isclose(grid.box.east_m, grid.box.north_m, rel_tol=1e-6):
        assert along_a_row == (grid.box.east_m < grid.box.north_m)


@given(boxes())
@settings(max_examples=50)
def test_full_coverage_is_as_long_as_its_lanes(box: BoundingBox) -> None:
    grid = Grid(box)
    north_m, east_m = box.north_m * 31 / 32, box.east_m * 31 / 32
    lanes = 32 * min(north_m, east_m) + max(north_m, east_m)
    # The parallels of a box get shorter towards the pole: the middle one stands for them, more or less.
    narrowest, widest = (
        math.cos(math.radians(lat)) / math.cos(math.radians(box.centre_lat_deg))
        for lat in sorted((box.south_deg, box.north_deg), key=abs, reverse=True)
    )
    if box.south_deg < 0 < box.north_deg:
        widest = 1 / math.cos(math.radians(box.centre_lat_deg))
    assert lanes * min(narrowest, 1) * 0.98 <= grid.full_coverage_m() <= lanes * max(widest, 1) * 1.02


@given(grids(), st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_forbidden_cells_leave_the_order_of_the_others(grid: Grid, seed: int) -> None:
    allowed = np.random.default_rng(seed).random(grid.size) < 0.5
    order = grid.boustrophedon(allowed)
    np.testing.assert_array_equal(np.sort(order), np.flatnonzero(allowed))
    assert grid.full_coverage_m(allowed) <= grid.full_coverage_m() * (1 + 1e-6) + 1e-3


@pytest.mark.parametrize("shape", [(1, 32), (32, 257), (0, 0)])
def test_shapes_out_of_range_are_refused(shape: tuple[int, int]) -> None:
    with pytest.raises(BoxError, match=r"each side has to be 2\.\.256"):
        Grid(BoundingBox(0.0, 0.0, 1.0, 1.0), shape)


@given(st.floats(-180, 180), st.floats(-80, 80), st.floats(-5e5, 5e5), st.floats(-5e5, 5e5))
def test_offsets_are_as_long_as_asked(lon: float, lat: float, east: float, north: float) -> None:
    end_lon, end_lat = offset_deg(lon, lat, east, north)
    assert float(distance_m(lon, lat, end_lon, end_lat)) == pytest.approx(math.hypot(east, north), abs=1e-3)


def test_a_path_is_the_sum_of_its_legs() -> None:
    assert path_length_m([0, 0, 1], [0, 1, 1]) == pytest.approx(float(distance_m(0, 0, 0, 1) + distance_m(0, 1, 1, 1)))
    assert path_length_m([7.0], [7.0]) == 0
