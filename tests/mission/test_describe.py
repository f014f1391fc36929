"""What `sparsor inspect` says of a plan, and the faults it notices."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mission_strategies import QUAD
from sparsor.geodesy.lengths import path_length_m
from sparsor.mission import Fence, Home, MissionItem, MissionPlan, build_mission, describe_plan, plan_faults

LON, LAT = [51.50, 51.51, 51.52], [25.27, 25.28, 25.27]
HOME = Home(51.505, 25.265, 12.0, altitude_known=True)
PLAN = build_mission(LON, LAT, home=HOME, vehicle=QUAD, autopilot="px4", altitude_m=50, hold_s=6, speed_m_s=8)
RETURN = MissionItem(20, 2, (0, 0, 0, 0, 0, 0, 0))


def with_items(*items: MissionItem, plan: MissionPlan = PLAN) -> MissionPlan:
    return replace(plan, items=items)


def test_the_description_is_in_words() -> None:
    said = describe_plan(PLAN)
    assert said.items == {"NAV_TAKEOFF": 1, "DO_CHANGE_SPEED": 1, "NAV_WAYPOINT": 4, "NAV_LAND": 1}
    assert (said.first_item, said.last_item) == ("NAV_TAKEOFF", "NAV_LAND")
    assert said.stops == 3
    assert said.path_length_m == pytest.approx(path_length_m(LON, LAT))
    assert said.hold_s == 18
    assert said.altitudes_m == {"home": [50, 50]}
    assert said.speeds_m_s == [8]
    assert said.faults == []
    text = "\n".join(said.lines)
    assert "Plan for PX4, quadrotor" in text
    assert "12 m above sea level" in text
    assert "Stops 50 m above home" in text


def test_an_unknown_altitude_is_called_so() -> None:
    plan = build_mission(LON, LAT, vehicle=QUAD, autopilot="px4", altitude_m=50)
    assert describe_plan(plan).home_alt_amsl_m is None
    assert "altitude not known" in describe_plan(plan).lines[1]


def test_an_empty_plan_is_described_too() -> None:
    said = describe_plan(with_items())
    assert said.stops == 0
    assert "nothing is flown" in said.faults[0]
    assert said.lines


def test_other_firmware_is_named_by_its_number() -> None:
    said = describe_plan(replace(PLAN, firmware_type=18, vehicle_type=42))
    assert (said.autopilot, said.vehicle) == ("firmware type 18", "vehicle type 42")


BOW_TIE = Fence((51.49, 51.53, 51.53, 51.49), (25.26, 25.30, 25.26, 25.30))
ELSEWHERE = Fence((52.0, 52.1, 52.1), (25.0, 25.0, 25.1))


@pytest.mark.parametrize(
    ("plan", "sentence"),
    [
        (with_items(*PLAN.items[1:]), "not a take-off"),
        (with_items(*PLAN.items[:-1], RETURN), "ends with a return to launch: a straight line home"),
        (with_items(*PLAN.items[:-1]), "neither lands nor returns"),
        (with_items(*PLAN.items, MissionItem(16, 3, (0, 0, 0, 0, 0, 0, 50))), "lies at 0/0"),
        (
            with_items(*PLAN.items, MissionItem(16, 3, (0, 0, 0, 0, 25.27, 51.5, -5))),
            "waypoint -5 m above home",
        ),
        (
            with_items(*PLAN.items, MissionItem(16, 3, (0, 0, 0, 0, 25.27, 51.5, 400))),
            "highest waypoint is 400 m",
        ),
        (with_items(*PLAN.items, MissionItem(16, 10, (0, 0, 0, 0, 25.27, 51.5, 50))), "frame 10"),
        (with_items(*PLAN.items, replace(RETURN, frame=3)), "PX4 takes only frame 2"),
        (with_items(*PLAN.items * 80), "560 mission items are more than the 500 that PX4 stores"),
        (replace(PLAN, rally_points=PLAN.rally_points * 9), "9 rally points are more than the 8"),
        (replace(PLAN, fences=()), "There is no fence"),
        (replace(PLAN, fences=(BOW_TIE,)), "crosses itself"),
        (replace(PLAN, fences=(ELSEWHERE,)), "Home lies outside fence polygon 1"),
        (
            replace(PLAN, fences=(replace(PLAN.fences[0], inclusion=False),)),
            "Home lies inside fence polygon 1",
        ),
        (
            replace(
                PLAN,
                firmware_type=3,
                items=(*PLAN.items, MissionItem(16, 3, (2.5, 0, 0, 0, 25.27, 51.5, 50))),
            ),
            "1 waypoints hold for a fraction of a second, which ArduPilot drops",
        ),
    ],
)
def test_faults_are_sentences(plan: MissionPlan, sentence: str) -> None:
    assert any(sentence in fault for fault in plan_faults(plan)), plan_faults(plan)
