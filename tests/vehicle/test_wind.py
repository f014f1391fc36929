"""Speeds over the ground obey the wind triangle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sparsor.vehicle import SteadyWind, ground_speed_m_s, load_vehicle

PLANE, QUAD, ROVER = (load_vehicle(kind) for kind in ("plane", "quad", "rover"))
COURSES = st.floats(0, 360)


@given(COURSES, st.floats(0, 15), COURSES)
def test_the_airspeed_is_kept(course_deg: float, wind_m_s: float, from_deg: float) -> None:
    ground = float(ground_speed_m_s(PLANE, 18.0, course_deg, SteadyWind(wind_m_s, from_deg)))
    course, blows_to = math.radians(course_deg), math.radians(from_deg + 180)
    east = ground * math.sin(course) - wind_m_s * math.sin(blows_to)
    north = ground * math.cos(course) - wind_m_s * math.cos(blows_to)
    assert math.hypot(east, north) == pytest.approx(18.0)
    assert ground > 0


@given(COURSES, st.floats(0, 9), COURSES)
def test_a_multirotor_gains_nothing_and_what_drives_feels_nothing(course: float, wind: float, from_deg: float) -> None:
    blows = SteadyWind(wind, from_deg)
    assert 0 < float(ground_speed_m_s(QUAD, 10.0, course, blows)) <= 10.0
    assert float(ground_speed_m_s(ROVER, 2.0, course, blows)) == 2.0


@given(st.floats(0.1, 15), COURSES, st.lists(st.tuples(COURSES, st.floats(1, 1000)), min_size=1, max_size=6))
def test_over_a_way_that_comes_home_both_directions_take_the_same(
    wind_m_s: float, from_deg: float, legs: list[tuple[float, float]]
) -> None:
    wind = SteadyWind(wind_m_s, from_deg)
    ways = np.array([[length * math.sin(math.radians(c)), length * math.cos(math.radians(c))] for c, length in legs])
    ways = np.vstack([ways, -ways.sum(axis=0)])
    length, course = np.hypot(*ways.T), np.degrees(np.arctan2(*ways.T))
    there = (length / ground_speed_m_s(PLANE, 18.0, course, wind)).sum()
    back = (length / ground_speed_m_s(PLANE, 18.0, course + 180, wind)).sum()
    assert there == pytest.approx(back)
