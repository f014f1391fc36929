"""Wind: the triangle of speeds, the lean, what it costs, and a wind that is too strong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mission_strategies import AUTOPILOT_NAMES, QUAD, example_plan
from practice_rig import Rig, mission_messages
from sparsor.errors import InputError
from sparsor.link.practice import Wind, WindSettings
from sparsor.link.practice.battery import flying_draw
from sparsor.link.practice.motion import GRAVITY_M_S2, STEEPEST_RAD, Aim, Motion
from sparsor.mission import build_mission

MOST_M_S = 1.5 * QUAD.cruise_m_s
DT_S = 0.05


def flown(wind, aim, seconds):
    """Fly towards an aim; every velocity, and the motion at the end."""
    motion = Motion(QUAD, Wind(wind))
    motion.up_m, speeds = aim.up_m, []
    for _ in range(round(seconds / DT_S)):
        motion.wind.step(DT_S)
        motion.step(aim, DT_S)
        speeds.append((motion.east_m_s, motion.north_m_s, motion.airspeed_m_s))
    return motion, np.array(speeds)


@given(st.floats(0, 20), st.floats(-360, 360), st.floats(1, 30))
def test_the_airspeed_has_a_limit_and_the_track_is_kept_where_it_can_be(speed, from_deg, asked):
    motion, speeds = flown(WindSettings(speed, from_deg), Aim(1e5, 0, 50, asked), 40)
    most = max(MOST_M_S, asked)
    assert speeds[-1, 2] <= most + 1e-6
    towards = math.radians(from_deg + 180)
    tail, cross = speed * math.sin(towards), speed * math.cos(towards)
    reach = tail + math.sqrt(max(most**2 - cross**2, 0))
    if abs(cross) < most - 0.1 and reach > 0.1 and asked >= tail - math.sqrt(most**2 - cross**2):
        # The wind triangle: no drift, as fast as asked for or as the wind allows.
        assert not motion.overpowered
        assert speeds[-1, 1] == pytest.approx(0, abs=1e-6)
        assert speeds[-1, 0] == pytest.approx(min(asked, reach), abs=1e-3)


@pytest.mark.parametrize("from_deg", [0, 90, 200])
def test_it_hovers_in_a_wind_it_can_fly_in_and_is_blown_by_one_it_cannot(from_deg):
    motion, _ = flown(WindSettings(12, from_deg), Aim(0, 0, 50, 10), 60)
    assert motion.distance_m(0, 0) < 0.1
    assert not motion.overpowered
    motion, speeds = flown(WindSettings(20, from_deg), Aim(0, 0, 50, 10), 60)
    assert motion.overpowered
    assert np.hypot(*speeds[-1, :2]) == pytest.approx(20 - MOST_M_S, abs=1e-3)
    downwind = math.radians(from_deg + 180)
    assert math.atan2(*speeds[-1, :2]) == pytest.approx(math.remainder(downwind, 2 * math.pi), abs=0.01)


def test_it_leans_into_the_wind():
    calm, _ = flown(WindSettings(), Aim(0, 0, 50, 10), 5)
    assert (calm.roll_rad, calm.pitch_rad) == (0, 0)
    windy, _ = flown(WindSettings(MOST_M_S, 0), Aim(0, 0, 50, 10), 60)  # from the north, heading north
    assert windy.pitch_rad == pytest.approx(-STEEPEST_RAD, abs=1e-3)
    beside, _ = flown(WindSettings(6, 90), Aim(0, 0, 50, 10), 60)  # from the east, heading north
    drag = 6 / MOST_M_S * math.tan(STEEPEST_RAD)
    assert beside.roll_rad == pytest.approx(math.atan(drag), abs=1e-3)
    assert math.tan(beside.roll_rad) * GRAVITY_M_S2 > 0


@given(st.floats(0, 60), st.floats(0, 60))
def test_flying_faster_through_the_air_never_takes_less(one, other):
    low, high = sorted((one, other))
    assert 1 <= flying_draw(low, 10) <= flying_draw(high, 10)
    assert flying_draw(10, 10) == 1


def test_gusts_have_their_size_their_memory_and_their_seed():
    def drawn(seed, dt_s=0.05, count=40_000):
        wind, found = Wind(WindSettings(5, 270, 2), seed), []
        for _ in range(count):
            wind.step(dt_s)
            found.append((wind.east_m_s, wind.north_m_s))
        return np.array(found)

    east, north = drawn(1).T
    assert east.mean() == pytest.approx(5, abs=0.5)
    assert north.mean() == pytest.approx(0, abs=0.5)
    assert (east.std(), north.std()) == pytest.approx((2, 2), rel=0.15)
    memory = np.corrcoef(east[:-80], east[80:])[0, 1]  # 80 steps are the gust's own time: 1 / e
    assert memory == pytest.approx(math.exp(-1), abs=0.15)
    assert np.array_equal(drawn(1, count=50), drawn(1, count=50))
    assert not np.array_equal(drawn(1, count=50), drawn(2, count=50))
    assert drawn(1, dt_s=1.0, count=4000)[:, 0].std() == pytest.approx(2, rel=0.15)


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_a_leg_against_the_wind_takes_longer_and_costs_more(autopilot):
    plan = build_mission(
        [51.50, 51.51], [25.27, 25.27], vehicle=QUAD, autopilot=autopilot, altitude_m=30, hold_s=0, speed_m_s=10
    )

    def flight(wind):
        rig = Rig.of(autopilot, plan=plan, wind=wind)
        rig.upload(mission_messages(plan, autopilot))
        rig.run(10)
        rig.take_off()
        assert rig.run(900, until=lambda: rig.flight.motion.east_m > 900)
        return rig.vehicle.time_s, rig.flight.battery.level

    calm_s, calm_left = flight(WindSettings())
    against_s, against_left = flight(WindSettings(10, 90))
    assert against_s - 10 > 1.5 * (calm_s - 10)
    assert against_left < calm_left


@pytest.mark.parametrize(("autopilot", "name"), [("ardupilot", "WIND"), ("px4", "WIND_COV")])
def test_the_wind_and_the_airspeed_are_told(autopilot, name):
    plan = example_plan(autopilot, stops=3)
    rig = Rig.of(autopilot, plan=plan, wind=WindSettings(6, 90))
    number, other = (168, 231) if autopilot == "ardupilot" else (231, 168)
    assert rig.command(511, number, 1e6) == 0
    assert rig.command(511, 74, 1e6) == 0
    assert rig.command(511, other, 1e6) != 0
    rig.upload(mission_messages(plan, autopilot))
    rig.run(10)
    rig.take_off()
    rig.run(60)
    told = [one for one in rig.heard if one.get_type() == name][-1]
    if name == "WIND":
        assert (told.direction, told.speed) == pytest.approx((90, 6))
    else:
        assert (told.wind_x, told.wind_y) == pytest.approx((0, -6))
    hud = [one for one in rig.heard if one.get_type() == "VFR_HUD"][-1]
    assert hud.airspeed != pytest.approx(hud.groundspeed, abs=0.5)


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_a_wind_that_is_too_strong_is_said_and_takes_the_vehicle_along(autopilot):
    plan = example_plan(autopilot, stops=3)
    rig = Rig.of(autopilot, plan=plan, wind=WindSettings(25, 270))
    rig.upload(mission_messages(plan, autopilot))
    rig.run(10)
    rig.take_off()
    assert rig.run(300, until=lambda: rig.flight.motion.east_m > 500)
    assert any("too strong, drifting" in text for text in rig.said())


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"speed_m_s": -1}, "a wind of -1 m/s"),
        ({"speed_m_s": math.nan}, "a wind of nan"),
        ({"from_deg": 400}, "from 400 degrees"),
        ({"gusts_m_s": 100}, "gusts of 100"),
    ],
)
def test_a_wind_out_of_range_is_named(wrong, sentence):
    with pytest.raises(InputError, match=sentence):
        WindSettings(**wrong)
