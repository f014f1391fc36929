"""Elevation models: where the ground is, in metres, whatever the file."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
import rasterio
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Transformer
from rasterio.transform import Affine

from sparsor.errors import TerrainError
from sparsor.geodesy.lengths import line_deg
from sparsor.geodesy.terrain import read_terrain
from terrains import Hills, hills, terrain_of, write_dem

if TYPE_CHECKING:
    from pathlib import Path

GROUND = hills(3)
PLACES = np.random.default_rng(1).uniform((51.495, 25.262), (51.54, 25.31), (200, 2)).T


def test_the_ground_is_bilinear(tmp_path: Path) -> None:
    terrain = terrain_of(write_dem(tmp_path / "dem.tif", GROUND))
    assert terrain.ground_m(*PLACES) == pytest.approx(GROUND.at(*PLACES), abs=1e-3)
    assert terrain.pixel_m == pytest.approx((28.0, 30.8), abs=0.1)
    assert (terrain.vertical, terrain.unit_said) == (None, False)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 5), st.tuples(*(st.floats(0, 1),) * 4), st.floats(0, 200))
def test_nothing_between_points_along_a_line_is_missed(
    tmp_path_factory: pytest.TempPathFactory, seed: int, ends: tuple[float, float, float, float], beside_m: float
) -> None:
    rng = np.random.default_rng(seed)
    rough = Hills(rng.uniform(0, 100, (330, 330)))  # every pixel another
    terrain = terrain_of(write_dem(tmp_path_factory.mktemp("dem") / "dem.tif", rough))
    start, end = ((51.5 + 0.03 * ends[k], 25.27 + 0.03 * ends[k + 1]) for k in (0, 2))
    along, lon, lat = line_deg(start, end, terrain.step_m)
    near = terrain.highest_m(lon, lat, beside_m + terrain.step_m / 2)
    fine = np.linspace(0, 1, 40 * along.size)
    exact = np.interp(fine * along[-1], along, lon), np.interp(fine * along[-1], along, lat)
    parts = np.clip(np.searchsorted(along, fine * along[-1]), 1, along.size - 1)
    allowed = np.maximum(near[parts - 1], near[parts])
    assert (rough.at(*exact) <= allowed + 1e-3).all()
    assert (rough.at(lon + beside_m / 101_000, lat) <= near + 1e-3).all()
    assert (rough.at(lon, lat - beside_m / 111_000) <= near + 1e-3).all()


@settings(max_examples=60, deadline=None)
@given(st.floats(0, 1), st.floats(0, 1), st.floats(0, 150))
def test_the_highest_ground_is_that_within_the_distance(
    tmp_path_factory: pytest.TempPathFactory, across: float, down: float, reach_m: float
) -> None:
    rough = Hills(np.random.default_rng(8).uniform(0, 100, (330, 330)))
    terrain = terrain_of(write_dem(tmp_path_factory.mktemp("dem") / "dem.tif", rough))
    lon, lat = 51.5 + 0.03 * across, 25.27 + 0.03 * down
    column, row = (lon - 51.47) * 3600 - 0.5, (25.33 - lat) * 3600 - 0.5
    reach = [reach_m / side for side in terrain.pixel_m]

    def peak(spare: float) -> float:
        """The highest of the pixels that the ground within a distance lies between, by their own rows and columns."""
        rows = slice(math.floor(row - spare * reach[1]), math.ceil(row + spare * reach[1]) + 1)
        columns = slice(math.floor(column - spare * reach[0]), math.ceil(column + spare * reach[0]) + 1)
        return float(rough.heights_m[rows, columns].max())

    found = float(terrain.highest_m(lon, lat, reach_m))
    assert peak(1.0) - 1e-3 <= found <= peak(1.05) + 1e-3
    assert found <= float(terrain.highest_m(lon + 1e-4, lat, reach_m + 10.2))


def test_a_turned_raster_in_metres(tmp_path: Path) -> None:
    """A plane surface, on a grid that is turned against north."""
    transform = Affine(20, 6, 549_000, 6, -20, 2_797_000)
    column, row = np.meshgrid(np.arange(300) + 0.5, np.arange(300) + 0.5)
    x, y = (549_000 + 20 * column + 6 * row, 2_797_000 + 6 * column - 20 * row)
    with rasterio.open(
        tmp_path / "utm.tif", "w", driver="GTiff", height=300, width=300, count=1, dtype="float64", crs="EPSG:32639",
        transform=transform,
    ) as file:  # fmt: skip
        file.write(100 + 0.02 * (x - 550_000) - 0.01 * (y - 2_796_000), 1)
    middle = (549_000 + 26 * 150, 2_797_000 - 14 * 150)
    lon, lat = Transformer.from_crs("EPSG:32639", "EPSG:4326", always_xy=True).transform(*middle)
    terrain = read_terrain(tmp_path / "utm.tif", [lon], [lat], 300.0)
    wanted = 100 + 0.02 * (middle[0] - 550_000) - 0.01 * (middle[1] - 2_796_000)
    assert float(terrain.ground_m(lon, lat)) == pytest.approx(wanted, abs=1e-3)
    assert terrain.pixel_m == pytest.approx((np.hypot(20, 6),) * 2, rel=1e-3)


def test_longitudes_that_begin_at_greenwich_and_go_round(tmp_path: Path) -> None:
    world = np.tile(np.arange(360.0), (180, 1))
    with rasterio.open(
        tmp_path / "world.tif", "w", driver="GTiff", height=180, width=360, count=1, dtype="float32", crs="EPSG:4326",
        transform=Affine(1, 0, 0, 0, -1, 90),
    ) as file:  # fmt: skip
        file.write(world.astype(np.float32), 1)
    terrain = read_terrain(tmp_path / "world.tif", [-100.0], [30.0], 300_000.0)
    assert float(terrain.ground_m(-100.0, 30.0)) == pytest.approx(259.5)


@pytest.mark.parametrize(
    ("unit", "metres"), [("ft", 0.3048), ("US survey foot", 1200 / 3937), ("metre", 1.0), ("m", 1.0)]
)
def test_the_unit_of_heights_counts(tmp_path: Path, unit: str, metres: float) -> None:
    terrain = terrain_of(write_dem(tmp_path / "dem.tif", GROUND, unit=unit))
    assert terrain.unit_said
    assert terrain.ground_m(*PLACES) == pytest.approx(metres * GROUND.at(*PLACES), abs=1e-3)


def test_the_reference_systems_heights(tmp_path: Path) -> None:
    said = terrain_of(write_dem(tmp_path / "egm.tif", GROUND, crs="EPSG:4326+5773"))
    assert "EGM96" in str(said.vertical)
    assert said.ground_m(*PLACES) == pytest.approx(GROUND.at(*PLACES), abs=1e-3)
    feet = terrain_of(write_dem(tmp_path / "navd.tif", GROUND, crs="EPSG:4326+6360"))  # NAVD88 height (ftUS)
    assert feet.ground_m(*PLACES) == pytest.approx(GROUND.at(*PLACES) * 1200 / 3937, abs=1e-3)


def test_gaps_and_edges_are_not_known(tmp_path: Path) -> None:
    gap = GROUND.heights_m.copy()
    gap[150, 150] = -9999
    terrain = terrain_of(write_dem(tmp_path / "dem.tif", Hills(gap), nodata=-9999))
    lon, lat = 51.47 + 150.6 / 3600, 25.33 - 150.4 / 3600
    assert np.isnan(terrain.ground_m(lon, lat))
    assert terrain.highest_m(lon, lat) == np.inf
    assert terrain.highest_m(lon + 8 / 3600, lat, 400.0) == np.inf
    assert np.isfinite(terrain.highest_m(lon + 8 / 3600, lat))
    assert np.isnan(terrain.ground_m(0.0, 0.0))
    assert terrain.highest_m(51.0, 25.29) == np.inf


BAD = {
    "fathoms": ({"unit": "fathom"}, "in 'fathom'"),
    "both": ({"unit": "ft", "crs": "EPSG:4326+5773"}, "one of them is wrong"),
    "placeless": ({"crs": None}, "does not say where it lies"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_used_is_refused(tmp_path: Path, case: str) -> None:
    about, words = BAD[case]
    with pytest.raises(TerrainError, match=words):
        terrain_of(write_dem(tmp_path / "dem.tif", GROUND, **about))


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(TerrainError, match="no terrain file"):
        terrain_of(tmp_path / "none.tif")
    (tmp_path / "text.tif").write_text("no raster")
    with pytest.raises(TerrainError, match="cannot be read"):
        terrain_of(tmp_path / "text.tif")
    deep = GROUND.heights_m.copy()
    deep[150, 150] = -9999
    with pytest.raises(TerrainError, match="beyond those of the ground on Earth"):
        terrain_of(write_dem(tmp_path / "deep.tif", Hills(deep)))
    with pytest.raises(TerrainError, match="does not cover the flight"):
        read_terrain(write_dem(tmp_path / "dem.tif", GROUND), [10.0], [50.0], 100.0)
    with rasterio.open(
        tmp_path / "rgb.tif", "w", driver="GTiff", height=20, width=20, count=3, dtype="uint8", crs="EPSG:4326",
        transform=Affine(0.01, 0, 51.4, 0, -0.01, 25.4),
    ) as file:  # fmt: skip
        file.write(np.zeros((3, 20, 20), dtype=np.uint8))
    with pytest.raises(TerrainError, match="3 bands"):
        terrain_of(tmp_path / "rgb.tif")
