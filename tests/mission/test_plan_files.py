"""The .plan: exact keys, strict JSON, read back by ourselves and by MAVSDK's own importer."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, given, settings

from mission_strategies import AUTOPILOT_NAMES, QUAD, example_plan, plans
from sparsor.errors import MissionError
from sparsor.mission import (
    Circle,
    ComplexItem,
    MissionPlan,
    build_mission,
    parse_plan,
    plan_bytes,
)

if TYPE_CHECKING:
    from collections.abc import Callable

Importer = dict[str, "Callable[[str], Any]"]
RELAXED = settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def tenmillionths(value: float) -> int:
    return round(value * 1e7)


def check_import(plan: MissionPlan, autopilot: str, importers: Importer) -> None:
    """MAVSDK's importer gives back the same items, fence and rally points."""
    data = importers[autopilot](plan_bytes(plan).decode("utf-8"))
    received = list(data.mission_items)
    if autopilot == "ardupilot":
        home = received.pop(0)
        assert (home.command, home.x, home.y) == (
            16,
            tenmillionths(plan.home.lat_deg),
            tenmillionths(plan.home.lon_deg),
        )
        assert home.z == pytest.approx(plan.home.alt_amsl_m, rel=1e-6)
    assert len(received) == len(plan.items)
    for got, item in zip(received, plan.items, strict=True):
        assert (got.command, got.frame, got.autocontinue) == (
            item.command,
            item.frame,
            int(item.autocontinue),
        )
        given_params = [got.param1, got.param2, got.param3, got.param4, got.z]
        assert given_params == pytest.approx([*item.params[:4], item.params[6]], rel=1e-6, nan_ok=True)
        scale = 1e7 if item.has_position else 1
        assert (got.x, got.y) == (round(item.params[4] * scale), round(item.params[5] * scale))
    fence = plan.fences[0]
    assert [(point.x, point.y) for point in data.geofence_items] == [
        (tenmillionths(lat), tenmillionths(lon)) for lon, lat in zip(fence.lon_deg, fence.lat_deg, strict=True)
    ]
    assert {(point.command, point.param1) for point in data.geofence_items} == {(5001, len(fence.lon_deg))}
    rally = plan.rally_points[0]
    assert [(point.x, point.y, point.z) for point in data.rally_items] == [
        (
            tenmillionths(rally.lat_deg),
            tenmillionths(rally.lon_deg),
            pytest.approx(rally.altitude_m, rel=1e-6),
        )
    ]


@RELAXED
@given(plan=plans())
def test_mavsdk_imports_every_plan(plan: MissionPlan, importers: Importer) -> None:
    check_import(plan, "px4" if plan.firmware_type == 12 else "ardupilot", importers)


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_mavsdk_imports_the_longest_plan_and_one_across_the_antimeridian(autopilot: str, importers: Importer) -> None:
    check_import(example_plan(autopilot, stops=490), autopilot, importers)
    across = build_mission([179.99, -179.99], [-17.0, -17.01], vehicle=QUAD, autopilot=autopilot, altitude_m=50)
    check_import(across, autopilot, importers)


@settings(max_examples=100, deadline=None)
@given(plans() | plans(across=True))
def test_what_was_written_is_read(plan: MissionPlan) -> None:
    content = plan_bytes(plan)
    again = parse_plan(content, "test")
    assert again == plan
    assert again.warnings == ()
    assert plan_bytes(again) == content


def test_the_keys_are_those_of_the_format() -> None:
    document = json.loads(plan_bytes(example_plan("px4")))
    assert set(document) == {"fileType", "groundStation", "version", "mission", "geoFence", "rallyPoints"}
    assert (document["fileType"], document["version"]) == ("Plan", 1)
    mission = document["mission"]
    assert set(mission) == {
        "version", "firmwareType", "vehicleType", "cruiseSpeed", "hoverSpeed", "globalPlanAltitudeMode",
        "plannedHomePosition", "items",
    }  # fmt: skip
    assert (mission["version"], mission["firmwareType"], mission["vehicleType"]) == (2, 12, 2)
    assert mission["globalPlanAltitudeMode"] == 1
    assert mission["plannedHomePosition"] == [25.265, 51.505, 12.5]
    simple = {"type", "command", "frame", "params", "autoContinue", "doJumpId"}
    triple = {"AltitudeMode", "Altitude", "AMSLAltAboveTerrain"}
    for number, item in enumerate(mission["items"], start=1):
        assert set(item) == (simple if item["command"] == 178 else simple | triple)
        assert item["doJumpId"] == number
        assert len(item["params"]) == 7
    assert document["geoFence"]["version"] == document["rallyPoints"]["version"] == 2
    assert document["geoFence"]["circles"] == []
    assert document["geoFence"]["polygons"][0]["version"] == 1
    assert document["geoFence"]["polygons"][0]["inclusion"] is True


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_json_is_strict_and_versions_are_whole_numbers(autopilot: str) -> None:
    text = plan_bytes(example_plan(autopilot)).decode("ascii")
    assert "NaN" not in text
    assert "Infinity" not in text
    document = json.loads(text)
    for version in (document["version"], document["mission"]["version"], document["geoFence"]["version"]):
        assert type(version) is int
    nulls = [item["params"].count(None) for item in document["mission"]["items"]]
    assert sum(nulls) == (0 if autopilot == "ardupilot" else len(nulls) - 1)


def test_patterns_are_not_written_as_something_else() -> None:
    plan = example_plan()
    pattern = MissionPlan(**{**vars(plan), "complex_items": (ComplexItem("survey", 4),)})
    with pytest.raises(MissionError, match=r"patterns of QGroundControl \(survey\)"):
        plan_bytes(pattern)


def test_circles_survive() -> None:
    plan = MissionPlan(**{**vars(example_plan()), "circles": (Circle(51.51, 25.28, 40.0, inclusion=False),)})
    assert parse_plan(plan_bytes(plan), "test") == plan
