"""Every export is read back by a program that we did not write, with the same positions."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import numpy as np
import pyogrio
import pytest
from hypothesis import given, settings
from pymavlink import mavwp
from shapely import from_wkb, get_coordinates, get_num_geometries, get_parts

from mission_strategies import AUTOPILOT_NAMES, example_plan, plans
from sparsor.errors import MissionError
from sparsor.mission import FORMATS, MissionPlan, export_bytes

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("export_format", sorted(FORMATS))
def test_the_same_plan_gives_the_same_bytes(export_format: str) -> None:
    assert export_bytes(example_plan(), "doha", export_format) == export_bytes(example_plan(), "doha", export_format)


def test_an_unknown_export_is_named() -> None:
    with pytest.raises(MissionError, match="unknown export 'gpx'; known are waypoints, kml, geojson"):
        export_bytes(example_plan(), "doha", "gpx")


@settings(max_examples=40, deadline=None)
@given(plan=plans())
def test_waypoints_are_read_by_pymavlink(plan: MissionPlan, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("waypoints") / "mission.waypoints"
    path.write_bytes(export_bytes(plan, "mission", "waypoints"))
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(path)) == len(plan.items) + 1
    home = loader.wp(0)
    assert (home.command, home.frame, home.current) == (16, 0, 1)
    assert (home.x, home.y, home.z) == pytest.approx(
        (plan.home.lat_deg, plan.home.lon_deg, plan.home.alt_amsl_m), abs=1e-9
    )
    for number, item in enumerate(plan.items, start=1):
        row = loader.wp(number)
        assert (row.seq, row.command, row.frame, row.current) == (number, item.command, item.frame, 0)
        values = [row.param1, row.param2, row.param3, row.param4, row.x, row.y, row.z]
        assert values == pytest.approx(item.params, abs=1e-9, nan_ok=True)


def test_waypoints_are_lines_of_twelve_fields_between_single_tabs() -> None:
    text = export_bytes(example_plan(home=None), "mission", "waypoints").decode("ascii")
    lines = text.split("\n")
    assert lines[0] == "QGC WPL 110"
    assert lines[-1] == ""
    assert "\r" not in text
    assert all(len(line.split("\t")) == 12 and "" not in line.split("\t") for line in lines[1:-1])
    assert lines[1].split("\t")[10] == "0"  # home's altitude is not known


def read_features(content: bytes, path: Path, name_field: str) -> tuple[list[str], np.ndarray]:
    """Names and geometries as GDAL reads them, one list over all layers."""
    path.write_bytes(content)
    names: list[str] = []
    shapes: list[object] = []
    for layer in pyogrio.list_layers(path)[:, 0]:
        about, _, geometry, columns = pyogrio.raw.read(path, layer=layer)
        shapes += list(from_wkb(geometry))
        names += list(columns[list(about["fields"]).index(name_field)])
    return names, np.array(shapes, dtype=object)


def of_stops(plan: MissionPlan) -> np.ndarray:
    return np.array([[stop.lon_deg, stop.lat_deg] for stop in plan.stops])


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_kml_is_read_by_gdal(autopilot: str, tmp_path: Path) -> None:
    plan = example_plan(autopilot)
    names, shapes = read_features(export_bytes(plan, "doha", "kml"), tmp_path / "doha.kml", "Name")
    assert names == ["Route", *(str(order) for order in range(1, 10)), "Home", "Fence"]
    stops = get_coordinates(shapes[1:10], include_z=True)
    np.testing.assert_allclose(stops[:, :2], of_stops(plan), rtol=0, atol=1e-9)
    np.testing.assert_allclose(stops[:, 2], 60 + 12.5)  # above sea level, since home's height is known
    np.testing.assert_allclose(get_coordinates(shapes[10], include_z=True), [[51.505, 25.265, 12.5]])
    route = get_coordinates(shapes[0])
    assert len(route) == len(plan.stops) + 3
    np.testing.assert_allclose(route[1:-2], of_stops(plan), rtol=0, atol=1e-9)
    fence = get_coordinates(shapes[11])[:-1]
    np.testing.assert_allclose(fence, np.array([plan.fences[0].lon_deg, plan.fences[0].lat_deg]).T, atol=1e-9)


def test_kml_says_when_heights_are_above_ground() -> None:
    known = export_bytes(example_plan(), "doha", "kml").decode()
    unknown = export_bytes(example_plan(home=None), "doha", "kml").decode()
    assert "<altitudeMode>absolute" in known
    assert "relativeToGround" not in known
    assert "<altitudeMode>relativeToGround" in unknown
    assert "absolute" not in unknown
    assert "The altitude of home above sea level is not known" in unknown


def test_geojson_is_read_by_gdal(tmp_path: Path) -> None:
    plan = example_plan()
    content = export_bytes(plan, "doha", "geojson")
    names, shapes = read_features(content, tmp_path / "doha.geojson", "kind")
    assert names == ["route", *["stop"] * 9, "home", "fence", "rally"]
    np.testing.assert_allclose(get_coordinates(shapes[1:10]), of_stops(plan), rtol=0, atol=1e-9)
    np.testing.assert_allclose(get_coordinates(shapes[0])[1:-2], of_stops(plan), rtol=0, atol=1e-9)
    assert shapes[11].is_valid
    assert shapes[11].exterior.is_ccw
    stops = [feature["properties"] for feature in json.loads(content)["features"][1:10]]
    assert [stop["order"] for stop in stops] == list(range(1, 10))
    assert {stop["hold_s"] for stop in stops} == {4}
    assert {stop["altitude_above_home_m"] for stop in stops} == {60}


@settings(max_examples=40, deadline=None)
@given(plan=plans(across=True))
def test_geojson_is_cut_at_the_antimeridian(plan: MissionPlan, tmp_path_factory: pytest.TempPathFactory) -> None:
    content = export_bytes(plan, "fiji", "geojson")
    names, shapes = read_features(content, tmp_path_factory.mktemp("cut") / "fiji.geojson", "kind")
    route, fence = shapes[names.index("route")], shapes[names.index("fence")]
    assert get_num_geometries(route) > 1
    assert get_num_geometries(fence) == 2
    for part in [*get_parts(route), *get_parts(fence)]:
        west, _, east, _ = part.bounds
        assert -180 <= west <= east <= 180
        assert east - west < 180
    # No stop is lost, and the order stays.
    seen = [tuple(point) for point in get_coordinates(route).round(7) if abs(point[0]) < 180]
    flown = [(item.lon_deg, item.lat_deg) for item in plan.items if item.has_position]
    assert seen == [point for point in flown if abs(point[0]) < 180]


def test_params_that_are_not_given_are_nan_in_text() -> None:
    rows = export_bytes(example_plan("px4"), "mission", "waypoints").decode().splitlines()
    assert math.isnan(float(rows[2].split("\t")[7]))
