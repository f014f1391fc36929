"""The files of a map, read back by readers that we did not write, lie where the map lies."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

import numpy as np
import pytest
import rasterio
import xarray as xr
from rasterio.io import MemoryFile

from sparsor.fieldmap.geotiff import map_geotiff
from sparsor.fieldmap.netcdf import map_netcdf
from sparsor.fieldmap.samples_csv import samples_csv
from sparsor.flightlog import read_log, samples

from .maps import ACROSS, BOX, NAME, example_map, example_samples

if TYPE_CHECKING:
    from pathlib import Path

    from sparsor.fieldmap.fieldmap import FieldMap


def inside(field_map: FieldMap) -> np.ndarray:
    return field_map.allowed.reshape(field_map.grid.shape)


def test_the_geotiff_has_the_boxs_corners_and_says_what_it_holds() -> None:
    field_map = example_map()
    with MemoryFile(map_geotiff(field_map)) as memory, memory.open() as dataset:
        assert dataset.crs.to_epsg() == 4326
        assert tuple(dataset.bounds) == pytest.approx(BOX, abs=1e-12)
        assert (dataset.height, dataset.width) == field_map.grid.shape
        assert dataset.descriptions == ("NO2", "standard deviation of NO2", "measured")
        assert dataset.units == ("ug/m3", "ug/m3", "1")
        assert np.isnan(dataset.nodata)
        tags = dataset.tags()
        assert tags["AREA_OR_POINT"] == "Area"
        assert (tags["mission"], tags["logs"]) == (NAME, field_map.facts["logs"])


@pytest.mark.parametrize("factor", [1, 3])
def test_every_cell_of_the_geotiff_is_found_at_its_place(factor: int) -> None:
    field_map = example_map(factor=factor)
    lon, lat = field_map.grid.centres_deg()
    wanted = field_map.layers().values[factor // 2 :: factor, factor // 2 :: factor].ravel()
    with MemoryFile(map_geotiff(field_map)) as memory, memory.open() as dataset:
        value, deviation, measured = np.array(list(dataset.sample(np.column_stack((lon, lat)).tolist()))).T
    np.testing.assert_allclose(value, wanted)  # NaN outside the area
    assert np.isnan(value[~field_map.allowed]).all()
    kept = field_map.allowed
    np.testing.assert_allclose(deviation[kept], field_map.standard_deviation[kept], rtol=1e-6)
    np.testing.assert_array_equal(measured[kept], field_map.measured[kept])


def test_a_box_across_the_antimeridian_runs_on_eastward() -> None:
    field_map = example_map(ACROSS)
    with MemoryFile(map_geotiff(field_map)) as memory, memory.open() as dataset:
        assert tuple(dataset.bounds) == pytest.approx((179.9, -17.0, 180.1, -16.8))
    with xr.open_dataset(io.BytesIO(map_netcdf(field_map)), engine="h5netcdf") as dataset:
        assert np.all(np.diff(dataset.lon) > 0)
        assert float(dataset.lon_bnds.max()) == pytest.approx(180.1)


@pytest.mark.parametrize("factor", [1, 2])
def test_the_netcdf_has_the_boxs_corners_and_follows_cf(factor: int) -> None:
    field_map = example_map(factor=factor)
    with xr.open_dataset(io.BytesIO(map_netcdf(field_map)), engine="h5netcdf") as dataset:
        west, south, east, north = BOX
        edges = (dataset.lon_bnds.min(), dataset.lat_bnds.min(), dataset.lon_bnds.max(), dataset.lat_bnds.max())
        assert [float(edge) for edge in edges] == pytest.approx([west, south, east, north], abs=1e-12)
        assert dataset.lat[0] > dataset.lat[-1]
        np.testing.assert_allclose(dataset.NO2.values, field_map.layers().values)
        measured = dataset.NO2_measured.values[::factor, ::factor].ravel()
        np.testing.assert_array_equal(measured, field_map.measured)
        assert dataset.attrs["Conventions"].startswith("CF-1.")
        assert dataset.attrs["mission"] == NAME
        assert dataset.NO2.attrs["units"] == "ug/m3"
        for name in dataset.NO2.attrs["ancillary_variables"].split():
            assert dataset[name].dims == dataset.NO2.dims
        assert dataset[dataset.NO2.encoding.get("grid_mapping") or dataset.NO2.attrs["grid_mapping"]].attrs[
            "grid_mapping_name"
        ] == ("latitude_longitude")
        for axis, unit in (("lat", "degrees_north"), ("lon", "degrees_east")):
            assert dataset[axis].attrs["units"] == unit
            bounds = dataset[f"{axis}_bnds"].values
            assert dataset[axis].attrs.get("bounds", dataset[axis].encoding.get("bounds")) == f"{axis}_bnds"
            np.testing.assert_allclose(bounds.mean(axis=1), dataset[axis].values)


def test_gdal_finds_the_netcdf_where_the_geotiff_is(tmp_path: Path) -> None:
    field_map = example_map()
    path = tmp_path / "map.nc"
    path.write_bytes(map_netcdf(field_map))
    with MemoryFile(map_geotiff(field_map)) as memory, memory.open() as tif:
        wanted, transform = tif.read(1), tif.transform
    with rasterio.open(f"netcdf:{path}:NO2") as dataset:
        assert tuple(dataset.transform) == pytest.approx(tuple(transform), abs=1e-12)
        assert dataset.crs.to_epsg() == 4326
        np.testing.assert_allclose(dataset.read(1), wanted)


def test_our_own_readers_of_fields_take_the_map(tmp_path: Path) -> None:
    from sparsor.prior.reading import read_field

    field_map = example_map()
    (tmp_path / "map.tif").write_bytes(map_geotiff(field_map))
    (tmp_path / "map.nc").write_bytes(map_netcdf(field_map))
    for name in ("map.tif", "map.nc"):
        field = read_field(tmp_path / name, variable="NO2")
        assert field.unit == "ug/m3"
        assert np.nanmax(field.values) == field_map.values[field_map.allowed].max()


@pytest.mark.parametrize("write", [map_geotiff, map_netcdf])
def test_the_same_map_gives_the_same_bytes(write) -> None:
    assert write(example_map()) == write(example_map())


def test_the_table_of_samples_reads_back() -> None:
    flown = example_samples()
    rows = list(csv.DictReader(io.StringIO(samples_csv(flown).decode())))
    assert list(rows[0])[:7] == ["time_s", "lon_deg", "lat_deg", "alt_m", "value", "clock", "used"]
    assert [row["reason"] for row in rows] == flown.reason.tolist()
    assert [row["used"] == "1" for row in rows] == flown.used.tolist()
    assert rows[3]["alt_m"] == ""
    for name in ("time_s", "lon_deg", "lat_deg", "value"):
        np.testing.assert_allclose([float(row[name]) for row in rows], getattr(flown, name), atol=1e-8, rtol=1e-8)


def test_the_table_of_samples_is_a_log(tmp_path: Path) -> None:
    flown = example_samples()
    one_boot = flown.boot == 0
    path = tmp_path / "samples.csv"
    path.write_bytes(b"\n".join(samples_csv(flown).splitlines()[: one_boot.sum() + 1]))
    again = samples(read_log(path))
    np.testing.assert_allclose(again.value, flown.value[one_boot], rtol=1e-8)
    np.testing.assert_allclose(again.lon_deg, flown.lon_deg[one_boot], atol=1e-7)
    np.testing.assert_allclose(np.diff(again.time_s), np.diff(flown.time_s[one_boot]), atol=1e-6)


def test_arrays_that_do_not_fit_the_grid_are_refused() -> None:
    with pytest.raises(ValueError, match=r"measured has shape \(3,\); the grid has 600 cells"):
        example_map(measured=np.ones(3, dtype=bool))
    with pytest.raises(ValueError, match="no whole multiple"):
        example_map(finer=np.ones(601))
