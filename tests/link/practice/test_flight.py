"""The practice vehicle flies what was uploaded, as far and as long as the plan says, and ends on the ground."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mission_strategies import AUTOPILOT_NAMES, QUAD, example_plan, plans
from practice_rig import ARM, START, Rig, item_message, mission_messages
from sparsor.geodesy.lengths import distance_m
from sparsor.link.practice.flavour import Mode
from sparsor.link.practice.place import FlatMap
from sparsor.mission import Home, build_mission, flight_time_s


def flown(plan, autopilot, **options):
    rig = Rig.of(autopilot, plan=plan, **options)
    if autopilot == "px4":  # else a take-off to 3 m at least
        rig.vehicle.parameters.set("NAV_ACC_RAD", 0.0)
    assert rig.upload(mission_messages(plan, autopilot)) == 0
    rig.run(10)
    rig.take_off()
    assert rig.run(4 * flight_time_s(plan, QUAD) + 60, until=lambda: not rig.flight.armed, step_s=0.05)
    return rig


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_every_item_is_reached_in_order_and_every_waypoint_within_its_radius(autopilot):
    plan = example_plan(autopilot, stops=5)
    rig = flown(plan, autopilot)
    first = 1 if autopilot == "ardupilot" else 0
    numbers = [seq + first for seq, item in enumerate(plan.items) if item.command in (16, 21, 22)]
    assert rig.reached() == numbers
    track = np.array(rig.track)
    for item in plan.items:
        if item.command == 16:
            east, north = rig.flight.place.metres(item.lon_deg, item.lat_deg)
            near = np.hypot(track[:, 1] - east, track[:, 2] - north) <= QUAD.acceptance_radius_m
            near &= np.abs(track[:, 3] - item.altitude_m) <= QUAD.acceptance_radius_m
            assert near.sum() * 0.05 >= item.hold_s
    assert rig.flight.landed
    assert rig.flight.motion.distance_m(0, 0) < 1
    assert rig.flight.motion.up_m == 0


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
@pytest.mark.parametrize("hold_s", [0, 6])
def test_it_takes_about_the_time_that_the_plan_says(autopilot, hold_s):
    plan = build_mission(
        [51.50, 51.505, 51.505], [25.27, 25.27, 25.275], vehicle=QUAD, autopilot=autopilot, altitude_m=30, hold_s=hold_s
    )
    rig = Rig.of(autopilot, plan=plan)
    rig.upload(mission_messages(plan, autopilot))
    rig.run(10)
    rig.take_off()
    began = rig.vehicle.time_s
    rig.run(3000, until=lambda: rig.flight.landed and rig.vehicle.time_s > began + 10, step_s=0.05)
    assert rig.vehicle.time_s - began == pytest.approx(flight_time_s(plan, QUAD), rel=0.1)


@settings(max_examples=12, deadline=None)
@given(plans(largest_m=500.0))
def test_limits_hold_at_every_step_of_any_mission(plan):
    rig = flown(plan, plan.autopilot.name, ready_s=2.0)
    track = np.array(rig.track)
    steps = np.diff(track, axis=0)
    moving = steps[:, 0] > 0
    velocity = steps[moving, 1:] / steps[moving, :1]
    speed = max(plan.hover_m_s, QUAD.cruise_m_s)
    assert np.hypot(velocity[:, 0], velocity[:, 1]).max() <= speed + 1e-6
    change = np.diff(velocity[:, :2], axis=0)
    # Touching down ends what little drift is left.
    assert np.hypot(change[:, 0], change[:, 1]).max() <= QUAD.acceleration_m_s2 * 0.05 + 0.01
    assert velocity[:, 2].max() <= QUAD.climb_m_s + 1e-6
    assert velocity[:, 2].min() >= -QUAD.descent_m_s - 1e-6


def test_ardupilot_stays_down_until_mission_start_and_disarms_itself():
    plan = example_plan("ardupilot")
    rig = Rig.of("ardupilot", plan=plan)
    rig.upload(mission_messages(plan, "ardupilot"))
    rig.run(10)
    assert rig.command(ARM, 1) == 0
    assert rig.command(mavlink.MAV_CMD_DO_SET_MODE, 1, 3) == 0
    assert rig.run(30, until=lambda: not rig.flight.armed)
    assert rig.flight.motion.up_m == 0
    assert rig.command(ARM, 1) == mavlink.MAV_RESULT_FAILED
    assert any("AUTO mode not armable" in text for text in rig.said())


def test_px4_takes_off_when_it_is_armed_in_mission_mode():
    plan = example_plan("px4")
    rig = Rig.of("px4", plan=plan)
    rig.upload(mission_messages(plan, "px4"))
    rig.run(10)
    assert rig.command(mavlink.MAV_CMD_DO_SET_MODE, 1, 4, 4) == 0
    assert rig.command(ARM, 1) == 0
    assert rig.run(20, until=lambda: rig.flight.motion.up_m > 5)


@pytest.mark.parametrize(
    ("autopilot", "result", "said"),
    [("ardupilot", mavlink.MAV_RESULT_FAILED, "PreArm"), ("px4", mavlink.MAV_RESULT_TEMPORARILY_REJECTED, "denied")],
)
def test_it_does_not_arm_before_it_is_ready(autopilot, result, said):
    rig = Rig.of(autopilot)
    rig.run(1)
    assert rig.command(ARM, 1) == result
    assert any(said in text for text in rig.said())
    assert rig.command(ARM, 1, 21196) == 0


def test_ardupilot_arms_before_auto_is_allowed():
    plan = example_plan("ardupilot")
    rig = Rig.of("ardupilot", plan=plan, ready_s=10)
    rig.upload(mission_messages(plan, "ardupilot"))
    rig.run(9)
    assert rig.command(ARM, 1) == 0
    assert rig.command(START) == mavlink.MAV_RESULT_FAILED
    assert "Mode change to AUTO failed: requires position" in rig.said()
    rig.run(1.5)
    assert rig.command(START) == 0


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_no_mission_is_no_mission(autopilot):
    rig = Rig.of(autopilot)
    rig.run(10)
    assert rig.command(START) != 0


def test_px4_refuses_what_navigator_refuses():
    plan = example_plan("px4")
    rig = Rig.of("px4", plan=plan)
    rig.run(10)
    away = item_message(0, 22, 3, (0, 0, 0, 0, plan.home.lat_deg + 0.5, plan.home.lon_deg, 50))
    assert rig.upload([away]) == 0
    assert rig.command(START) != 0
    assert any("too far away" in text for text in rig.said())


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_return_to_launch_comes_home_and_disarms(autopilot):
    plan = example_plan(autopilot, stops=3)
    rig = Rig.of(autopilot, plan=plan)
    rig.upload(mission_messages(plan, autopilot))
    rig.run(10)
    rig.take_off()
    rig.run(100)
    assert rig.flight.motion.distance_m(0, 0) > 100
    assert rig.command(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH) == 0
    assert rig.run(900, until=lambda: not rig.flight.armed)
    assert rig.flight.motion.distance_m(0, 0) < 2


def test_a_flight_beyond_the_battery_returns():
    plan = example_plan("px4", stops=9)
    rig = Rig.of("px4", plan=plan, vehicle=QUAD.model_copy(update={"endurance_s": 200.0}))
    rig.upload(mission_messages(plan, "px4"))
    rig.run(10)
    rig.take_off()
    assert rig.run(400, until=lambda: rig.flight.mode is Mode.RETURN)
    assert any("Low battery" in text for text in rig.said())


def test_ardupilot_sends_nothing_but_heartbeats_until_asked_and_px4_does():
    def names(rig):
        rig.heard.clear()
        rig.run(12)
        return {one.get_type() for one in rig.heard} - {"STATUSTEXT", "MISSION_CURRENT"}

    rig = Rig.of("ardupilot")
    assert names(rig) == {"HEARTBEAT"}
    rig.send(mavlink.MAVLink_request_data_stream_message(1, 1, mavlink.MAV_DATA_STREAM_POSITION, 5, 1))
    assert names(rig) == {"HEARTBEAT", "GLOBAL_POSITION_INT"}
    assert sum(one.get_type() == "GLOBAL_POSITION_INT" for one in rig.heard) == pytest.approx(60, abs=1)
    assert rig.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 245, 500_000) == 0
    assert "EXTENDED_SYS_STATE" in names(rig)
    assert rig.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 245, -1) == 0
    assert "EXTENDED_SYS_STATE" not in names(rig)
    assert {"GLOBAL_POSITION_INT", "ATTITUDE", "GPS_RAW_INT", "SYS_STATUS", "SYSTEM_TIME"} <= names(Rig.of("px4"))


def test_times_in_messages_are_the_flights_own():
    rig = Rig.of("px4", boot_unix_s=1.7e9)
    rig.run(20)
    times = [one for one in rig.heard if one.get_type() == "SYSTEM_TIME"]
    assert times[0].time_unix_usec == 0  # no fix yet
    assert times[-1].time_unix_usec == pytest.approx(1.7e15 + times[-1].time_boot_ms * 1e3, abs=1e3)
    boots = [one.time_boot_ms for one in rig.heard if one.get_type() == "GLOBAL_POSITION_INT"]
    assert np.diff(boots)[1:] == pytest.approx(200)
    assert boots[-1] <= rig.vehicle.time_s * 1000 + 1


@given(st.floats(-180, 180), st.floats(-80, 80), st.floats(-3000, 3000), st.floats(-3000, 3000))
def test_the_flat_map_measures_as_the_ellipsoid_does(lon, lat, east, north):
    there = FlatMap(lon, lat).degrees(east, north)
    assert FlatMap(lon, lat).metres(*there) == pytest.approx((east, north), abs=1e-4)
    expected = float(np.hypot(east, north))
    assert float(distance_m(lon, lat, *there)) == pytest.approx(expected, rel=4e-3, abs=0.01)


def test_home_above_the_sea_is_in_the_heights():
    plan = example_plan("px4", home=Home(51.505, 25.265, 100.0, altitude_known=True))
    rig = Rig.of("px4", plan=plan)
    rig.run(10)
    last = [one for one in rig.heard if one.get_type() == "GLOBAL_POSITION_INT"][-1]
    assert (last.alt, last.relative_alt, last.lat, last.lon) == (100_000, 0, 252_650_000, 515_050_000)
