"""Fields from NetCDF: variable and time by name, axes by CF, and what cannot be taken."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from sparsor.errors import FieldError
from sparsor.prior.reading import read_field

LON = np.array([50.0, 50.5, 51.0, 51.5])
LAT = np.array([24.0, 24.5, 25.0])
VALUES = np.arange(12.0).reshape(3, 4)  # row 0 southmost, as most models write


def degrees() -> dict[str, tuple[str, np.ndarray, dict[str, str]]]:
    return {
        "lat": ("lat", LAT, {"standard_name": "latitude", "units": "degrees_north"}),
        "lon": ("lon", LON, {"standard_name": "longitude", "units": "degrees_east"}),
    }


def monthly(months: int = 3) -> xr.Dataset:
    stack = VALUES + 100 * np.arange(months)[:, None, None]
    times = np.datetime64("2020-08-01", "ns") + np.arange(months) * np.timedelta64(31, "D")
    return xr.Dataset({"no2": (("time", "lat", "lon"), stack, {"units": "ppb"})}, coords={**degrees(), "time": times})


def write(tmp_path: Path, dataset: xr.Dataset, name: str = "a.nc", engine: str = "h5netcdf", **options: object) -> Path:
    dataset.to_netcdf(tmp_path / name, engine=engine, **options)
    return tmp_path / name


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
def test_the_only_variable_is_taken_north_up(tmp_path: Path, engine: str) -> None:
    dataset = xr.Dataset({"no2": (("lat", "lon"), VALUES, {"units": "ppb"})}, coords=degrees())
    dataset["lat_bnds"] = (("lat", "nv"), np.zeros((3, 2)))
    dataset["crs"] = 0
    field = read_field(write(tmp_path, dataset, engine=engine))
    np.testing.assert_array_equal(field.values, VALUES[::-1])
    np.testing.assert_array_equal(field.lat_deg, LAT[::-1])
    np.testing.assert_array_equal(field.lon_deg, LON)
    assert field.unit == "ppb"
    assert field.source.endswith("a.nc: no2")


def test_packed_values_are_unpacked_and_fill_values_are_gaps(tmp_path: Path) -> None:
    values = VALUES.copy()
    values[0, 0], values[2, 3] = np.nan, np.inf
    dataset = xr.Dataset({"no2": (("lat", "lon"), np.where(np.isinf(values), 3, values))}, coords=degrees())
    packing = {"no2": {"dtype": "int16", "scale_factor": 0.5, "add_offset": 10.0, "_FillValue": -1}}
    field = read_field(write(tmp_path, dataset, encoding=packing))
    np.testing.assert_allclose(field.values[2], [np.nan, 1, 2, 3])
    dataset = xr.Dataset({"no2": (("lat", "lon"), values)}, coords=degrees())
    assert np.isnan(read_field(write(tmp_path, dataset, "b.nc")).values[0, 3])


@pytest.mark.parametrize(
    ("lat", "lon"),
    [
        (("latitude", {}), ("longitude", {})),
        (("y", {"units": "degrees_N"}), ("x", {"units": "degrees_E"})),
        (("rows", {"standard_name": "latitude"}), ("columns", {"standard_name": "longitude"})),
        (("a", {"axis": "Y"}), ("b", {"axis": "X"})),
    ],
)
def test_axes_are_known_by_name_unit_or_axis_in_any_order(
    tmp_path: Path, lat: tuple[str, dict[str, str]], lon: tuple[str, dict[str, str]]
) -> None:
    names = (lon[0], lat[0])
    dataset = xr.Dataset(
        {"no2": (names, VALUES.T)},
        coords={lat[0]: (lat[0], LAT, lat[1]), lon[0]: (lon[0], LON, lon[1])},
    )
    np.testing.assert_array_equal(read_field(write(tmp_path, dataset)).values, VALUES[::-1])


def test_longitudes_of_0_to_360(tmp_path: Path) -> None:
    dataset = xr.Dataset({"no2": (("lat", "lon"), VALUES)}, coords=degrees())
    field = read_field(write(tmp_path, dataset.assign_coords(lon=LON + 250)))
    np.testing.assert_allclose(field.lon_deg, LON - 110)


def test_several_variables_want_a_choice(tmp_path: Path) -> None:
    dataset = monthly(1).assign(so2=(("lat", "lon"), -VALUES), profile=("lat", LAT))
    path = write(tmp_path, dataset)
    with pytest.raises(FieldError, match=r"2 variables; choose one with --variable: no2, so2"):
        read_field(path)
    assert read_field(path, variable="SO2").values.max() == 0
    with pytest.raises(FieldError, match=r"no variable 'o3'; there are: no2, so2"):
        read_field(path, variable="o3")
    with pytest.raises(FieldError, match=r"'profile' is not on latitudes and longitudes; there are: no2, so2"):
        read_field(path, variable="profile")


@pytest.mark.parametrize(
    ("time", "step"),
    [(1, 1), ("1", 1), (-1, 2), ("2020-09", 1), ("2020-10-02", 2), ("2020-08-01T00:00:00Z", 0)],
)
def test_a_time_step_is_chosen_by_index_or_date(tmp_path: Path, time: object, step: int) -> None:
    field = read_field(write(tmp_path, monthly()), time=time)
    np.testing.assert_array_equal(field.values, VALUES[::-1] + 100 * step)
    assert field.source.split(", ")[1].startswith(["2020-08-01", "2020-09-01", "2020-10-02"][step])


def test_time_steps_that_are_not_there_are_refused_with_those_that_are(tmp_path: Path) -> None:
    path = write(tmp_path, monthly())
    with pytest.raises(FieldError, match=r"3 time steps.*2020-08-01, 2020-09-01, 2020-10-02"):
        read_field(path)
    for time in (3, "2021", "2020-09-15", "autumn"):
        with pytest.raises(FieldError, match=rf"no time step '{time}'.*2020-08-01, 2020-09-01"):
            read_field(path, time=time)
    with pytest.raises(FieldError, match=r"'2020' fits 3 time steps"):
        read_field(path, time="2020")
    single = write(tmp_path, monthly(1), "b.nc")
    np.testing.assert_array_equal(read_field(single).values, VALUES[::-1])
    with pytest.raises(FieldError, match=r"no time step '2021'"):
        read_field(single, time="2021")


def test_further_dimensions_are_dropped_when_single_else_refused(tmp_path: Path) -> None:
    dataset = monthly(1).expand_dims(level=[2.0])
    np.testing.assert_array_equal(read_field(write(tmp_path, dataset)).values, VALUES[::-1])
    deep = xr.concat([dataset, dataset.assign_coords(level=[3.0])], dim="level")
    with pytest.raises(FieldError, match=r"further dimensions \(level of 2\).*ncks -d level,0"):
        read_field(write(tmp_path, deep, "b.nc"))


def test_what_has_no_regular_axes_says_why(tmp_path: Path) -> None:
    lat, lon = np.meshgrid(LAT, LON, indexing="ij")
    curved = xr.Dataset({"no2": (("j", "i"), VALUES)}, coords={"lat": (("j", "i"), lat), "lon": (("j", "i"), lon)})
    with pytest.raises(FieldError, match=r"curvilinear"):
        read_field(write(tmp_path, curved, "a.nc"))
    projected = xr.Dataset(
        {"no2": (("y", "x"), VALUES)},
        coords={
            "y": ("y", LAT * 1e5, {"standard_name": "projection_y_coordinate"}),
            "x": ("x", LON * 1e5, {"standard_name": "projection_x_coordinate"}),
        },
    )
    with pytest.raises(FieldError, match=r"projected coordinates.*gdalwarp"):
        read_field(write(tmp_path, projected, "b.nc"))
    with pytest.raises(FieldError, match=r"no variable on latitudes and longitudes; it holds: no2"):
        read_field(write(tmp_path, xr.Dataset({"no2": (("a", "b"), VALUES)}), "c.nc"))
    uneven = xr.Dataset({"no2": (("lat", "lon"), VALUES)}, coords={"lat": [0, 1, 3.0], "lon": LON})
    with pytest.raises(FieldError, match=r"latitudes are not evenly spaced"):
        read_field(write(tmp_path, uneven, "d.nc"))


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
@pytest.mark.parametrize("share", [0.01, 0.1, 0.5, 0.9])
def test_a_truncated_file_says_so(tmp_path: Path, engine: str, share: float) -> None:
    contents = write(tmp_path, monthly(1), engine=engine).read_bytes()
    cut = tmp_path / "cut.nc"
    cut.write_bytes(contents[: max(12, int(len(contents) * share))])
    with pytest.raises(FieldError, match=r"cut\.nc: cannot be read as NetCDF.*is the file complete"):
        read_field(cut)


def test_other_kinds_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path, monthly(1))
    with pytest.raises(FieldError, match=r"NetCDF file, which takes no --field-bbox"):
        read_field(path, box=(0, 0, 1, 1))
    (tmp_path / "new.nc").write_bytes(b"CDF\x05" + bytes(40))
    with pytest.raises(FieldError, match=r"nccopy -k nc4"):
        read_field(tmp_path / "new.nc")
