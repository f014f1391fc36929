"""The field that the sensor flies through: its place, its gaps, its range, its file."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sparsor.errors import FieldError
from sparsor.link.practice import RasterTruth, built_in_over, field_truth, truth_netcdf
from sparsor.prior.field import field_on_axes
from sparsor.prior.reading import read_field

RNG = np.random.default_rng(4)
VALUES = RNG.random((6, 9)) * 40 + 3


def field(values=VALUES, west=10.0, north=50.0):
    rows, columns = values.shape
    lon, lat = west + 0.5 + np.arange(columns), north - 0.5 - np.arange(rows)
    return field_on_axes(values, lon, lat, unit="ppb", source="made up")


def centres(box, shape):
    west, south, east, north = box
    lon = west + (np.arange(shape[1]) + 0.5) * (east - west) / shape[1]
    lat = north - (np.arange(shape[0]) + 0.5) * (north - south) / shape[0]
    return np.meshgrid(lon, lat)


@pytest.mark.parametrize("over", [None, (51.5, 25.2, 51.53, 25.3), (179.9, -17.0, -179.9, -16.8)])
def test_the_field_is_where_it_is_laid_stretched_over_its_own_range(over):
    truth = field_truth(field(), over)
    lon, lat = centres(truth.box, VALUES.shape)
    read = np.vectorize(truth)((lon + 180) % 360 - 180, lat)
    assert read == pytest.approx((VALUES - VALUES.min()) / np.ptp(VALUES), abs=1e-5)
    assert truth.covers(float(lon[2, 2]), float(lat[2, 2]))
    assert not truth.covers(0.0, float(lat[2, 2]))


def test_a_field_round_the_world_is_read_on_both_sides():
    world = field(RNG.random((4, 360)), west=-180.0, north=2.0)
    truth = field_truth(world)
    for column in (0, 90, 200, 359):
        lon = -179.5 + column
        assert truth(lon, 1.5) * np.ptp(world.values) + world.values.min() == pytest.approx(
            world.values[0, column], abs=1e-5
        )


@given(st.floats(-160, 160), st.floats(-80, 80))
def test_beyond_the_raster_the_sensor_reads_its_edge(lon, lat):
    value = field_truth(field())(lon, lat)
    assert 0 <= value <= 1
    if lon < 10 and lat > 50:
        assert value == pytest.approx((VALUES[0, 0] - VALUES.min()) / np.ptp(VALUES), abs=1e-5)


def test_gaps_are_filled_from_their_rims():
    holed = VALUES.copy()
    holed[2, 3] = np.nan
    holed[:, 8] = np.nan  # beyond the last values: the nearest
    truth = field_truth(field(holed))
    assert np.isfinite(truth.values).all()
    rim = truth.values[1:4, 2:5]
    assert np.delete(rim.ravel(), 4).min() <= rim[1, 1] <= np.delete(rim.ravel(), 4).max()
    assert truth.values[:, 8] == pytest.approx(truth.values[:, 7])


def test_a_field_of_one_value_is_refused():
    with pytest.raises(FieldError, match="same value, 2, all over"):
        field_truth(field(np.full((4, 4), 2.0)))


def test_the_built_in_field_over_a_box_runs_from_0_to_1():
    truth = built_in_over((51.50, 25.27, 51.53, 25.30), 32)
    assert (truth.values.min(), truth.values.max()) == (0, 1)
    with pytest.raises(FieldError):
        built_in_over((-70.0, 40.0, -69.9, 40.1), 32)


@pytest.mark.parametrize("box", [(51.5, 25.27, 51.53, 25.3), (179.9, -17.0, 180.1, -16.8)])
def test_the_file_holds_what_an_ideal_sensor_reads_and_is_a_field_again(tmp_path, box):
    truth = RasterTruth(RNG.random((20, 30)), box, "made up")
    (tmp_path / "truth.nc").write_bytes(truth_netcdf(truth, 10, 70))
    again = read_field(tmp_path / "truth.nc")
    assert again.unit == "ppb"
    assert again.edges_deg == pytest.approx(box)
    assert again.values == pytest.approx(10 + 60 * truth.values, abs=1e-4)
    import xarray as xr

    with xr.open_dataset(tmp_path / "truth.nc") as dataset:
        assert "made up" in dataset.attrs["source"]
        assert "10 + 60 s" in dataset.attrs["history"]
        assert dataset.truth.attrs["long_name"]
        assert dataset.lon.attrs["standard_name"] == "longitude"
        assert list(dataset.truth.attrs["actual_range"]) == [10, 70]
