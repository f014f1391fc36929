"""Areas: what is read, what is joined at the antimeridian, what is refused and with which words."""

from __future__ import annotations

import json
import re
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyproj import Transformer

from sparsor.errors import AreaError
from sparsor.geodesy import Area, BoundingBox, Grid, cells_inside, read_area
from strategies import boxes

if TYPE_CHECKING:
    from collections.abc import Callable

GEO = Path(__file__).resolve().parents[2] / "geo"
DOHA = (51.50, 25.27, 51.53, 25.30)
TRIANGLE = [[51.50, 25.27], [51.53, 25.27], [51.515, 25.30], [51.50, 25.27]]
KML = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2"><Document><name>file</name>{}</Document></kml>"""
PLACEMARK = """<Placemark><name>{name}</name><Polygon><outerBoundaryIs><LinearRing><coordinates>{ring}
</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>"""


def rectangle(west: float, south: float, east: float, north: float) -> list[list[float]]:
    return [[west, south], [east, south], [east, north], [west, north], [west, south]]


def placemark(name: str, ring: list[list[float]]) -> str:
    return PLACEMARK.format(name=name, ring=" ".join(f"{lon},{lat},0" for lon, lat in ring))


@pytest.fixture
def geojson(tmp_path: Path) -> Callable[..., Path]:
    """Write geometries, given as (type, coordinates), to a file and return it."""

    def write(*geometries: tuple[str, Any], names: tuple[str, ...] = (), **more: object) -> Path:
        features = [
            {
                "type": "Feature",
                "properties": {"name": names[index]} if names else {},
                "geometry": {"type": kind, "coordinates": coordinates},
            }
            for index, (kind, coordinates) in enumerate(geometries)
        ]
        path = tmp_path / "area.geojson"
        path.write_text(json.dumps({"type": "FeatureCollection", "features": features, **more}))
        return path

    return write


@pytest.mark.parametrize("path", sorted(GEO.glob("*.geojson")), ids=lambda path: path.stem)
def test_the_areas_in_geo_can_be_used(path: Path) -> None:
    area = read_area(path)
    assert cells_inside(Grid(area.box), area).sum() > 500
    for feature in json.loads(path.read_text())["features"]:
        assert feature["properties"]["name"]
        assert feature["properties"]["description"]


def test_the_areas_in_geo_are_where_they_should_be() -> None:
    assert read_area(GEO / "gulf.geojson").box.as_tuple() == (45.5, 22.0, 58.1, 31.0)
    assert read_area(GEO / "gulf.geojson").is_box
    assert read_area(GEO / "doha.geojson").box.as_tuple() == DOHA
    assert not read_area(GEO / "doha.geojson").is_box


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow], max_examples=30)
@given(box=boxes())
def test_a_rectangle_is_its_box(box: BoundingBox, geojson: Callable[..., Path]) -> None:
    west, south, east, north = box.as_tuple()
    area = read_area(geojson(("Polygon", [rectangle(west, south, east, north)])))
    assert area.is_box
    np.testing.assert_allclose(area.box.as_tuple(), box.as_tuple(), rtol=0, atol=1e-9)
    assert cells_inside(Grid(area.box), area).all()


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow], max_examples=30)
@given(box=boxes(across=True), style=st.sampled_from(["cut", "jump", "above 180"]))
def test_all_ways_to_cross_the_antimeridian_are_the_same_area(
    box: BoundingBox, style: str, geojson: Callable[..., Path]
) -> None:
    west, south, east, north = box.as_tuple()
    if style == "cut":  # RFC 7946, section 3.1.9
        halves = [[rectangle(west, south, 180.0, north)], [rectangle(-180.0, south, east, north)]]
        area = read_area(geojson(("MultiPolygon", halves)))
    else:
        to = east if style == "jump" else east + 360.0
        area = read_area(geojson(("Polygon", [rectangle(west, south, to, north)])))
    assert area.polygon.geom_type == "Polygon"
    assert area.is_box
    np.testing.assert_allclose(area.box.as_tuple(), box.as_tuple(), rtol=0, atol=1e-9)
    assert cells_inside(Grid(area.box), area).all()


def test_holes_and_parts_are_respected(geojson: Callable[..., Path]) -> None:
    ring_with_hole = [rectangle(50.0, 25.0, 52.0, 27.0), rectangle(50.5, 25.5, 51.5, 26.5)[::-1]]
    path = geojson(("MultiPolygon", [ring_with_hole, [rectangle(53.0, 25.0, 54.0, 27.0)]]), names=("A",))
    area = read_area(path)
    assert area.name == "A"
    assert area.source == str(path)
    assert area.box == BoundingBox(50.0, 25.0, 54.0, 27.0)
    inside = cells_inside(Grid(area.box), area).reshape(32, 32)
    assert inside.mean() == pytest.approx(1 - (0.25 * 0.5 + 0.25), abs=0.03)
    assert not inside[16, 8]  # in the hole
    assert not inside[16, 20]  # between the parts
    assert inside[16, 2]
    assert inside[16, 28]


def test_a_hole_across_the_antimeridian_stays_in_its_polygon(geojson: Callable[..., Path]) -> None:
    shell, hole = rectangle(178.0, 0.0, -178.0, 4.0), rectangle(-179.5, 1.0, -179.0, 3.0)[::-1]
    area = read_area(geojson(("Polygon", [shell, hole])))
    assert area.polygon.area == pytest.approx(16 - 1)
    assert not cells_inside(Grid(area.box), area).reshape(32, 32)[16, 22]


def test_cells_are_inside_when_their_centre_is(geojson: Callable[..., Path]) -> None:
    area = read_area(geojson(("Polygon", [TRIANGLE])))
    grid = Grid(area.box)
    lon, lat = grid.centres_deg()
    height = (lat - 25.27) / 0.03
    expected = np.abs(lon - 51.515) <= 0.015 * (1 - height)
    np.testing.assert_array_equal(cells_inside(grid, area), expected)


def test_several_features_are_one_area_named_after_the_file(geojson: Callable[..., Path]) -> None:
    left, right = rectangle(51.50, 25.27, 51.52, 25.30), rectangle(51.51, 25.27, 51.53, 25.30)
    area = read_area(geojson(("Polygon", [left]), ("Polygon", [right]), names=("left", "right")))
    assert area.name == "area"
    assert area.is_box
    assert area.box == BoundingBox(*DOHA)


def test_points_and_lines_beside_a_polygon_do_not_count(geojson: Callable[..., Path]) -> None:
    path = geojson(("Point", [0, 0]), ("Polygon", [TRIANGLE]), ("LineString", [[0, 0], [1, 1]]))
    assert read_area(path).box == BoundingBox(*DOHA)


def test_kml_folders_and_kmz(tmp_path: Path) -> None:
    west, east = rectangle(51.50, 25.27, 51.51, 25.30), rectangle(51.52, 25.27, 51.53, 25.30)
    folders = f"<Folder>{placemark('w', west)}</Folder><Folder>{placemark('e', east)}</Folder>"
    kml, kmz = tmp_path / "two.kml", tmp_path / "two.kmz"
    kml.write_text(KML.format(folders))
    with zipfile.ZipFile(kmz, "w") as archive:
        archive.write(kml, "doc.kml")
    for path in (kml, kmz):
        area = read_area(path)
        assert area.box.as_tuple() == pytest.approx(DOHA, abs=1e-12)
        assert area.name == "two"
        assert len(shapely.get_parts(area.polygon)) == 2


def test_kml_names_its_placemark(tmp_path: Path) -> None:
    path = tmp_path / "one.kml"
    path.write_text(KML.format(placemark("Al Bidda", TRIANGLE)))
    assert read_area(path).name == "Al Bidda"


def test_other_reference_systems_are_brought_to_degrees(geojson: Callable[..., Path]) -> None:
    to_utm = Transformer.from_crs("EPSG:4326", "EPSG:32639", always_xy=True)
    ring = [list(to_utm.transform(lon, lat)) for lon, lat in TRIANGLE]
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32639"}}
    area = read_area(geojson(("Polygon", [ring]), crs=crs))
    assert area.box.as_tuple() == pytest.approx(DOHA, abs=1e-8)
    assert area.polygon.symmetric_difference(shapely.Polygon(TRIANGLE)).area < 1e-3 * area.polygon.area


@pytest.mark.parametrize(
    ("geometry", "words"),
    [
        (("Point", [51.5, 25.3]), "nothing but Point geometry; an area needs a polygon"),
        (("LineString", TRIANGLE), "nothing but LineString geometry; an area needs a polygon"),
        (("Polygon", []), "is empty"),
        (("Polygon", [[[0, 0], [1, 1], [1, 0], [0, 1], [0, 0]]]), "crosses itself (Self-intersection"),
        (("Polygon", [[[lat, lon] for lon, lat in rectangle(151.0, 25.0, 152.0, 26.0)]]), "latitude 151"),
        (("Polygon", [rectangle(500.0, 25.0, 501.0, 26.0)]), "longitude 500"),
        (("Polygon", [rectangle(5e5, 2.7e6, 5.1e5, 2.8e6)]), "in another reference system"),
        (("Polygon", [rectangle(51.5, 25.27, 51.5001, 25.2701)]), "the least is 200 m"),
        (("Polygon", [rectangle(20.0, 0.0, 60.0, 10.0)]), "the most is 3000 km"),
        (("Polygon", [[[0, 70], [120, 70], [-120, 70], [0, 70]]]), "round a pole"),
        (("Polygon", [rectangle(10.0, 84.0, 12.0, 86.0)]), "beyond 85 degrees"),
        (
            ("MultiPolygon", [[rectangle(lon, 0, lon + 1, 1)] for lon in (-120, 0, 120)]),
            "spans 241 degrees of longitude",
        ),
    ],
)
def test_what_cannot_be_used_is_refused_with_the_reason(
    geometry: tuple[str, Any], words: str, geojson: Callable[..., Path]
) -> None:
    path = geojson(geometry)
    with pytest.raises(AreaError, match=re.escape(words)) as raised:
        read_area(path)
    assert str(path) in str(raised.value)


def test_self_crossing_kml_is_refused_too(tmp_path: Path) -> None:
    path = tmp_path / "bow-tie.kml"
    path.write_text(KML.format(placemark("bow tie", [[0, 0], [1, 1], [1, 0], [0, 1], [0, 0]])))
    with pytest.raises(AreaError, match="crosses itself"):
        read_area(path)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "cannot be read as a vector file"),
        (b"west south east north", "cannot be read as a vector file"),
        (b'{"type": "FeatureCollection", "features": []}', "is empty"),
        (b'{"type": "FeatureCollection", "features": [', "cannot be read as a vector file"),
        (
            b'{"type": "Polygon", "coordinates": [[[51.5, NaN], [52, 25], [52, 26], [51.5, NaN]]]}',
            "damaged polygon",
        ),
        (b'{"type": "Polygon", "coordinates": [[[51, 25], [52, 25]]]}', "damaged polygon"),
        (b'{"type": "Polygon", "coordinates": [[[51, 25], [51, 25], [51, 25], [51, 25]]]}', "is no polygon"),
        (b'{"type": "Polygon", "coordinates": [[["a", 25], [52, 25], [52, 26], ["a", 25]]]}', "invalid 'x'"),
        (b"\x89PNG\r\n\x1a\n" + bytes(64), "cannot be read as a vector file"),
    ],
)
def test_files_that_are_no_areas(content: bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / "area.geojson"
    path.write_bytes(content)
    with pytest.raises(AreaError, match=re.escape(words)):
        read_area(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(AreaError, match=r"there is no area file '.*nowhere\.kml'; give GeoJSON"):
        read_area(tmp_path / "nowhere.kml")


def test_an_area_without_cell_centres_is_refused() -> None:
    box = BoundingBox(50.0, 25.0, 51.0, 26.0)
    sliver = shapely.Polygon([(50.0, 25.0), (50.001, 25.0), (51.0, 26.0), (50.999, 26.0)])
    elsewhere = shapely.box(0.0, 0.0, 1.0, 1.0)
    for polygon in (elsewhere, shapely.box(50.0, 25.0, 50.01, 26.0)):
        with pytest.raises(AreaError, match="holds no cell centre of the 32 x 32 grid"):
            cells_inside(Grid(box), Area(box, polygon, "thin", "thin.kml"))
    assert cells_inside(Grid(box), Area(box, sliver, "diagonal", "thin.kml")).any()
