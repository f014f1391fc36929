"""What is written for every kind of vehicle and both autopilots, with and without exclusions, is read as it was meant.

GDAL reads the KML and the GeoJSON, pymavlink's MAVWP the .waypoints, the importer inside MAVSDK the .plan.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pyogrio
import pytest
import shapely
from pymavlink import mavwp

from mission_strategies import AUTOPILOT_NAMES, KINDS
from sparsor.geodesy.keepouts import KeepOut
from sparsor.geodesy.lengths import distance_m
from sparsor.geodesy.plane import LocalPlane
from sparsor.geodesy.zones import zones_of
from sparsor.mission import Home, build_mission, export_bytes, parse_plan, plan_bytes
from sparsor.mission.items import FRAME_RELATIVE
from sparsor.vehicle import SteadyWind, load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from sparsor.mission import MissionPlan

# Qatar, and Fiji's east: longitudes of both signs, latitudes of both.
PLANES = {"doha": LocalPlane(51.5, 25.3), "south-west": LocalPlane(-179.2, -17.3)}
STOPS_M = [(450.0, 0.0), (600.0, 500.0), (900.0, 350.0), (1300.0, -500.0)]
HOME_M = (-450.0, 20.0)
WIND = SteadyWind(3, 310)
EXCLUSION_VERTEX, INCLUSION_VERTEX, EXCLUSION_CIRCLE = 5002, 5001, 5004


def keep_outs(plane: LocalPlane, what: str) -> list[KeepOut]:
    """A polygon between home and the stops, a circle beside them; `what` names which."""
    corners = [(-90, -80), (70, -85), (80, 60), (0, 110), (-95, 70)]
    lon, lat = plane.degrees(corners).T
    mast_lon, mast_lat = plane.degrees([250.0, 900.0])
    polygon = KeepOut("stadium", tuple(lon.tolist()), tuple(lat.tolist()))
    circle = KeepOut("mast", (float(mast_lon),), (float(mast_lat),), 120.0)
    return {"none": [], "polygon": [polygon], "circle": [circle], "both": [polygon, circle]}[what]


def made(kind: str, autopilot: str, what: str, place: str) -> MissionPlan:
    plane, vehicle = PLANES[place], load_vehicle(kind)
    found = keep_outs(plane, what)
    margin_m = 30.0 + (2 * vehicle.turn_radius_m if vehicle.circles else 0.0)
    kept = zones_of(found, margin_m=margin_m, plane=plane, most_points=40, longest_leg_m=3000.0) if found else None
    lon, lat = plane.degrees(STOPS_M).T
    home_lon, home_lat = plane.degrees(HOME_M)
    hold_s = 0.0 if vehicle.circles else np.array([2.0, 0.0, 5.0, 1.0])
    return build_mission(
        lon, lat, home=Home(float(home_lon), float(home_lat), 7.25, altitude_known=True), vehicle=vehicle,
        autopilot=autopilot, altitude_m=55.5 if vehicle.flies else 0, hold_s=hold_s, wind=WIND, zones=kept,
    )  # fmt: skip


@pytest.fixture(params=sorted(PLANES))
def place(request: pytest.FixtureRequest) -> str:
    return request.param


EVERY = [(kind, autopilot, what) for kind in KINDS for autopilot in AUTOPILOT_NAMES for what in ("none", "both")]
EVERY += [("quad", "ardupilot", "polygon"), ("plane", "px4", "circle")]
every = pytest.mark.parametrize(("kind", "autopilot", "what"), EVERY)


def flown(plan: MissionPlan) -> np.ndarray:
    return np.array([(item.lon_deg, item.lat_deg) for item in plan.items if item.has_position])


def corners_of(fence: Any) -> np.ndarray:
    return np.column_stack([fence.lon_deg, fence.lat_deg])


@every
def test_waypoints_by_pymavlink(kind: str, autopilot: str, what: str, place: str, tmp_path: Path) -> None:
    plan = made(kind, autopilot, what, place)
    path = tmp_path / "m.waypoints"
    path.write_bytes(export_bytes(plan, "m", "waypoints"))
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(path)) == len(plan.items) + 1
    home = loader.wp(0)
    assert (home.x, home.y, home.z) == pytest.approx((plan.home.lat_deg, plan.home.lon_deg, 7.25), abs=1e-9)
    for number, item in enumerate(plan.items, start=1):
        row = loader.wp(number)
        assert (row.seq, row.command, row.frame, row.autocontinue) == (number, item.command, item.frame, 1)
        values = [row.param1, row.param2, row.param3, row.param4, row.x, row.y, row.z]
        assert values == pytest.approx(item.params, abs=1e-9, nan_ok=True)


@every
def test_kml_by_gdal(kind: str, autopilot: str, what: str, place: str, tmp_path: Path) -> None:
    plan = made(kind, autopilot, what, place)
    names, shapes = read_features(export_bytes(plan, "m", "kml"), tmp_path / "m.kml", "Name")
    stops = [str(order) for order in range(1, len(plan.stops) + 1)]
    exclusions = len(plan.fences) - 1 + len(plan.circles)
    assert names == ["Route", *stops, "Home", "Fence", *["Keep out"] * exclusions]
    assert exclusions == {"none": 0, "both": 2}.get(what, 1)
    route = shapely.get_coordinates(shapes[0], include_z=True)
    np.testing.assert_allclose(route[:, :2], flown(plan), rtol=0, atol=1e-9)
    heights = [item.altitude_m + 7.25 for item in plan.items if item.has_position and item.frame == FRAME_RELATIVE]
    np.testing.assert_allclose(route[:, 2], heights, atol=1e-6)
    at = len(stops) + 2
    for shape, fence in zip(shapes[at:], plan.fences, strict=False):
        np.testing.assert_allclose(shapely.get_coordinates(shape)[:-1], corners_of(fence), rtol=0, atol=1e-9)
    for shape, circle in zip(shapes[at + len(plan.fences) :], plan.circles, strict=True):
        plane = LocalPlane(circle.lon_deg, circle.lat_deg)
        ring = shapely.Polygon(plane.metres(*shapely.get_coordinates(shape).T))
        assert ring.buffer(0.01).covers(shapely.Point(0, 0).buffer(circle.radius_m, quad_segs=64))
        assert ring.hausdorff_distance(shapely.Point(0, 0).buffer(circle.radius_m)) < 2


@every
def test_geojson_by_gdal(kind: str, autopilot: str, what: str, place: str, tmp_path: Path) -> None:
    plan = made(kind, autopilot, what, place)
    path = tmp_path / "m.geojson"
    kinds, shapes = read_features(export_bytes(plan, "m", "geojson"), path, "kind")
    fences = ["fence"] * (len(plan.fences) + len(plan.circles))
    assert kinds == ["route", *["stop"] * len(plan.stops), "home", *fences, "rally"]
    np.testing.assert_allclose(shapely.get_coordinates(shapes[0]), flown(plan), rtol=0, atol=1e-9)
    about, _, _, columns = pyogrio.raw.read(path)
    fields = dict(zip(about["fields"].tolist(), columns, strict=True))
    rows = [row for row, kind_of in enumerate(kinds) if kind_of == "fence"]
    assert [bool(fields["inclusion"][row]) for row in rows] == [True, *[False] * (len(rows) - 1)]
    for row, fence in zip(rows, plan.fences, strict=False):
        assert shapely.equals(shapes[row], shapely.Polygon(corners_of(fence)))
    for row, circle in zip(rows[len(plan.fences) :], plan.circles, strict=True):
        assert (shapes[row].x, shapes[row].y) == (circle.lon_deg, circle.lat_deg)
        assert fields["radius_m"][row] == circle.radius_m
    stops = [row for row, kind_of in enumerate(kinds) if kind_of == "stop"]
    assert [fields["order"][row] for row in stops] == list(range(1, len(stops) + 1))
    assert [fields["hold_s"][row] for row in stops] == [stop.hold_s for stop in plan.stops]


@every
def test_plan_by_mavsdk(
    kind: str, autopilot: str, what: str, place: str, importers: dict[str, Callable[[str], Any]]
) -> None:
    plan = made(kind, autopilot, what, place)
    assert parse_plan(plan_bytes(plan), "m") == plan
    document = importers[autopilot](plan_bytes(plan).decode())
    items = list(document.mission_items)
    if autopilot == "ardupilot":  # MAVSDK puts home first
        home = items.pop(0)
        assert (home.x, home.y, home.z) == (*e7(plan.home.lon_deg, plan.home.lat_deg), 7.25)
    for item, received in zip(plan.items, items, strict=True):
        assert (received.command, received.frame, received.autocontinue) == (item.command, item.frame, 1)
        if item.has_position:
            assert (received.x, received.y) == e7(item.lon_deg, item.lat_deg)
            assert received.z == pytest.approx(item.altitude_m)
        params = [received.param1, received.param2, received.param3, received.param4]
        assert params == pytest.approx(list(item.params[:4]), nan_ok=True)
    wanted = [
        (INCLUSION_VERTEX if fence.inclusion else EXCLUSION_VERTEX, len(fence.lon_deg), *e7(lon, lat))
        for fence in plan.fences
        for lon, lat in corners_of(fence)
    ]
    wanted += [(EXCLUSION_CIRCLE, one.radius_m, *e7(one.lon_deg, one.lat_deg)) for one in plan.circles]
    got = [(one.command, one.param1, one.x, one.y) for one in document.geofence_items]
    assert got == [pytest.approx(one) for one in wanted]
    assert [(one.x, one.y) for one in document.rally_items] == [
        e7(one.lon_deg, one.lat_deg) for one in plan.rally_points
    ]


def test_what_is_read_back_keeps_out(importers: dict[str, Callable[[str], Any]]) -> None:
    """The exclusions that MAVSDK hands to an autopilot hold the drawing, in the very integers that it stores."""
    for place, plane in PLANES.items():
        plan = made("quad", "ardupilot", "both", place)
        document = importers["ardupilot"](plan_bytes(plan).decode())
        ring = [(one.y / 1e7, one.x / 1e7) for one in document.geofence_items if one.command == EXCLUSION_VERTEX]
        polygon, circle = keep_outs(plane, "both")
        fence = shapely.Polygon(plane.metres(*np.transpose(ring)))
        assert fence.covers(shapely.Polygon(plane.metres(polygon.lon_deg, polygon.lat_deg)))
        (mast,) = (one for one in document.geofence_items if one.command == EXCLUSION_CIRCLE)
        aside_m = float(distance_m(mast.y / 1e7, mast.x / 1e7, circle.lon_deg[0], circle.lat_deg[0]))
        assert mast.param1 >= circle.radius_m + aside_m
        assert math.isclose(mast.param1, circle.radius_m, abs_tol=0.1)


def e7(lon_deg: float, lat_deg: float) -> tuple[int, int]:
    """Latitude and longitude as MAVLink stores them."""
    return round(lat_deg * 1e7), round(lon_deg * 1e7)


def read_features(content: bytes, path: Path, name_field: str) -> tuple[list[str], list[Any]]:
    """Names and geometries as GDAL reads them, one list over all layers."""
    path.write_bytes(content)
    names: list[str] = []
    shapes: list[Any] = []
    for layer in pyogrio.list_layers(path)[:, 0]:
        about, _, geometry, columns = pyogrio.raw.read(path, layer=layer)
        shapes += list(shapely.from_wkb(geometry))
        names += list(columns[list(about["fields"]).index(name_field)])
    return names, shapes
