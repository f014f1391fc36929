"""Land: the packaged coastline, and anybody's polygons in any format, cut to the box."""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np
import pyogrio
import pytest
import shapely

from sparsor.errors import AreaError
from sparsor.geodesy import BoundingBox
from sparsor.geodesy.land import land_of_file, packaged_land
from sparsor.plot import coastline

if TYPE_CHECKING:
    from pathlib import Path

DATA = files("sparsor.geodesy") / "data"
GULF = BoundingBox(45.5, 22.0, 58.1, 31.0)
REACH = (0.02, 0.02)


@pytest.mark.parametrize(
    ("lon_deg", "lat_deg", "land"),
    [
        (51.53, 25.28, True),  # Doha
        (50.55, 26.05, True),  # Bahrain, an island
        (46.70, 24.70, True),  # Riyadh
        (56.30, 27.22, True),  # Bandar Abbas
        (51.70, 25.30, False),  # off Doha
        (52.00, 27.00, False),
        (56.50, 26.55, False),  # the Strait of Hormuz
    ],
)
def test_the_packaged_land_is_where_it_is(lon_deg: float, lat_deg: float, land: bool) -> None:
    assert shapely.intersects_xy(packaged_land(GULF, REACH).polygons, lon_deg, lat_deg) == land


def test_its_edge_is_the_coastline_of_the_pictures() -> None:
    box = BoundingBox(50.5, 24.5, 52.0, 26.3)
    land = packaged_land(box, REACH).polygons
    points = np.concatenate([np.column_stack(piece) for piece in coastline(*box.as_tuple())])
    assert len(points) > 3000
    assert shapely.distance(land.boundary, shapely.points(points)).max() < 1e-5  # 1 m


def test_the_file_is_small_says_where_it_is_from_and_needs_no_pickle() -> None:
    with (DATA / "land.npz").open("rb") as stream:
        assert len(stream.read()) < 300_000
        stream.seek(0)
        data = np.load(stream, allow_pickle=False)
        assert "GSHHG" in str(data["attribution"])
        assert "LGPL-3.0-or-later" in str(data["attribution"])


@pytest.mark.parametrize("box", [(1.5, 25.0, 2.5, 26.0), (63.5, 25.0, 63.99, 26.0), (179.9, 20.0, -179.9, 20.2)])
def test_there_is_none_elsewhere(box: tuple[float, float, float, float]) -> None:
    with pytest.raises(
        AreaError, match=r"the packaged coastline is that of 40\.\.64 E, 18\.\.34 N; .*--coastline FILE"
    ):
        packaged_land(BoundingBox(*box), REACH)


def written(path: Path, *polygons: shapely.Geometry) -> Path:
    driver = {".geojson": "GeoJSON", ".kml": "LIBKML", ".gpkg": "GPKG", ".shp": "ESRI Shapefile"}[path.suffix]
    if path.suffix == ".kml" and driver not in pyogrio.list_drivers():
        driver = "KML"
    names = np.array([f"part {number}" for number in range(len(polygons))], dtype=object)
    shapes = np.array(shapely.to_wkb(list(polygons)), dtype=object)
    kind = polygons[0].geom_type
    pyogrio.raw.write(path, shapes, [names], ["Name"], geometry_type=kind, crs="EPSG:4326", driver=driver)
    return path


@pytest.mark.parametrize("suffix", [".geojson", ".kml", ".gpkg", ".shp"])
def test_every_vector_format_is_read(suffix: str, tmp_path: Path) -> None:
    lake = shapely.Polygon([(51, 25), (52, 25), (52, 26), (51, 26)], [[(51.4, 25.4), (51.6, 25.4), (51.5, 25.6)]])
    island = shapely.box(52.2, 25.1, 52.3, 25.2)
    box = BoundingBox(51.2, 25.2, 52.25, 25.8)
    land = land_of_file(written(tmp_path / f"land{suffix}", lake, island), box, REACH)
    assert land.source == f"land{suffix}"
    for place, wanted in (((51.3, 25.3), True), ((51.5, 25.5), False), ((52.1, 25.3), False), ((52.22, 25.19), True)):
        assert shapely.intersects_xy(land.polygons, *place) == wanted
    assert land.polygons.bounds == pytest.approx((51.18, 25.18, 52.27, 25.82))


@pytest.mark.parametrize("turn", [0.0, 360.0])
def test_land_across_the_antimeridian_is_whole(turn: float, tmp_path: Path) -> None:
    west, east = shapely.box(179.5, 10, 180, 11), shapely.box(-180 + turn, 10, -179.5 + turn, 11)
    path = written(tmp_path / "land.geojson", west, east)
    land = land_of_file(path, BoundingBox(179.8, 10.2, -179.8, 10.8), REACH)
    assert land.polygons.bounds == pytest.approx((179.78, 10.18, 180.22, 10.82))
    assert land.polygons.area == pytest.approx(0.44 * 0.64)


def test_what_is_no_land_is_named(tmp_path: Path) -> None:
    box = BoundingBox(51.2, 25.2, 51.8, 25.8)
    line = written(tmp_path / "line.geojson", shapely.LineString([(51, 25), (52, 26)]))
    with pytest.raises(AreaError, match="nothing but LineString geometry; a coastline needs a polygon"):
        land_of_file(line, box, REACH)
    bow = written(tmp_path / "bow.geojson", shapely.Polygon([(51, 25), (52, 26), (52, 25), (51, 26)]))
    with pytest.raises(AreaError, match=r"crosses itself or is none .*ogr2ogr -makevalid"):
        land_of_file(bow, box, REACH)
    assert land_of_file(bow, BoundingBox(1, 2, 1.5, 2.5), REACH).polygons.is_empty  # elsewhere it is no matter
    with pytest.raises(AreaError, match="there is no coastline file"):
        land_of_file(tmp_path / "none.shp", box, REACH)
