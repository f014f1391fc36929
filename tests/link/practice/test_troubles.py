"""What goes wrong on request, what the vehicle says of it and does about it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mission_strategies import AUTOPILOT_NAMES, example_plan
from practice_rig import STATION, Rig, mission_messages
from sparsor.errors import InputError
from sparsor.link.practice import LinkTroubles, SensorSettings, Troubles, Window, WindSettings
from sparsor.link.practice.failsafes import COASTING_S
from sparsor.link.practice.flavour import Mode
from sparsor.link.practice.links import Way

WINDOW = (Window(40, 80),)


def in_the_air(autopilot, troubles, **settings):
    """A rig whose vehicle has just taken off, with position and GPS asked for."""
    plan = example_plan(autopilot, stops=5)
    settings.setdefault("truth", lambda *_: 0.5)
    rig = Rig.of(autopilot, plan=plan, troubles=troubles, **settings)
    for number in (24, 33):
        assert rig.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, number, 1e6) == 0
    rig.upload(mission_messages(plan, autopilot))
    rig.send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3))
    rig.run(10)
    rig.take_off()
    assert rig.run(20, until=lambda: rig.flight.flown_s is not None, step_s=0.05)
    return rig


def heard(rig, name, from_s=-math.inf, to_s=math.inf):
    """Messages of a kind with a time, seconds since take-off."""
    off_s = rig.flight.took_off_s
    of_kind = [one for one in rig.heard if one.get_type() == name]
    stamps = [one.time_boot_ms / 1e3 if hasattr(one, "time_boot_ms") else one.time_usec / 1e6 for one in of_kind]
    return [one for one, at_s in zip(of_kind, stamps, strict=True) if from_s <= at_s - off_s < to_s]


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_nothing_goes_wrong_before_the_take_off(autopilot):
    rig = Rig.of(autopilot, troubles=Troubles(WINDOW, WINDOW, WINDOW, 0.0), truth=lambda *_: 0.5)
    rig.run(100)
    assert rig.flight.has_fix
    assert rig.flight.battery.percent == 100
    assert len(rig.vehicle.samples) == 100
    assert rig.said() == []


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_a_silent_sensor_is_silent_for_as_long_and_draws_the_same_noise(autopilot):
    rig, whole = (in_the_air(autopilot, troubles) for troubles in (Troubles(silent_sensor=WINDOW), Troubles()))
    for one in (rig, whole):
        one.run(120)
    assert heard(rig, "NAMED_VALUE_FLOAT", 40, 80) == []
    assert len(heard(rig, "NAMED_VALUE_FLOAT", 0, 40)) == pytest.approx(40, abs=1)
    assert set(rig.vehicle.samples) < set(whole.vehicle.samples)
    assert len(whole.vehicle.samples) - len(rig.vehicle.samples) == pytest.approx(40, abs=1)


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_without_gps_the_position_goes_stale_and_the_vehicle_comes_down(autopilot):
    rig = in_the_air(autopilot, Troubles(gps_outage=(Window(40, 400),)), wind=WindSettings(5, 180))
    rig.run(39.5)
    assert rig.flight.mode is Mode.MISSION
    rig.run(COASTING_S[autopilot] + 2)
    assert rig.flight.mode is Mode.LAND
    fixes = heard(rig, "GPS_RAW_INT", 40.1)
    assert {one.fix_type for one in fixes} == {mavlink.GPS_FIX_TYPE_NO_FIX}
    assert len({(one.lat, one.lon) for one in fixes}) == 1  # where the last fix was
    assert any("Failsafe" in text for text in rig.said())
    assert rig.run(200, until=lambda: not rig.flight.armed)
    stale = heard(rig, "GLOBAL_POSITION_INT", 41 + COASTING_S[autopilot])
    if autopilot == "px4":
        assert stale == []
    else:
        assert len(stale) > 5
        assert len({(one.lat, one.lon) for one in stale}) == 1
        assert stale[-1].relative_alt < stale[0].relative_alt
    # It came down with the wind, not straight.
    drift = np.array([row for row in rig.track if row[0] > rig.flight.took_off_s + 60])
    assert drift[-1, 2] - drift[0, 2] > 20
    assert rig.command(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH) != 0


def test_after_the_outage_px4_goes_on_and_ardupilot_stays_in_land():
    for autopilot, mode, said in (("px4", Mode.MISSION, "started"), ("ardupilot", Mode.LAND, "Failsafe Cleared")):
        rig = in_the_air(autopilot, Troubles(gps_outage=(Window(40, 55),)))
        rig.run(58)
        assert not rig.flight.landed
        assert rig.flight.mode is mode
        assert any(said in text for text in rig.said())
        position = heard(rig, "GLOBAL_POSITION_INT")[-1]
        assert (position.lon / 1e7, position.lat / 1e7) == pytest.approx(rig.flight.lon_lat_deg, abs=2e-4)


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_a_short_outage_is_flown_through(autopilot):
    rig = in_the_air(autopilot, Troubles(gps_outage=(Window(40, 44),)))
    rig.run(60)
    assert rig.flight.mode is Mode.MISSION
    assert heard(rig, "GPS_RAW_INT")[-1].fix_type == mavlink.GPS_FIX_TYPE_3D_FIX


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_a_low_battery_comes_home(autopilot):
    rig = in_the_air(autopilot, Troubles(low_battery_s=60))
    rig.run(55)
    assert rig.flight.mode is Mode.MISSION
    rig.run(10)
    assert rig.flight.mode is Mode.RETURN
    assert rig.flight.battery.percent <= 15
    assert any("attery" in text and "low" in text.lower() for text in rig.said())
    assert rig.run(600, until=lambda: not rig.flight.armed)
    assert rig.flight.motion.distance_m(0, 0) < 2


def test_a_battery_that_is_all_but_empty_lands_where_it_is():
    rig = in_the_air("ardupilot", Troubles())
    rig.run(60)
    rig.flight.battery.level = 0.04
    rig.run(5)
    assert rig.flight.mode is Mode.LAND
    assert rig.command(mavlink.MAV_CMD_NAV_LAND) == 0
    assert rig.run(300, until=lambda: not rig.flight.armed)


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_a_link_loss_lets_nothing_through_and_the_mission_goes_on(autopilot):
    rig = in_the_air(autopilot, Troubles(link_loss=WINDOW))
    rig.run(41)
    rig.heard.clear()
    rig.run(38)
    assert rig.send(mavlink.MAVLink_param_request_list_message(1, 1)) == []
    assert rig.heard == []
    rig.run(5)
    assert "HEARTBEAT" in {one.get_type() for one in rig.heard}
    assert rig.flight.mode is Mode.MISSION  # FS_GCS_ENABLE and NAV_DLL_ACT are 0


@pytest.mark.parametrize(
    ("autopilot", "name", "value", "mode"),
    [
        ("ardupilot", "FS_GCS_ENABLE", 1, Mode.RETURN),
        ("ardupilot", "FS_GCS_ENABLE", 5, Mode.LAND),
        ("px4", "NAV_DLL_ACT", 1, Mode.HOLD),
        ("px4", "NAV_DLL_ACT", 2, Mode.RETURN),
        ("px4", "NAV_DLL_ACT", 3, Mode.LAND),
    ],
)
def test_what_the_vehicle_does_without_a_ground_station_is_a_parameter(autopilot, name, value, mode):
    rig = in_the_air(autopilot, Troubles(link_loss=WINDOW))
    rig.vehicle.parameters.set(name, value)
    rig.run(44)
    assert rig.flight.mode is Mode.MISSION
    rig.run(8)
    assert rig.flight.mode is mode
    rig.run(30)
    assert any("Cleared" in text or "regained" in text for text in rig.said())


def test_the_same_seed_has_the_same_bad_day():
    troubles = Troubles((Window(20, 30),), (Window(40, 60),), (Window(70, 75),), 90)

    def flown(step_s):
        noisy = SensorSettings(noise_ppb=3, drop_out_fraction=0.1)
        rig = in_the_air(
            "px4", troubles, wind=WindSettings(6, 30, 2), seed=5, sensor=noisy, truth=lambda lon, _: lon % 1
        )
        off_s = rig.vehicle.time_s
        rig.run(150, step_s=step_s)
        return [one for one in rig.vehicle.samples if one.time_s < off_s + 149]

    assert flown(0.05) == flown(2.5)


def test_a_way_loses_repeats_and_delays_as_much_as_asked_for_and_keeps_the_order():
    way = Way(LinkTroubles(0.2, 0.1, 0.5), 3, 1, 0)
    for number in range(10_000):
        way.put(number, now_s=number * 1e-3)
    assert list(way.arrived(0.4999)) == []
    first = list(way.arrived(1.0))
    assert first == sorted(first)
    assert max(first) <= 500
    every = first + list(way.arrived(1e9))
    assert every == sorted(every)
    assert len(set(every)) == pytest.approx(8000, rel=0.03)
    assert len(every) - len(set(every)) == pytest.approx(800, rel=0.2)
    good = Way(LinkTroubles(), 3, 1, 0)
    good.put("this", now_s=5.0)
    assert list(good.arrived(5.0)) == ["this"]


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Window.parse("60"), "'60' is not a window; give FROM:TO"),
        (lambda: Window.parse("-5:10"), "is not a window"),
        (lambda: Window.parse("90:60"), "a window of 90:60 s"),
        (lambda: Window(0, math.nan), "a window of 0:nan s"),
        (lambda: LinkTroubles(lose=1.0), "a share of 1 of the messages lost"),
        (lambda: LinkTroubles(repeat=-0.1), "a share of -0.1 of the messages repeated"),
        (lambda: LinkTroubles(delay_s=11), "a delay of 11 s"),
        (lambda: Troubles(low_battery_s=-1), "a low battery at -1 s"),
    ],
)
def test_troubles_out_of_range_are_named(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()


def test_the_rig_hears_as_a_ground_station():
    rig = in_the_air("px4", Troubles())
    assert rig.flight.station_heard
    assert STATION.system == 255
