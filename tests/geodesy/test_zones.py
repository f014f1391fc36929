"""No way touches a keep-out or its margin, and none is longer than it has to be."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sparsor.errors import AreaError
from sparsor.geodesy.keepouts import KeepOut, read_keep_outs
from sparsor.geodesy.lengths import distance_m, wgs84
from sparsor.geodesy.outward import corners, simplified_outward
from sparsor.geodesy.plane import LocalPlane
from sparsor.geodesy.zones import Zones, zones_of

if TYPE_CHECKING:
    from pathlib import Path

MARGIN_M = 30.0
ROOM = 48


@st.composite
def star(draw: st.DrawFn) -> np.ndarray:
    """A polygon of some hundred metres, with bays, round 0/0."""
    count = draw(st.integers(3, 40))
    radii = draw(st.lists(st.floats(40, 500), min_size=count, max_size=count))
    angles = 2 * np.pi * (np.arange(count) + 0.3) / count
    return np.array(radii)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])


@st.composite
def keep_outs(draw: st.DrawFn) -> tuple[LocalPlane, list[KeepOut]]:
    plane = LocalPlane(draw(st.sampled_from([-179.999, -75.0, 0.0, 51.5, 179.99])), draw(st.floats(-70, 70)))
    found = []
    for number in range(draw(st.integers(1, 5))):
        middle = np.array([draw(st.floats(-2500, 2500)), draw(st.floats(-2500, 2500))])
        if draw(st.booleans()):
            lon, lat = plane.degrees(middle)
            found.append(KeepOut(f"c{number}", (float(lon),), (float(lat),), draw(st.floats(20, 600))))
        else:
            lon, lat = plane.degrees(draw(star()) + middle).T
            found.append(KeepOut(f"p{number}", tuple(lon.tolist()), tuple(lat.tolist())))
    return plane, found


def made(plane: LocalPlane, found: list[KeepOut], room: int = ROOM) -> Zones:
    return zones_of(found, margin_m=MARGIN_M, plane=plane, most_points=room, longest_leg_m=8000.0)


def nearest_m(found: list[KeepOut], start: tuple[float, float], end: tuple[float, float]) -> float:
    """The least geodesic distance of a leg, flown as a geodesic, from the keep-outs, by dense samples; 0 inside."""
    line = np.array([start, *wgs84().npts(*start, *end, 60), end])
    best = math.inf
    for one in found:
        if one.is_circle:
            best = min(best, float(distance_m(*line.T, one.lon_deg[0], one.lat_deg[0]).min()) - one.radius_m)
            continue
        own = LocalPlane(one.lon_deg[0], one.lat_deg[0])
        area = shapely.Polygon(own.metres(one.lon_deg, one.lat_deg))
        best = min(best, area.distance(shapely.LineString(own.metres(*line.T))))
    return best


PLACES = st.tuples(st.floats(-4000, 4000), st.floats(-4000, 4000))


@settings(max_examples=150, deadline=None)
@given(keep_outs(), PLACES, PLACES)
def test_a_way_keeps_out_and_is_the_shortest(
    drawn: tuple[LocalPlane, list[KeepOut]], first: tuple[float, float], second: tuple[float, float]
) -> None:
    plane, found = drawn
    zones = made(plane, found)
    start, end = (tuple(plane.degrees(place).tolist()) for place in (first, second))
    assume(not zones.holds(*start) and not zones.holds(*end))
    way = zones.way(start, end)
    (length_m,) = zones.lengths_m(start, [end[0]], [end[1]])
    assume(way is not None)
    whole = [start, *way, end]
    for leg in pairwise(whole):
        assert nearest_m(found, *leg) >= MARGIN_M - 0.05
    points = plane.metres(*np.array(whole).T)
    flown_m = float(np.hypot(*np.diff(points, axis=0).T).sum())
    straight_m = math.dist(first, second)
    assert flown_m == pytest.approx(length_m, abs=0.1)
    assert flown_m >= straight_m - 0.1
    crossed = bool(zones.crossed([start[0]], [start[1]], [end[0]], [end[1]])[0])
    assert (len(way) > 0) == crossed
    # Leaving a point out crosses something, or the way would not have it.
    for skipped in range(1, len(whole) - 1):
        before, after = whole[skipped - 1], whole[skipped + 1]
        assert zones.crossed([before[0]], [before[1]], [after[0]], [after[1]])[0] or math.isclose(
            math.dist(points[skipped - 1], points[skipped]) + math.dist(points[skipped], points[skipped + 1]),
            math.dist(points[skipped - 1], points[skipped + 1]),
            abs_tol=0.1,
        )


@settings(max_examples=150, deadline=None)
@given(keep_outs(), st.integers(30, 60))
def test_a_fence_holds_its_keep_out_and_fits(drawn: tuple[LocalPlane, list[KeepOut]], room: int) -> None:
    plane, found = drawn
    zones = made(plane, found, room)
    assert zones.fence_points <= room
    fences = [shapely.Polygon(plane.metres(*np.array(one).T)) for one in zones.polygons]
    for one in found:
        if one.is_circle:
            aside_m = [
                float(distance_m(lon, lat, one.lon_deg[0], one.lat_deg[0])) + one.radius_m - radius_m
                for lon, lat, radius_m in zones.circles
            ]
            assert min(aside_m) <= 0
        else:
            area = shapely.Polygon(plane.metres(one.lon_deg, one.lat_deg))
            assert any(fence.covers(area) for fence in fences)
    assert all(fence.is_valid for fence in fences)


@settings(max_examples=200, deadline=None)
@given(star(), st.integers(4, 30))
def test_simplified_is_outward(points: np.ndarray, most: int) -> None:
    area = shapely.Polygon(points)
    simple = simplified_outward(area, most)
    assert corners(simple) <= most
    assert simple.covers(area)
    assert simple.area <= shapely.oriented_envelope(area).area * 1.6 + 1


@pytest.mark.parametrize("turn_deg", [10.0, 20.0, 33.7, 45.0, 56.2, 80.0, 120.0])
def test_a_rounded_corner_is_the_margin_away(turn_deg: float) -> None:
    """A corner where the outline turns by 33.7 degrees is rounded by a single side, if it is by the least."""
    plane, turn = LocalPlane(51.5, 25.3), math.radians(turn_deg)
    ring = [(-900.0, 0.0), (0.0, 0.0), (900 * math.cos(turn), -900 * math.sin(turn)), (-900.0, -2000.0)]
    lon, lat = plane.degrees(ring).T
    zones = made(plane, [KeepOut("corner", tuple(lon.tolist()), tuple(lat.tolist()))])
    assert zones.area.exterior.distance(shapely.Polygon(ring)) >= MARGIN_M


def test_too_many_are_refused() -> None:
    plane = LocalPlane(51.5, 25.3)
    circles = [KeepOut(str(n), (51.5 + n / 1000,), (25.3,), 10.0) for n in range(60)]
    with pytest.raises(AreaError, match="60 keep-outs are too many: the autopilot has room for 48 fence points"):
        made(plane, circles)


def written(path: Path, *features: tuple[object, object]) -> Path:
    document = {
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "geometry": shape, "properties": properties} for shape, properties in features
        ],
    }
    path.write_text(json.dumps(document))
    return path


POINT = {"type": "Point", "coordinates": [51.52, 25.29]}
SQUARE = {"type": "Polygon", "coordinates": [[[51.5, 25.2], [51.6, 25.2], [51.6, 25.3], [51.5, 25.2]]]}


def test_the_example_is_read() -> None:
    from pathlib import Path

    stadium, mast = read_keep_outs(Path(__file__).parents[2] / "geo" / "keep-out-example.geojson")
    assert (stadium.name, len(stadium.lon_deg), stadium.is_circle) == ("Stadium", 4, False)
    assert (mast.name, mast.lon_deg, mast.lat_deg, mast.radius_m) == ("Mast", (51.5205,), (25.2915,), 150.0)


def test_the_airport_is_an_example_and_says_so() -> None:
    from pathlib import Path

    path = Path(__file__).parents[2] / "geo" / "doha-airport.geojson"
    (airport,) = read_keep_outs(path)
    zones = made(LocalPlane(51.6, 25.27), [airport])
    assert zones.holds(51.608, 25.273)  # where its runways are
    assert not zones.holds(51.53, 25.28)  # the city
    assert "NOT the official zone" in path.read_text()


def test_kml_is_read(tmp_path: Path) -> None:
    path = tmp_path / "out.kml"
    path.write_text(
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark><name>Mast</name><ExtendedData>'
        '<Data name="radius_m"><value>80</value></Data></ExtendedData><Point><coordinates>51.5,25.3,0</coordinates>'
        "</Point></Placemark></Document></kml>"
    )
    (mast,) = read_keep_outs(path)
    assert (mast.name, mast.radius_m) == ("Mast", 80.0)


@pytest.mark.parametrize(
    ("features", "sentence"),
    [
        ([(POINT, {"name": "a"})], "'a' is a Point; a keep-out is a polygon, or a point with a radius_m"),
        ([(POINT, {"name": "a", "radius_m": -3})], "the radius_m of 'a' is '-3'"),
        ([(POINT, {"name": "a", "radius_m": "wide"})], "the radius_m of 'a' is 'wide'"),
        ([({"type": "LineString", "coordinates": [[51, 25], [52, 25]]}, {})], "is a LineString"),
        (
            [({"type": "Polygon", "coordinates": [[[0, 0], [1, 1], [1, 0], [0, 1], [0, 0]]]}, {"name": "bow"})],
            "'bow' crosses itself",
        ),
        ([({"type": "Polygon", "coordinates": [[[0, 95], [1, 95], [1, 94], [0, 95]]]}, {})], "a point off the map"),
        ([], "is empty|cannot be read"),
    ],
)
def test_what_is_none_is_named(tmp_path: Path, features: list[tuple[object, object]], sentence: str) -> None:
    with pytest.raises(AreaError, match=sentence):
        read_keep_outs(written(tmp_path / "out.geojson", *features))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(AreaError, match="there is no keep-out file"):
        read_keep_outs(tmp_path / "none.geojson")
    (tmp_path / "x.geojson").write_text("no json")
    with pytest.raises(AreaError, match="cannot be read as a vector file"):
        read_keep_outs(tmp_path / "x.geojson")
    assert len(read_keep_outs(written(tmp_path / "y.geojson", (SQUARE, {})))) == 1
