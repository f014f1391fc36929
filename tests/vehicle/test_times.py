"""Flight times obey the laws of moving at bounded speed and acceleration."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sparsor.errors import VehicleError
from sparsor.vehicle import (
    AUTOPILOTS,
    autopilot_named,
    flight_seconds,
    landing_seconds,
    leg_seconds,
    load_vehicle,
    stop_seconds,
    takeoff_seconds,
    usable_seconds,
)

QUAD = load_vehicle("quad")
LENGTHS = st.floats(0, 1e6)
SPEEDS = st.floats(0.5, 30)
HEIGHTS = st.floats(0.1, 500)


@given(LENGTHS, LENGTHS, SPEEDS)
def test_legs_add_up(first_m: float, second_m: float, speed_m_s: float) -> None:
    together = leg_seconds(QUAD, first_m + second_m, speed_m_s)
    apart = leg_seconds(QUAD, first_m, speed_m_s) + leg_seconds(QUAD, second_m, speed_m_s)
    assert math.isclose(together, apart, abs_tol=1e-9)


@given(st.floats(0.1, 1000), SPEEDS)
def test_a_stop_costs_its_hold_and_the_way_from_speed_to_rest_and_back(hold_s: float, speed_m_s: float) -> None:
    braking_s = speed_m_s / QUAD.acceleration_m_s2
    # Both ramps cover half of what flying through covers in the same time.
    ramps_m = 2 * speed_m_s**2 / (2 * QUAD.acceleration_m_s2)
    lost_s = 2 * braking_s - ramps_m / speed_m_s
    assert math.isclose(stop_seconds(QUAD, hold_s, speed_m_s), hold_s + lost_s)
    assert stop_seconds(QUAD, 0.0, speed_m_s) == 0


@given(HEIGHTS, HEIGHTS)
def test_higher_takes_longer(one_m: float, other_m: float) -> None:
    low, high = sorted((one_m, other_m))
    assert takeoff_seconds(QUAD, low) <= takeoff_seconds(QUAD, high)
    assert landing_seconds(QUAD, low) <= landing_seconds(QUAD, high)
    assert landing_seconds(QUAD, high) >= high / QUAD.descent_m_s


def test_the_last_metres_of_a_landing_are_slow() -> None:
    assert landing_seconds(QUAD, 40) == pytest.approx(30 / 1.5 + 10 / 0.5)
    assert landing_seconds(QUAD, 5) == pytest.approx(5 / 0.5)


def test_a_flight_is_the_sum_of_its_parts() -> None:
    seconds = flight_seconds(QUAD, path_length_m=3000, transit_m=500, stops=10, hold_s=20, altitude_m=50, speed_m_s=5)
    assert seconds == pytest.approx(50 / 2.5 + 3500 / 5 + 10 * (20 + 2) + 2 + 40 / 1.5 + 10 / 0.5)
    assert usable_seconds(QUAD) == pytest.approx(0.8 * 2100)


@given(LENGTHS, st.integers(0, 100), st.floats(0, 60), HEIGHTS, SPEEDS)
def test_more_of_anything_never_takes_less_time(
    path_m: float, stops: int, hold_s: float, altitude_m: float, speed_m_s: float
) -> None:
    def seconds(**changes: float) -> float:
        arguments = {"path_length_m": path_m, "transit_m": 10.0, "hold_s": hold_s, "altitude_m": altitude_m}
        return flight_seconds(QUAD, stops=stops, speed_m_s=speed_m_s, **(arguments | changes))

    base = seconds()
    assert seconds(path_length_m=path_m + 10) > base
    assert seconds(hold_s=hold_s + 1) >= base
    assert seconds(altitude_m=altitude_m + 1) > base


def test_facts_about_autopilots() -> None:
    ardupilot, px4 = AUTOPILOTS["ardupilot"], autopilot_named("px4")
    assert (ardupilot.firmware_type, px4.firmware_type) == (3, 12)
    assert (ardupilot.max_items, px4.max_items) == (650, 500)
    assert (ardupilot.max_fence_points, px4.max_fence_points) == (70, 64)
    assert (ardupilot.max_rally_points, px4.max_rally_points) == (46, 8)
    assert [ardupilot.written_hold_s(hold) for hold in (0, 0.1, 2.0, 2.5)] == [0, 1, 2, 3]
    assert px4.written_hold_s(2.5) == 2.5
    with pytest.raises(VehicleError, match="unknown autopilot 'inav'"):
        autopilot_named("inav")
