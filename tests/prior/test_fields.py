"""Fields: axes in any order, rasters in any CRS, and what is not a field."""

from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine, from_bounds, from_origin
from rasterio.warp import transform

from sparsor.errors import FieldError
from sparsor.prior.field import Field, field_on_axes
from sparsor.prior.reading import read_field
from sparsor.prior.resampling import sample_at

WGS84 = "EPSG:4326"


def write_tif(path: Path, bands: np.ndarray, **profile: object) -> Path:
    """Write bands (count, rows, columns) with rasterio; descriptions, units, scales and mask by keyword."""
    bands = bands if bands.ndim == 3 else bands[None]
    extras = {key: profile.pop(key) for key in ("descriptions", "units", "scales", "offsets") if key in profile}
    mask = profile.pop("mask", None)
    shape = {"count": bands.shape[0], "height": bands.shape[1], "width": bands.shape[2], "dtype": bands.dtype}
    with rasterio.open(path, "w", driver="GTiff", **shape, **profile) as dataset:
        dataset.write(bands)
        for key, value in extras.items():
            setattr(dataset, key, value)
        if mask is not None:
            dataset.write_mask(mask)
    return path


def turned(east: float, north: float, pixel: float, turn: float) -> Affine:
    """Place square pixels, turned by degrees, at a north-west corner."""
    cos, sin = pixel * np.cos(np.radians(turn)), pixel * np.sin(np.radians(turn))
    return Affine(cos, sin, east, sin, -cos, north)


def smooth(lon: np.ndarray, lat: np.ndarray) -> np.ndarray:
    return 10 + 3 * np.sin(40 * np.radians(lon)) + 2 * np.cos(50 * np.radians(lat))


def test_north_up_degrees_are_taken_as_they_are(tmp_path: Path) -> None:
    values = np.arange(12, dtype=np.float32).reshape(3, 4)
    path = write_tif(tmp_path / "a.tif", values, crs=WGS84, transform=from_origin(50, 26, 0.5, 0.25), units=["ppb"])
    field = read_field(path)
    np.testing.assert_array_equal(field.values, values)
    np.testing.assert_allclose(field.lon_deg, [50.25, 50.75, 51.25, 51.75])
    np.testing.assert_allclose(field.lat_deg, [25.875, 25.625, 25.375])
    assert (field.unit, field.source) == ("ppb", str(path))


def test_a_south_up_raster_is_turned(tmp_path: Path) -> None:
    values = np.arange(12, dtype=np.float64).reshape(3, 4)
    turned = write_tif(tmp_path / "a.tif", values[::-1], crs=WGS84, transform=Affine(0.5, 0, 50, 0, 0.25, 25.25))
    np.testing.assert_array_equal(read_field(turned).values, values)
    assert read_field(turned).edges_deg == pytest.approx((50, 25.25, 52, 26))


def test_no_data_masks_and_infinities_become_gaps(tmp_path: Path) -> None:
    values = np.arange(20, dtype=np.float32).reshape(4, 5)
    values[0, 0], values[1, 1] = -999, np.inf
    mask = np.full(values.shape, 255, dtype=np.uint8)
    place = {"crs": WGS84, "transform": from_origin(0, 4, 1, 1)}
    gaps = np.isnan(read_field(write_tif(tmp_path / "a.tif", values, nodata=-999, **place)).values)
    assert np.argwhere(gaps).tolist() == [[0, 0], [1, 1]]
    mask[3, 4] = 0
    gaps = np.isnan(read_field(write_tif(tmp_path / "b.tif", values, mask=mask, **place)).values)
    assert np.argwhere(gaps).tolist() == [[1, 1], [3, 4]]


def test_scale_and_offset_apply_to_values_not_to_no_data(tmp_path: Path) -> None:
    raw = np.array([[0, 10], [20, -1]], dtype=np.int16)
    path = write_tif(
        tmp_path / "a.tif",
        raw,
        crs=WGS84,
        transform=from_origin(0, 2, 1, 1),
        nodata=-1,
        scales=[0.5],
        offsets=[100.0],
    )
    np.testing.assert_allclose(read_field(path).values, [[100, 105], [110, np.nan]])


def test_bands_are_chosen_by_name_or_number(tmp_path: Path) -> None:
    bands = np.stack([np.full((3, 3), 1.0), np.full((3, 3), 2.0)])
    path = write_tif(
        tmp_path / "a.tif",
        bands,
        crs=WGS84,
        transform=from_origin(0, 3, 1, 1),
        descriptions=["no2", "so2"],
        units=["ppb", "ug/m3"],
    )
    for wanted, value, unit in (("SO2", 2.0, "ug/m3"), ("1", 1.0, "ppb")):
        field = read_field(path, variable=wanted)
        assert (field.values[0, 0], field.unit) == (value, unit)
    with pytest.raises(FieldError, match=r"2 bands; choose one with --variable: 1 no2, 2 so2"):
        read_field(path)
    with pytest.raises(FieldError, match=r"no band 'o3'.*1 no2, 2 so2"):
        read_field(path, variable="o3")


@pytest.mark.parametrize(
    ("crs", "east", "north", "pixel", "turn"),
    [
        ("EPSG:32639", 500_000, 2_800_000, 500.0, 0.0),
        ("EPSG:32639", 500_000, 2_800_000, 500.0, 30.0),
        ("EPSG:32633", 400_000, 6_900_000, 500.0, 0.0),
        ("EPSG:32760", 780_000, 8_050_000, 500.0, 0.0),  # Fiji, across the antimeridian
        ("EPSG:3857", 5_700_000, 2_900_000, 500.0, 0.0),
    ],
)
def test_projected_rasters_give_the_truth_at_longitude_and_latitude(
    tmp_path: Path, crs: str, east: float, north: float, pixel: float, turn: float
) -> None:
    step = turned(east, north, pixel, turn)
    column, row = np.meshgrid(np.arange(100) + 0.5, np.arange(80) + 0.5)
    x, y = step.a * column + step.b * row + step.c, step.d * column + step.e * row + step.f
    lon, lat = (np.reshape(axis, x.shape) for axis in transform(crs, WGS84, x.ravel(), y.ravel()))
    field = read_field(write_tif(tmp_path / "a.tif", smooth(lon, lat), crs=crs, transform=step))

    truth = smooth(*np.meshgrid(field.lon_deg, field.lat_deg))
    inside = np.isfinite(field.values)
    assert inside.mean() > (0.5 if turn else 0.85)
    # Bilinear between pixels of 500 m misses by at most an eighth of the second differences; the outer half
    # pixel, where the edge value is kept, by half a first difference.
    assert np.abs(field.values - truth)[inside].max() < 0.012
    inner = sample_at(field, lon[2:-2, 2:-2], lat[2:-2, 2:-2])
    assert np.isfinite(inner).all()
    assert np.abs(inner - smooth(lon, lat)[2:-2, 2:-2]).max() < 5e-4
    # The pixels keep their size in the middle of the raster.
    assert field.values.size * inside.mean() == pytest.approx(8000, rel=0.05)
    assert field.notes


@pytest.mark.parametrize(
    ("crs", "half_m", "least"),
    [("+proj=sinu +R=6371007.181", (2.0e7, 1.0e7), 0.99), ("EPSG:3413", (2.0e6, 2.0e6), 0.75)],
)
def test_a_world_and_a_pole_are_whole(tmp_path: Path, crs: str, half_m: tuple[float, float], least: float) -> None:
    place = from_bounds(-half_m[0], -half_m[1], half_m[0], half_m[1], 180, 90)
    field = read_field(write_tif(tmp_path / "a.tif", np.ones((90, 180)), crs=crs, transform=place))
    assert np.isfinite(field.values).mean() > least
    assert -180.001 <= field.edges_deg[0] < -178
    assert field.lon_deg.size > 100


def test_a_crs_that_lies_nowhere_is_refused(tmp_path: Path) -> None:
    nowhere = 'LOCAL_CS["x",UNIT["metre",1]]'
    path = write_tif(tmp_path / "a.tif", np.ones((9, 9)), crs=nowhere, transform=from_origin(0, 9, 1, 1))
    with pytest.raises(FieldError, match=r"a\.tif: cannot be read as a raster"):
        read_field(path)


def test_gaps_survive_reprojection(tmp_path: Path) -> None:
    values = np.ones((60, 60))
    values[30, 30] = np.nan
    values[10:20, 40:50] = np.nan
    path = write_tif(
        tmp_path / "a.tif", values, crs="EPSG:32639", transform=from_origin(500_000, 2_800_000, 1000, 1000)
    )
    field = read_field(path)
    x, y = np.array([530_500.0, 545_000.0]), np.array([2_769_500.0, 2_785_000.0])
    lon, lat = transform("EPSG:32639", WGS84, x, y)
    for k in range(2):
        row = np.abs(field.lat_deg - lat[k]).argmin()
        column = np.abs(field.lon_deg - lon[k]).argmin()
        assert np.isnan(field.values[row, column])
    finite = field.values[np.isfinite(field.values)]
    np.testing.assert_allclose(finite, 1.0, rtol=1e-12)


def test_longitudes_of_0_to_360_come_back_to_180(tmp_path: Path) -> None:
    world = np.broadcast_to(np.arange(36.0), (17, 36)).copy()
    path = write_tif(tmp_path / "a.tif", world, crs=WGS84, transform=from_bounds(0, -85, 360, 85, 36, 17))
    field = read_field(path)
    np.testing.assert_allclose(field.lon_deg, np.arange(-175, 180, 10))
    np.testing.assert_array_equal(field.values[0], np.r_[18:36, 0:18])


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ([200, 210, 220], [-160, -150, -140]),
        ([170, 180, 190], [170, 180, 190]),
        ([170, 180, -170], [170, 180, 190]),
        ([-200, -190, -180], [160, 170, 180]),
        ([30, 20, 10], [10, 20, 30]),
    ],
)
def test_longitudes_ascend_from_within_180(given: list[float], wanted: list[float]) -> None:
    field = field_on_axes(np.tile(given, (2, 1)), given, [1, 0], unit="", source="here")
    np.testing.assert_allclose(field.lon_deg, wanted)
    np.testing.assert_allclose((field.values[0] - field.lon_deg) % 360, 0)


def test_a_repeated_first_column_round_the_world_is_left_out() -> None:
    field = field_on_axes(np.zeros((2, 37)), np.arange(0, 361, 10), [1, 0], unit="", source="here")
    assert field.lon_deg.size == 36


def test_a_raster_without_crs_wants_a_box_and_takes_one(tmp_path: Path) -> None:
    with pytest.warns(rasterio.errors.NotGeoreferencedWarning):
        path = write_tif(tmp_path / "a.tif", np.arange(6.0).reshape(2, 3))
    with pytest.raises(FieldError, match=r"no CRS.*--field-bbox"):
        read_field(path)
    field = read_field(path, box=(50, 24, 53, 26))
    assert field.edges_deg == pytest.approx((50, 24, 53, 26))
    np.testing.assert_array_equal(field.values, np.arange(6.0).reshape(2, 3))


def test_options_that_do_not_apply_are_refused(tmp_path: Path) -> None:
    path = write_tif(tmp_path / "a.tif", np.ones((3, 3)), crs=WGS84, transform=from_origin(0, 3, 1, 1))
    with pytest.raises(FieldError, match=r"says itself where it lies"):
        read_field(path, box=(0, 0, 1, 1))
    with pytest.raises(FieldError, match=r"raster, which takes no time step"):
        read_field(path, time=0)
    with pytest.raises(FieldError, match=r"--field-bbox"):
        read_field(path, colormap="viridis")


def test_what_is_not_a_raster_says_so(tmp_path: Path) -> None:
    good = write_tif(tmp_path / "a.tif", np.ones((30, 30)), crs=WGS84, transform=from_origin(0, 3, 0.1, 0.1))
    contents = good.read_bytes()
    for name, content in (("text.tif", b"no raster\n" * 9), ("half.tif", contents[: len(contents) // 2])):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(FieldError, match=rf"{name}: cannot be read as a raster.*give a GeoTIFF"):
            read_field(tmp_path / name)
    (tmp_path / "none.tif").touch()
    with pytest.raises(FieldError, match=r"empty \(0 bytes\)"):
        read_field(tmp_path / "none.tif")
    with pytest.raises(FieldError, match=r"cannot read '.*gone.tif': No such file"):
        read_field(tmp_path / "gone.tif")
    with pytest.raises(FieldError, match=r"is a folder; give a file"):
        read_field(tmp_path)


def test_all_gaps_is_no_field(tmp_path: Path) -> None:
    path = write_tif(tmp_path / "a.tif", np.full((3, 3), -1.0), nodata=-1, crs=WGS84, transform=from_origin(0, 3, 1, 1))
    with pytest.raises(FieldError, match=r"a\.tif: the field is empty: not one of its 9 values"):
        read_field(path)


def test_a_field_is_checked_when_made() -> None:
    with pytest.raises(FieldError, match=r"values of shape \(2, 3\) do not fit"):
        Field(np.ones((2, 3)), np.arange(2.0), np.arange(2.0)[::-1], "", "here")
    with pytest.raises(FieldError, match=r"longitudes are not evenly spaced"):
        Field(np.ones((2, 3)), np.array([0, 1, 3.0]), np.array([1.0, 0]), "", "here")
    with pytest.raises(FieldError, match=r"not degrees"):
        field_on_axes(np.ones((2, 2)), [0, 1], [100, 99], unit="", source="here")
