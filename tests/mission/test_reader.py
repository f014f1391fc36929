"""Plans of QGroundControl are read as they are; what is broken is refused with its place."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mavsdk.exceptions import MavsdkError

from mission_strategies import QUAD
from sparsor.errors import MissionError
from sparsor.mission import build_mission, describe_plan, parse_plan, plan_bytes, plan_faults, read_plan

if TYPE_CHECKING:
    from collections.abc import Callable

LOGS = Path(__file__).resolve().parents[3] / "shared" / "logs"
PLAN = build_mission([51.50, 51.51], [25.27, 25.28], vehicle=QUAD, autopilot="px4", altitude_m=50, hold_s=3)
GOOD = plan_bytes(PLAN)


def changed(change: Callable[[dict[str, Any]], object]) -> bytes:
    document = json.loads(GOOD)
    change(document)
    return json.dumps(document).encode()


def item(number: int, **values: object) -> Callable[[dict[str, Any]], object]:
    return lambda document: document["mission"]["items"][number - 1].update(values)


@pytest.mark.skipif(not LOGS.is_dir(), reason="the shared logs are not on this machine")
@pytest.mark.parametrize(("name", "stops"), [("arducopter_30wp_no2", 30), ("arducopter_4wp_companion", 4)])
def test_plans_that_flew_are_read(name: str, stops: int, importers: dict[str, Callable[[str], Any]]) -> None:
    path = LOGS / f"{name}.plan"
    plan = read_plan(path)
    assert len(plan.stops) == stops
    assert plan.autopilot_title == "ArduPilot"
    assert (plan.home.lon_deg, plan.home.lat_deg, plan.home.alt_amsl_m) == (51.5, 25.3, 10)
    assert plan.home.altitude_known
    assert (len(plan.fences), len(plan.circles), len(plan.rally_points)) == (1, 1, 2)
    assert not plan.circles[0].inclusion
    theirs = importers["ardupilot"](path.read_text()).mission_items[1:]
    assert [(got.command, got.frame) for got in theirs] == [(mine.command, mine.frame) for mine in plan.items]
    assert [(got.x, got.y) for got in theirs if got.command == 16] == [
        (round(mine.lat_deg * 1e7), round(mine.lon_deg * 1e7)) for mine in plan.stops
    ]


def test_keys_that_qgroundcontrol_may_leave_out() -> None:
    def bare(document: dict[str, Any]) -> None:
        for key in ("vehicleType", "cruiseSpeed", "hoverSpeed", "globalPlanAltitudeMode"):
            del document["mission"][key]
        for entry in document["mission"]["items"]:
            for key in ("AltitudeMode", "Altitude", "AMSLAltAboveTerrain", "doJumpId"):
                entry.pop(key, None)

    plan = parse_plan(changed(bare), "test")
    assert plan.items == PLAN.items
    assert plan.vehicle_type == 0
    assert plan.hover_m_s == 5


def test_a_survey_counts_the_items_it_carries() -> None:
    def survey(document: dict[str, Any]) -> None:
        items = document["mission"]["items"]
        inside = {"Items": items[2:4], "VisualTransectPoints": []}
        items[2:4] = [
            {
                "type": "ComplexItem",
                "complexItemType": "survey",
                "version": 5,
                "TransectStyleComplexItem": inside,
            }
        ]

    plan = parse_plan(changed(survey), "test")
    assert plan.items == PLAN.items
    assert describe_plan(plan).complex_items == {"survey": 2}
    assert any("Pattern 'survey': 2 of the items" in line for line in describe_plan(plan).lines)


def test_a_pattern_that_only_qgroundcontrol_expands_is_said() -> None:
    scan = {"type": "ComplexItem", "complexItemType": "StructureScan", "version": 3}
    plan = parse_plan(changed(lambda document: document["mission"]["items"].insert(2, scan)), "test")
    assert plan.items == PLAN.items
    assert any("only QGroundControl can work out" in line for line in describe_plan(plan).lines)


def test_a_take_off_without_a_position_is_a_fault_not_an_error() -> None:
    plan = parse_plan(changed(item(1, params=[0, 0, 0, None, None, None, 50])), "test")
    assert not plan.items[0].has_position
    assert any("has no position" in fault for fault in plan_faults(plan))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda document: document.update(version=1.0), "version is written 1.0: MAVSDK"),
        (lambda document: document["mission"].update(version=2.0), "mission.version is written 2.0: MAVSDK"),
        (lambda document: document.pop("geoFence"), "geoFence is missing: MAVSDK"),
        (
            lambda document: document["rallyPoints"].update(version=1),
            "rallyPoints has version 1 and is ignored",
        ),
    ],
)
def test_what_mavsdk_refuses_is_said(
    change: Callable[[dict[str, Any]], object], sentence: str, importers: dict[str, Callable[[str], Any]]
) -> None:
    content = changed(change)
    assert sentence in parse_plan(content, "test").warnings[0]
    with pytest.raises(MavsdkError):
        importers["px4"](content.decode())


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "ends too early"),
        (GOOD[: len(GOOD) // 2], "ends too early|not JSON"),
        (GOOD[:-3], "ends too early"),
        (b"\x89PNG\r\n\x1a\n\xff\xfe", "not text in UTF-8"),
        (b"[1, 2]", "has to be an object"),
        (b"[" * 100_000, "nested too deeply"),
        (b'{"version": ' + b"9" * 5000 + b"}", "number that cannot be read"),
        (GOOD.replace(b"null", b"NaN"), "holds NaN, which is not JSON"),
        (GOOD.replace(b"51.51", b"1e999"), "not a finite number"),
        (GOOD.replace(b'"Plan"', b'"Params"'), "fileType is 'Params'; a plan has \"Plan\""),
        (changed(lambda document: document.update(version=2)), "version is 2; this program reads version 1"),
        (changed(lambda document: document["mission"].update(version=1)), "mission.version is 1"),
        (changed(lambda document: document.pop("mission")), "'mission' is missing"),
        (changed(lambda document: document["mission"].pop("items")), "mission.items is null or missing"),
        (
            changed(lambda document: document["mission"].pop("firmwareType")),
            "firmwareType is null or missing",
        ),
        (
            changed(lambda document: document["mission"].update(plannedHomePosition=[25.2, 51.5])),
            "plannedHomePosition has 2 values; it has to have 3",
        ),
        (
            changed(lambda document: document["mission"].update(plannedHomePosition=[None, 51.5, 0])),
            "plannedHomePosition, value 1 is null",
        ),
        (
            changed(lambda document: document["mission"].update(plannedHomePosition=[251.5, 25.2, 0])),
            "home lies at longitude 25.2, latitude 251.5",
        ),
        (
            changed(item(3, params=[0, 0, 0, None, None, None, 50])),
            "mission item 3: command 16 has no position",
        ),
        (
            changed(item(3, params=[0, 0, 0, None, 25.3, 51.5])),
            "item 3, params has 6 values; it has to have 7",
        ),
        (changed(item(3, params=[0, 0, 0, "null", 25.3, 51.5, 50])), 'item 3, params, value 4 is "null"'),
        (changed(item(3, params=[0, 0, 0, None, 25.3, 51.5, None])), "has no altitude"),
        (changed(item(3, type="MissionItem")), "mission item 3 has the type 'MissionItem'"),
        (changed(item(3, command=-16)), "command is -16; it has to be a whole number"),
        (changed(item(3, frame=3.5)), "frame is 3.5"),
        (changed(item(3, autoContinue=1)), "autoContinue is 1; it has to be true or false"),
        (
            changed(lambda document: document["geoFence"]["polygons"][0]["polygon"].__setitem__(1, [None, 51.5])),
            "fence polygon 1, corner 2, value 1 is null",
        ),
        (
            changed(lambda document: document["geoFence"]["polygons"][0].update(polygon=[[25.2, 51.5]])),
            "a fence polygon has 1 corners; it needs 3",
        ),
        (
            changed(lambda document: document["rallyPoints"]["points"].append([25.2, 51.5])),
            "rally point 2 has 2 values; it has to have 3",
        ),
    ],
)
def test_what_is_broken_is_refused_with_its_place(content: bytes, sentence: str) -> None:
    with pytest.raises(MissionError, match=sentence) as caught:
        parse_plan(content, "broken.plan")
    assert "'broken.plan' is not a usable plan" in str(caught.value)


@given(st.integers(0, len(GOOD) - 2))
def test_a_plan_cut_anywhere_is_refused(length: int) -> None:
    with pytest.raises(MissionError):
        parse_plan(GOOD[:length], "cut.plan")


JUNK = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3) | st.just([]) | st.just({})


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_junk_anywhere_is_refused_or_read_never_a_crash(data: st.DataObject) -> None:
    document = json.loads(GOOD)
    place: Any = document
    while True:
        key = data.draw(st.sampled_from(sorted(place) if isinstance(place, dict) else range(len(place))))
        if not isinstance(place[key], dict | list) or not place[key] or data.draw(st.booleans()):
            break
        place = place[key]
    place[key] = data.draw(JUNK)
    try:
        plan = parse_plan(json.dumps(document).encode(), "junk.plan")
    except MissionError as error:
        assert "junk.plan" in str(error)
    else:
        assert all(math.isfinite(stop.lat_deg) for stop in plan.stops)
        assert describe_plan(plan).lines


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(MissionError, match=r"cannot read the plan '.*absent.plan'"):
        read_plan(tmp_path / "absent.plan")
    with pytest.raises(MissionError, match="cannot read the plan"):
        read_plan(tmp_path)
