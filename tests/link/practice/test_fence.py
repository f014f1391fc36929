"""The fence holds the vehicle where it is told to hold, and only then."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from shapely import Point, Polygon

from mission_strategies import AUTOPILOT_NAMES, QUAD
from practice_rig import ARM, FENCE, START, Rig, item_message, mission_messages
from sparsor.link.practice.fence import _is_inside
from sparsor.link.practice.flavour import Mode
from sparsor.mission import Home, build_mission

HOME = Home(51.5, 25.27)


def out_and_back(autopilot):
    return build_mission([51.505], [25.27], home=HOME, vehicle=QUAD, autopilot=autopilot, altitude_m=30)


def square(half_deg, command=5001, lon=HOME.lon_deg, lat=HOME.lat_deg):
    corners = [(-half_deg, -half_deg), (-half_deg, half_deg), (half_deg, half_deg), (half_deg, -half_deg)]
    return [
        item_message(seq, command, 0, (4, 0, 0, 0, lat + north, lon + east, 0), FENCE)
        for seq, (north, east) in enumerate(corners)
    ]


def flying(autopilot, fence, **parameters):
    plan = out_and_back(autopilot)
    rig = Rig.of(autopilot, plan=plan)
    assert rig.upload(mission_messages(plan, autopilot)) == 0
    assert rig.upload(fence, FENCE) == 0
    for name, value in parameters.items():
        rig.vehicle.parameters.set(name, value)
    rig.run(10)
    rig.take_off()
    rig.run(400, until=lambda: not rig.flight.armed)
    return rig


def farthest_m(rig):
    track = np.array(rig.track)
    return np.hypot(track[:, 1], track[:, 2]).max()


def test_ardupilot_flies_through_a_fence_that_is_not_enabled():
    rig = flying("ardupilot", square(0.002))
    assert farthest_m(rig) > 490
    assert not any("Fence" in text and "breached" in text for text in rig.said())


def test_ardupilot_returns_at_a_fence_that_is_enabled():
    rig = flying("ardupilot", square(0.002), FENCE_ENABLE=1.0, FENCE_TYPE=4.0)
    assert farthest_m(rig) < 260  # 201 m to the fence, and 20 m to brake from 10 m/s
    assert "Fence breached: polygon" in rig.said()
    assert rig.flight.motion.distance_m(0, 0) < 2
    assert not rig.flight.armed


def test_enabling_the_fence_arms_the_default_circle_too():
    rig = flying("ardupilot", square(0.02), FENCE_ENABLE=1.0)
    assert "Fence breached: circle" in rig.said()
    assert 300 < farthest_m(rig) < 350


def test_px4_does_not_start_a_mission_with_a_waypoint_beyond_its_fence():
    plan = out_and_back("px4")
    rig = Rig.of("px4", plan=plan)
    assert rig.upload(square(0.002), FENCE) == 0
    assert rig.upload(mission_messages(plan, "px4")) == 0
    rig.run(10)
    assert rig.command(START) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "Geofence violation for waypoint 3" in rig.said()


def test_px4_takes_a_fence_that_leaves_home_out_and_does_not_use_it():
    plan = out_and_back("px4")
    rig = flying("px4", square(0.002, lon=51.6))
    assert "Geofence invalid, doesn't contain Home position" in rig.said()
    assert farthest_m(rig) > 490
    assert rig.flight.fence.breaches == 0
    assert len(rig.vehicle.store.items[FENCE]) == 4
    # What ends too early holds nothing: home is not in it.
    assert rig.upload(square(0.002)[:3], FENCE) == 0
    assert rig.upload(mission_messages(plan, "px4")) == 0
    assert rig.command(START) == 0


def test_both_want_the_vehicle_inside_all_inclusions():
    small, large = square(0.002), square(0.02)
    fence = [item_message(seq, 5001, 0, _params(one), FENCE) for seq, one in enumerate(large + small)]
    for autopilot, parameters in (("ardupilot", {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0}), ("px4", {})):
        rig = Rig.of(autopilot, plan=out_and_back(autopilot))
        assert rig.upload(fence, FENCE) == 0
        for name, value in parameters.items():
            rig.vehicle.parameters.set(name, value)
        assert rig.flight.fence.shuts_out(100.0, 0.0, 10.0) is None
        assert rig.flight.fence.shuts_out(400.0, 0.0, 10.0) == "polygon"


def _params(message):
    return (message.param1, 0, 0, 0, message.x * 1e-7, message.y * 1e-7, 0)


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_an_exclusion_is_kept_out_of(autopilot):
    fence = square(0.001, command=5002, lon=51.503)
    rig = flying(autopilot, fence, **({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0} if autopilot == "ardupilot" else {}))
    assert 190 < farthest_m(rig) < 270
    assert rig.flight.mode is (Mode.HOLD if autopilot == "px4" else Mode.RETURN)


def test_it_does_not_arm_outside():
    rig = Rig.of("ardupilot", plan=out_and_back("ardupilot"))
    rig.upload(square(0.002, lon=51.6), FENCE)
    rig.vehicle.parameters.set("FENCE_ENABLE", 1.0)
    rig.run(10)
    assert rig.command(ARM, 1) != 0
    assert any("outside fence" in text for text in rig.said())


coordinates = st.floats(-100, 100).map(lambda value: round(value, 1))


@given(st.lists(st.tuples(coordinates, coordinates), min_size=3, max_size=8), coordinates, coordinates)
def test_inside_is_what_shapely_calls_inside(corners, east, north):
    polygon = Polygon(corners)
    if polygon.is_valid and polygon.exterior.distance(Point(east, north)) > 1e-6:
        assert _is_inside((east, north), corners, 0.0) == polygon.contains(Point(east, north))
