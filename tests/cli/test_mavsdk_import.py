"""MAVSDK's own importer takes every plan that `generate-mission` writes, and gives back what is in it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from heartbeat_endpoint import plan_importer
from sparsor.mission.items import NAV_WAYPOINT
from sparsor.mission.sidecar import read_sidecar

pytestmark = pytest.mark.usefixtures("no_picture")
HOME = ("--home", 51.5012345678, 25.2654321)


@pytest.fixture(scope="module", params=["ardupilot", "px4"])
def importer(request):
    with plan_importer(request.param) as import_plan:
        yield request.param, import_plan


def whole(degrees):
    return round(degrees * 1e7)


def check(document, data, autopilot):
    received = list(data.mission_items)
    if autopilot == "ardupilot":  # MAVSDK puts home first, as ArduPilot stores it
        home = received.pop(0)
        lat, lon, altitude = document["mission"]["plannedHomePosition"]
        assert (home.x, home.y, home.z) == (whole(lat), whole(lon), pytest.approx(altitude))
    for got, item in zip(received, document["mission"]["items"], strict=True):
        assert (got.command, got.frame) == (item["command"], item["frame"])
        if "Altitude" in item:
            assert (got.x, got.y) == tuple(map(whole, item["params"][4:6]))
            assert got.z == pytest.approx(item["Altitude"], rel=1e-6)
        if item["command"] == NAV_WAYPOINT:
            assert got.param1 == pytest.approx(item["params"][0])
    (polygon,) = document["geoFence"]["polygons"]
    assert [(point.x, point.y) for point in data.geofence_items] == [
        (whole(lat), whole(lon)) for lat, lon in polygon["polygon"]
    ]
    (rally,) = document["rallyPoints"]["points"]
    assert [(point.x, point.y, point.z) for point in data.rally_items] == [
        (whole(rally[0]), whole(rally[1]), pytest.approx(rally[2]))
    ]


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("--altitude", 61.5, "--hold", 2.5, "--speed", 7.3, *HOME),
        ("--hold", 0, *HOME, "--home-altitude", -12.25),
    ],
)
def test_every_plan_is_imported(console, importer, options):
    autopilot, import_plan = importer
    ran = console.mission("--name", "m", "--autopilot", autopilot, "--json", *options)
    assert ran.code == 0, ran.err
    text = Path(ran.result["plans"][0]).read_text()
    data = import_plan(text)
    check(json.loads(text), data, autopilot)

    sidecar = read_sidecar(Path(ran.result["sidecar"]))
    lon, lat = sidecar.grid.centres_deg(sidecar.stops)
    at_altitude = [item for item in data.mission_items if item.command == NAV_WAYPOINT and item.z == sidecar.altitude_m]
    flown = [(item.x, item.y) for item in at_altitude[:-1]]  # the last one is the way home
    assert flown == [(whole(north), whole(east)) for east, north in zip(lon, lat, strict=True)]
    assert max(item.param1 for item in at_altitude[:-1]) == sidecar.hold_s


def test_a_plan_across_the_antimeridian_is_imported(console, importer):
    autopilot, import_plan = importer
    ran = console.mission("--autopilot", autopilot, "--json", box=("179.985", "-17.02", "-179.985", "-16.99"))
    text = Path(ran.result["plans"][0]).read_text()
    check(json.loads(text), import_plan(text), autopilot)
