"""Triggers: on while the vehicle waits at a stop, in the form that each autopilot takes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mission_strategies import AUTOPILOT_NAMES, KINDS
from practice_rig import Rig, mission_messages
from sparsor.errors import MissionError
from sparsor.link.missions.readback import differences
from sparsor.link.missions.wire import MISSION, WireItem, wire_items
from sparsor.mission import MissionPlan, build_mission, describe_plan, parse_plan, plan_bytes, plan_faults, time_plan
from sparsor.mission.items import NAV_LOITER_TIME, WAYPOINTS
from sparsor.mission.triggers import Trigger, parse_trigger
from sparsor.vehicle import autopilot_named, load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable

ALL = ("servo:9:1900:1100", "relay:2", "message:7", "camera-distance:25")
TAKEN = {"ardupilot": ALL, "px4": ALL[3:]}
LON, LAT = np.array([51.506, 51.508, 51.507]), np.array([25.27, 25.271, 25.273])
SWITCHES = {181, 183, 206, 217}


def made(kind: str, autopilot: str, triggers: Any, hold_s: Any = 4.0) -> MissionPlan:
    vehicle = load_vehicle(kind)
    return build_mission(
        LON, LAT, vehicle=vehicle, autopilot=autopilot, altitude_m=60 if vehicle.flies else 0, hold_s=hold_s,
        triggers=[parse_trigger(one) for one in triggers],
    )  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_each_is_on_while_the_vehicle_waits_and_at_no_other_time(kind: str) -> None:
    plan = made(kind, "ardupilot", ALL, hold_s=[4.0, 0.0, 6.0])
    state: dict[int, tuple[float, ...]] = {}
    at, on_where, waits = None, [], []
    for item in plan.items:
        if item.command in SWITCHES:
            state[item.command] = item.params
        elif item.command in WAYPOINTS | {NAV_LOITER_TIME}:
            # What was switched on before this item is on all the way to it: the vehicle has to be there already.
            on = [state.get(181, (0, 0))[1] == 1, state.get(183, (0, 0))[1] == 1900, state.get(217, (0, 0))[1] == 1]
            assert len(set(on)) == 1
            if on[0]:
                assert at == item.params[4:6]
                on_where.append(at)
            if item.hold_s:
                waits.append(item.params[4:6])
            at = item.params[4:6]
    assert on_where == waits == [(25.27, 51.506), (25.273, 51.507)]
    assert (state[181][1], state[183][1], state[217][1], state[206][0]) == (0, 1100, 0, 0)
    assert [item.params[2] for item in plan.items if item.command == 217] == [1, 1, 3, 3]
    distances = [index for index, item in enumerate(plan.items) if item.command == 206]
    stops = [plan.items.index(stop) for stop in plan.stops]
    assert (stops[0] < distances[0] < stops[1], distances[1] > stops[2]) == (True, True)
    assert plan.items[distances[0]].params[:3] == (25, 0, 1)


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
@pytest.mark.parametrize("kind", KINDS)
def test_they_change_neither_stops_nor_time_and_pass_every_reader(
    kind: str, autopilot: str, importers: dict[str, Callable[[str], Any]]
) -> None:
    plan, plain = made(kind, autopilot, TAKEN[autopilot]), made(kind, autopilot, ())
    assert plan.stops == plain.stops
    assert (plan.passing, plan.fences) == (plain.passing, plain.fences)
    vehicle = load_vehicle(kind)
    assert time_plan(plan, vehicle).seconds == pytest.approx(time_plan(plain, vehicle).seconds)
    again = parse_plan(plan_bytes(plan), "it")
    assert again == plan
    assert again.stops == plan.stops
    assert plan_faults(plan) == plan_faults(plain)
    assert describe_plan(again).stops == 3
    received = list(importers[autopilot](plan_bytes(plan).decode()).mission_items)
    if autopilot == "ardupilot":
        received.pop(0)
    for item, got in zip(plan.items, received, strict=True):
        assert (got.command, got.frame) == (item.command, item.frame)
        if item.command in SWITCHES:
            assert (got.param1, got.param2, got.param3, got.param4, got.x, got.y, got.z) == item.params


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
@pytest.mark.parametrize("kind", ["quad", "plane", "rover"])
def test_a_flight_with_triggers_is_uploaded_read_back_and_flown(kind: str, autopilot: str) -> None:
    plan = made(kind, autopilot, TAKEN[autopilot])
    rig = Rig.of(autopilot, plan=plan, vehicle=load_vehicle(kind))
    assert rig.upload(mission_messages(plan, autopilot)) == 0
    facts = autopilot_named(autopilot)
    sent = wire_items(plan, facts)[MISSION]
    held = [
        WireItem(one.command, one.frame, one.params, one.x, one.y, one.z)
        for one in rig.vehicle.flight.store.items[MISSION]
    ]
    found = differences(MISSION, sent, held, home_is_item_0=facts.home_is_item_0)
    assert [one.sentence for one in found if not one.harmless] == []
    rig.run(10)
    rig.take_off()
    done = (lambda: rig.flight.navigator.finished) if kind == "rover" else (lambda: not rig.flight.armed)
    assert rig.run(3000, until=done)
    reached = {message.seq for message in rig.heard if message.get_type() == "MISSION_ITEM_REACHED"}
    first = int(facts.home_is_item_0)
    stops = {index + first for index, item in enumerate(plan.items) if item in plan.stops}
    assert stops <= reached


def test_a_lost_servo_value_is_a_difference_that_counts() -> None:
    sent = [WireItem(183, 2, (9, 1900, 0, 0), 0, 0, 0.0)]
    held = [WireItem(183, 0, (9, 1100, 0, 0), 0, 0, 0.0)]
    found = differences(MISSION, sent, held, home_is_item_0=False)
    assert [one.harmless for one in found] == [True, False]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("pump:1", "allowed are servo:CHANNEL:PWM_ON:PWM_OFF, relay:NUMBER, camera-distance:METRES, message:ID"),
        ("servo:9:1900", "allowed are servo:CHANNEL"),
        ("servo:0:1900:1100", "its CHANNEL is '0'; allowed are 1..32"),
        ("servo:9:19000:1100", "its PWM_ON is '19000'; allowed are 500..2500"),
        ("relay:x", "its NUMBER is 'x'"),
        ("relay:1.5", "its NUMBER is '1.5'"),
        ("relay:nan", "its NUMBER is 'nan'"),
        ("camera-distance:0", "its METRES is '0'"),
        ("message:70000", "its ID is '70000'"),
    ],
)
def test_what_is_no_trigger_is_refused(text: str, words: str) -> None:
    with pytest.raises(MissionError, match=words):
        parse_trigger(text)


@pytest.mark.parametrize("text", ALL[:3])
def test_px4_takes_the_camera_alone(text: str) -> None:
    with pytest.raises(MissionError, match="PX4 refuses a mission with a"):
        made("quad", "px4", [text])
    other = made("quad", "ardupilot", [text])
    on_px4 = MissionPlan(**{**vars(other), "firmware_type": 12})
    assert any("PX4 refuses" in sentence for sentence in plan_faults(on_px4))


def test_where_nothing_waits_there_is_nothing_to_switch() -> None:
    with pytest.raises(MissionError, match="no stop is waited at"):
        made("quad", "ardupilot", ALL, hold_s=0.0)
    assert len(made("quad", "ardupilot", ALL[3:], hold_s=0.0).items) == len(made("quad", "ardupilot", ()).items) + 2


def test_items_for_triggers_count() -> None:
    many = np.linspace(51.5, 51.52, 200)
    with pytest.raises(MissionError, match="200 stops, with 600 items beside them"):
        build_mission(
            many, many - 26.2, vehicle=load_vehicle("quad"), autopilot="ardupilot", altitude_m=50, hold_s=3,
            triggers=[Trigger("relay", (0.0,))],
        )  # fmt: skip
