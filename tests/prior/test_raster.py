"""A raster left on file is the raster that is read at once, whatever part of it is looked at."""

from __future__ import annotations

import numpy as np
import pytest
import rasterio
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from rasterio.transform import Affine

from sparsor.prior import geotiff, netcdf, raster
from sparsor.prior.field import field_on_axes
from sparsor.prior.raster import LazyRaster, OnFile
from sparsor.prior.reading import read_field
from sparsor.prior.resampling import sample_at
from sparsor.prior.windows import ground_windows

SHAPE = (90, 140)
VALUES = np.random.default_rng(0).normal(5, 1, SHAPE)
VALUES[3, 4], VALUES[40, 60:62] = np.inf, np.nan


def on_file(values=VALUES, block=(4, 6)):
    return OnFile(values.shape, lambda rows, columns: values[rows, columns], block)


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Everything is large, tiles are small, and few of them are kept."""
    for module in (geotiff, netcdf):
        monkeypatch.setattr(module, "LAZY_PIXELS", 100)
    monkeypatch.setattr(raster, "TILE", 7)
    monkeypatch.setattr(raster, "_KEPT_PIXELS", 1000)


@given(
    st.tuples(st.integers(0, SHAPE[0]), st.integers(0, SHAPE[0])),
    st.tuples(st.integers(0, SHAPE[1]), st.integers(0, SHAPE[1])),
)
def test_any_part_is_the_part_of_the_whole(rows, columns):
    part = (slice(*sorted(rows)), slice(*sorted(columns)))
    lazy = LazyRaster(on_file().read, np.arange(SHAPE[0]), np.arange(SHAPE[1]), (4, 6))
    np.testing.assert_array_equal(lazy[part], np.where(np.isfinite(VALUES), VALUES, np.nan)[part])


@pytest.mark.parametrize("north_up", [True, False])
@pytest.mark.parametrize(
    "lon",
    [50 + np.arange(140), 190 - np.arange(140), 120 + np.arange(140), np.arange(140) * 360 / 140],
    ids=["eastward", "westward", "antimeridian", "all round"],
)
def test_axes_run_the_same_way_lazily(lon, north_up):
    lat = (40 - 0.5 * np.arange(90)) * (1 if north_up else -1)
    eager, lazy = (field_on_axes(one, lon, lat, unit="", source="here") for one in (VALUES, on_file()))
    assert isinstance(lazy.values, LazyRaster)
    np.testing.assert_array_equal(lazy.in_memory, eager.values)
    np.testing.assert_array_equal(lazy.lon_deg, eager.lon_deg)
    np.testing.assert_array_equal(lazy.west_of(50.5).in_memory, eager.west_of(50.5).values)
    at_lon, at_lat = np.random.default_rng(1).uniform(-180, 180, 50), np.random.default_rng(2).uniform(-50, 50, 50)
    np.testing.assert_array_equal(sample_at(lazy, at_lon, at_lat), sample_at(eager, at_lon, at_lat))
    for one in zip(at_lon, at_lat, strict=True):
        np.testing.assert_array_equal(sample_at(lazy, *one), sample_at(eager, *one))


def geotiff_file(path):
    place = Affine(0.01, 0, 50, 0, -0.01, 26)
    profile = {"driver": "GTiff", "height": 90, "width": 140, "count": 1, "dtype": "float32", "crs": "EPSG:4326"}
    with rasterio.open(path, "w", transform=place, nodata=-9, **profile) as dataset:
        dataset.write(np.where(np.isfinite(VALUES), VALUES, -9).astype(np.float32), 1)
        dataset.scales, dataset.offsets = (2.0,), (1.0,)
    return path


def dataset_of_steps(steps=1):
    stack = np.where(np.isinf(VALUES), 0, VALUES) + np.arange(steps)[:, None, None]
    axes = {
        "lat": ("lat", 25 + 0.01 * np.arange(90), {"units": "degrees_north"}),
        "lon": ("lon", 50 + 0.01 * np.arange(140), {"units": "degrees_east"}),
        "time": np.datetime64("2020-01-01", "ns") + np.arange(steps) * np.timedelta64(31, "D"),
    }
    return xr.Dataset({"no2": (("time", "lat", "lon"), stack, {"units": "ppb"})}, coords=axes)


def netcdf_file(path):
    packing = {"no2": {"dtype": "int16", "scale_factor": 0.001, "_FillValue": -1, "chunksizes": (1, 20, 30)}}
    dataset_of_steps().to_netcdf(path, engine="h5netcdf", encoding=packing)
    return path


def classic_file(path):
    dataset_of_steps().to_netcdf(path, engine="scipy")
    return path


def zarr_folder(path):
    dataset_of_steps().to_zarr(path)
    return path


@pytest.mark.parametrize("write", [geotiff_file, netcdf_file, classic_file, zarr_folder])
def test_files_give_the_same_windows_lazily(write, tmp_path):
    path = write(tmp_path / "a")
    eager, lazy = (read_field(path, lazily=lazily) for lazily in (False, True))
    assert isinstance(lazy.values, LazyRaster)
    assert (lazy.unit, lazy.source) == (eager.unit, eager.source)
    np.testing.assert_array_equal(lazy.in_memory, eager.values)
    one, other = (ground_windows(field, 36_000, 36_000) for field in (eager, lazy))
    np.testing.assert_array_equal(other.maps, one.maps)
    assert (other.dropped, other.filled) == (one.dropped, one.filled)


def test_a_raster_that_has_to_be_resampled_is_read(tmp_path):
    path = tmp_path / "a.tif"
    profile = {"driver": "GTiff", "height": 90, "width": 140, "count": 1, "dtype": "float32", "crs": "EPSG:32639"}
    with rasterio.open(path, "w", transform=Affine(1000, 0, 5e5, 0, -1000, 28e5), **profile) as dataset:
        dataset.write(VALUES.astype(np.float32), 1)
    np.testing.assert_array_equal(read_field(path, lazily=True).values, read_field(path).values)


def test_no_more_than_a_window_and_some_tiles_is_in_memory():
    most = 0

    def read(rows, columns):
        nonlocal most
        most = max(most, (rows.stop - rows.start) * (columns.stop - columns.start))
        return VALUES[rows, columns]

    lon, lat = 50 + 0.01 * np.arange(140), 26 - 0.01 * np.arange(90)
    field = field_on_axes(OnFile(SHAPE, read, (4, 6)), lon, lat, unit="", source="here")
    ground_windows(field, 36_000, 36_000)
    assert most <= 8 * 12  # whole blocks of the file, as many as make a tile
    assert sum(tile.size for tile in field.values.tiles.values()) <= 1000
