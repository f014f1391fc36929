"""Every kind of vehicle flies, drives or swims what is planned for it, in both flavours, to the end."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mission_strategies import AUTOPILOT_NAMES, KINDS, example_plan
from practice_rig import Rig, mission_messages
from sparsor.mission import Home, time_plan
from sparsor.mission.items import FLOWN_TO
from sparsor.vehicle import load_vehicle

HOME = Home(51.501, 25.2695, 12.5, altitude_known=True)


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_plan_is_flown_to_the_end(kind: str, autopilot: str) -> None:
    vehicle = load_vehicle(kind)
    plan = example_plan(autopilot, stops=3, home=HOME, vehicle=vehicle, span_deg=0.003)
    rig = Rig.of(autopilot, plan=plan, vehicle=vehicle)
    assert rig.upload(mission_messages(plan, autopilot)) == 0
    rig.run(10)
    rig.take_off()
    first = int(autopilot == "ardupilot")
    last = len(plan.items) - 1 + first
    planned_s = time_plan(plan, vehicle).seconds
    assert rig.run(2 * planned_s + 60, until=lambda: not rig.flight.armed, step_s=0.5)
    flown = [place + first for place, item in enumerate(plan.items) if item.command in FLOWN_TO]
    assert rig.reached() == flown
    assert rig.reached()[-1] == last
    assert rig.flight.landed
    assert rig.flight.motion.distance_m(0.0, 0.0) < 5.0
    highest_m = max(up_m for *_, up_m in rig.track)
    assert (highest_m > 10.0) == vehicle.flies
    if not vehicle.flies:
        assert highest_m == 0.0


@pytest.mark.parametrize(
    ("kind", "mission", "word"),
    [("quad", 3, "Copter"), ("plane", 10, "Plane"), ("vtol", 10, "Plane"), ("rover", 10, "Rover")],
)
def test_ardupilots_modes_are_those_of_the_kind(kind: str, mission: int, word: str) -> None:
    rig = Rig.of("ardupilot", plan=example_plan(), vehicle=load_vehicle(kind))
    numbers = {number for _, _, number in rig.flight.flavour.modes}
    assert mission in numbers
    assert word in rig.flight.flavour.title
    rig.run(2.0)
    beats = [one for one in rig.heard if one.get_type() == "HEARTBEAT"]
    assert {beat.type for beat in beats} == {load_vehicle(kind).mav_type}
    names = mavlink.enums["MAV_TYPE"]
    assert names[load_vehicle(kind).mav_type].name.startswith("MAV_TYPE_")


def test_px4_takes_a_rover_that_is_armed_to_be_under_way() -> None:
    vehicle = load_vehicle("rover")
    plan = example_plan("px4", stops=2, home=HOME, vehicle=vehicle, span_deg=0.001)
    rig = Rig.of("px4", plan=plan, vehicle=vehicle)
    assert rig.upload(mission_messages(plan, "px4")) == 0
    rig.run(10)
    before = len(rig.heard)
    rig.take_off()
    rig.run(20)
    states = {one.landed_state for one in rig.heard[before:] if one.get_type() == "EXTENDED_SYS_STATE"}
    assert mavlink.MAV_LANDED_STATE_IN_AIR in states
    assert states <= {mavlink.MAV_LANDED_STATE_IN_AIR, mavlink.MAV_LANDED_STATE_ON_GROUND}
    assert not rig.flight.under_way or rig.flight.armed
