"""Each kind of vehicle gets a flight it can fly: where it circles, turns and comes down is inside its fence."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon

from mission_strategies import AUTOPILOT_NAMES, KINDS, QUAD, Route, example_plan, routes
from sparsor.errors import MissionError, VehicleError
from sparsor.geodesy.lengths import distance_m, wgs84
from sparsor.geodesy.plane import LocalPlane
from sparsor.mission import build_mission, parse_plan, plan_bytes, time_plan
from sparsor.mission.items import DO_LAND_START, NAV_LOITER_TO_ALT
from sparsor.mission.sequences import BESIDE_STOPS
from sparsor.vehicle import (
    AUTOPILOTS,
    SteadyWind,
    Vehicle,
    approach_m,
    flight_seconds,
    load_vehicle,
    usable_seconds,
)

if TYPE_CHECKING:
    from sparsor.mission import MissionPlan

WINDS = st.builds(SteadyWind, st.floats(0, 9), st.floats(0, 360))


def built(
    route: Route, kind: str, autopilot: str, wind: SteadyWind, hold_s: float = 0.0, altitude_m: float = 60.0
) -> MissionPlan:
    vehicle = load_vehicle(kind)
    return build_mission(
        route.lon_deg,
        route.lat_deg,
        home=route.home,
        vehicle=vehicle,
        autopilot=autopilot,
        altitude_m=altitude_m if vehicle.flies else 0.0,
        hold_s=hold_s,
        wind=wind,
    )


@settings(max_examples=40, deadline=None)
@given(routes(largest_m=2e4), st.sampled_from(KINDS), st.sampled_from(AUTOPILOT_NAMES), WINDS, st.sampled_from([0, 8]))
def test_every_stop_is_in_the_plan_and_the_file_gives_it_back(
    route: Route, kind: str, autopilot: str, wind: SteadyWind, hold_s: float
) -> None:
    plan = built(route, kind, autopilot, wind, hold_s)
    assert [(stop.lon_deg, stop.lat_deg) for stop in plan.stops] == [
        (round(lon, 7), round(lat, 7)) for lon, lat in zip(route.lon_deg, route.lat_deg, strict=True)
    ]
    assert all(stop.hold_s == hold_s for stop in plan.stops)
    assert len(plan.items) == len(plan.stops) + BESIDE_STOPS[kind]
    assert parse_plan(plan_bytes(plan), "it") == plan


@settings(max_examples=40, deadline=None)
@given(routes(largest_m=1e4), st.sampled_from(["plane", "vtol"]), WINDS)
def test_the_last_approach_is_long_enough_and_into_the_wind_and_inside_the_fence(
    route: Route, kind: str, wind: SteadyWind
) -> None:
    vehicle = load_vehicle(kind)
    plan = built(route, kind, "px4", wind)
    home, circle = plan.home, plan.items[-2]
    assert (circle.command, plan.items[-3].command) == (NAV_LOITER_TO_ALT, DO_LAND_START)
    away_m = float(distance_m(home.lon_deg, home.lat_deg, circle.lon_deg, circle.lat_deg))
    radius_m = vehicle.turn_radius_m
    assert math.isclose(math.sqrt(away_m**2 - radius_m**2), approach_m(vehicle, 60.0), rel_tol=1e-3)
    if wind.speed_m_s > 0:
        # Clockwise round the middle: the tangent home has the middle on its right.
        to_home_deg, _, _ = wgs84().inv(circle.lon_deg, circle.lat_deg, home.lon_deg, home.lat_deg)
        heading_deg = to_home_deg + math.degrees(math.asin(radius_m / away_m))
        off = (heading_deg - wind.from_deg + 180) % 360 - 180
        assert abs(off) < 0.1
    plane = LocalPlane(home.lon_deg, home.lat_deg)
    fence = Polygon(plane.metres(plan.fences[0].lon_deg, plan.fences[0].lat_deg))
    for item in plan.items:
        if item.has_position:
            room = Point(plane.metres(item.lon_deg, item.lat_deg)).buffer(radius_m)
            assert fence.contains(room)


@settings(max_examples=60, deadline=None)
@given(routes(largest_m=2e4), st.sampled_from(KINDS), st.floats(0, 30))
def test_what_a_budget_is_kept_by_is_never_less_than_the_plan_takes(route: Route, kind: str, hold_s: float) -> None:
    vehicle = load_vehicle(kind)
    plan = built(route, kind, "px4", SteadyWind(), hold_s)
    lon, lat = [plan.home.lon_deg, *route.lon_deg], [plan.home.lat_deg, *route.lat_deg]
    whole_m = float(distance_m(lon, lat, [*lon[1:], lon[0]], [*lat[1:], lat[0]]).sum())
    most_s = flight_seconds(
        vehicle,
        path_length_m=whole_m,
        transit_m=0.0,
        stops=len(route.lon_deg),
        hold_s=hold_s,
        altitude_m=60.0 if vehicle.flies else 0.0,
    )
    assert time_plan(plan, vehicle).seconds <= most_s + 0.05 * len(plan.items)


@settings(max_examples=40, deadline=None)
@given(routes(largest_m=2e4), st.sampled_from(["quad", "vtol"]), st.floats(0.5, 8), st.floats(0, 360))
def test_wind_never_shortens_a_flight_that_comes_home(
    route: Route, kind: str, speed_m_s: float, from_deg: float
) -> None:
    vehicle = load_vehicle(kind)
    assume(0.0 not in (*route.lon_deg, *route.lat_deg) and route.home is None)  # 0/0 means "here"
    plan = built(route, kind, "ardupilot", SteadyWind(), altitude_m=40.0)  # nothing is climbed or sunk along a leg
    calm, windy = time_plan(plan, vehicle), time_plan(plan, vehicle, SteadyWind(speed_m_s, from_deg))
    assert windy.seconds >= calm.seconds - 0.01


def test_energy_counts_each_phase_by_its_power() -> None:
    vtol = load_vehicle("vtol")
    plan = example_plan(vehicle=vtol, hold_s=0)
    time = time_plan(plan, vtol)
    even = vtol.model_copy(update={"hover_w": vtol.cruise_w, "climb_w": vtol.cruise_w, "descent_w": vtol.cruise_w})
    assert time_plan(plan, even).used_s == pytest.approx(time_plan(plan, even).seconds)
    assert time_plan(plan, even).seconds == pytest.approx(time.seconds)
    vertical_s = 60 / vtol.climb_m_s
    assert time.used_s > time.seconds + vertical_s * (vtol.load("climb") - 1)
    assert usable_seconds(vtol) == pytest.approx(0.8 * 600 * 3600 / 170)


def test_a_wind_that_cannot_be_flown_against_is_refused() -> None:
    with pytest.raises(VehicleError, match="a wind of 10 m/s cannot be flown against at an airspeed of 10 m/s"):
        example_plan(wind=SteadyWind(10, 90))
    assert example_plan(vehicle=load_vehicle("rover"), wind=SteadyWind(10, 90)).stops
    with pytest.raises(VehicleError, match="a wind of 61 m/s; allowed are 0"):
        SteadyWind(61)


def test_what_stays_down_has_no_altitude() -> None:
    boat = load_vehicle("boat")
    with pytest.raises(MissionError, match="an altitude of 30 m for a boat, which stays down; give 0"):
        build_mission([51.5], [25.3], vehicle=boat, autopilot="px4", altitude_m=30)


def test_a_small_board_takes_less() -> None:
    small = Vehicle.model_validate(QUAD.model_dump(exclude_none=True) | {"max_items": 50, "max_fence_points": 8})
    facts = AUTOPILOTS["ardupilot"].on_board(small)
    assert (facts.max_items, facts.max_fence_points, facts.max_rally_points) == (50, 8, 46)
    plan = example_plan(vehicle=small)
    assert len(plan.fences[0].lon_deg) <= 8
    with pytest.raises(MissionError, match=r"46 stops are too many.*stores 50 items.*45 stops"):
        example_plan(stops=46, vehicle=small)
