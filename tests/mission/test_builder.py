"""A route becomes the items that the autopilots fly, with its fence, rally point, time and warnings."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mission_strategies import AUTOPILOT_NAMES, QUAD, Route, plans, routes
from sparsor.errors import MissionError, VehicleError
from sparsor.geodesy.lengths import path_length_m
from sparsor.mission import Home, MissionItem, MissionPlan, build_mission, flight_time_s, plan_faults
from sparsor.mission.builder import max_stops
from sparsor.vehicle import AUTOPILOTS, flight_seconds

LON, LAT = [51.50, 51.51, 51.52], [25.27, 25.28, 25.27]
HOME = Home(51.505, 25.265, 12.0, altitude_known=True)


def built(**changes: object) -> MissionPlan:
    arguments: dict[str, object] = {
        "vehicle": QUAD,
        "autopilot": "ardupilot",
        "altitude_m": 50.0,
        "home": HOME,
    }
    return build_mission(LON, LAT, **(arguments | changes))  # type: ignore[arg-type]


@settings(max_examples=60, deadline=None)
@given(plans())
def test_order_and_positions(plan: MissionPlan) -> None:
    commands = [item.command for item in plan.items]
    assert commands[:2] == [22, 178]
    assert commands[-2:] == [16, 21]
    assert set(commands[2:-2]) == {16}
    home = (plan.home.lat_deg, plan.home.lon_deg)
    for item in (plan.items[0], plan.items[-2], plan.items[-1]):
        assert item.params[4:6] == home
    heights = {item.altitude_m for item in plan.items if item.command in (16, 22)}
    assert len(heights) == 1
    assert plan.stops == plan.items[2:-2]
    assert plan.rally_points[0].altitude_m in heights
    assert all(item.autocontinue for item in plan.items)


@settings(max_examples=60, deadline=None)
@given(plans())
def test_values_that_are_not_given_stand_only_where_px4_reads_a_heading(plan: MissionPlan) -> None:
    for item in plan.items:
        missing = {place for place, value in enumerate(item.params, start=1) if math.isnan(value)}
        heading = plan.autopilot_title == "PX4" and item.command != 178
        assert missing == ({4} if heading else set())


@settings(max_examples=40, deadline=None)
@given(plans(largest_m=5e3))
def test_nothing_is_found_wrong_with_what_we_build(plan: MissionPlan) -> None:
    # Two findings are right: generated flights may be high, and may be at the place where 0/0 is a place.
    faults = [fault for fault in plan_faults(plan) if not re.search("common ceiling|lies at 0/0", fault)]
    assert faults == []


def test_the_first_stop_is_flown_though_it_is_home() -> None:
    plan = built(home=None, hold_s=5)
    assert (plan.home.lon_deg, plan.home.lat_deg) == (LON[0], LAT[0])
    assert len(plan.stops) == 3
    assert plan.stops[0].params[4:6] == (LAT[0], LON[0])
    assert plan.stops[0].hold_s == 5


def test_one_stop_at_home_is_still_a_stop() -> None:
    plan = build_mission([51.5], [25.27], vehicle=QUAD, autopilot="px4", altitude_m=30, hold_s=60)
    assert len(plan.stops) == 1
    assert flight_time_s(plan, QUAD) > 60 + 30 / 2.5


@given(st.floats(0.0, 600.0))
def test_ardupilot_holds_whole_seconds_and_never_shorter(hold_s: float) -> None:
    written = built(hold_s=hold_s).stops[0].params[0]
    assert written == int(written)
    assert hold_s - 1e-6 <= written < hold_s + 1
    assert built(hold_s=hold_s, autopilot="px4").stops[0].params[0] == hold_s


def test_rounding_a_hold_is_said() -> None:
    assert any("2.5 s at each stop is written as 3 s" in warning for warning in built(hold_s=2.5).warnings)
    assert not any("whole seconds" in warning for warning in built(hold_s=3).warnings)
    assert not any("whole seconds" in warning for warning in built(hold_s=2.5, autopilot="px4").warnings)


@settings(max_examples=40, deadline=None)
@given(routes(largest_m=2e4), st.sampled_from(AUTOPILOT_NAMES), st.floats(0, 60), st.floats(1, 15))
def test_time_is_the_vehicles(route: Route, autopilot: str, hold_s: float, speed_m_s: float) -> None:
    plan = build_mission(
        route.lon_deg,
        route.lat_deg,
        home=route.home,
        vehicle=QUAD,
        autopilot=autopilot,
        altitude_m=40,
        speed_m_s=speed_m_s,
        hold_s=hold_s,
    )
    home = plan.home
    path_m = path_length_m(route.lon_deg, route.lat_deg)
    whole_m = path_length_m([home.lon_deg, *route.lon_deg, home.lon_deg], [home.lat_deg, *route.lat_deg, home.lat_deg])
    expected = flight_seconds(
        QUAD,
        path_length_m=path_m,
        transit_m=whole_m - path_m,
        stops=len(route.lon_deg),
        hold_s=AUTOPILOTS[autopilot].written_hold_s(hold_s),
        altitude_m=40,
        speed_m_s=speed_m_s,
    )
    # Positions are rounded to a centimetre.
    assert flight_time_s(plan, QUAD) == pytest.approx(expected, abs=0.05 * len(plan.items))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"altitude_m": -10.0}, "altitude of -10 m above home; it has to be above 0"),
        ({"altitude_m": 0.0}, "altitude of 0 m"),
        ({"altitude_m": math.nan}, "altitude of nan"),
        ({"speed_m_s": 0.0}, "speed of 0 m/s"),
        ({"speed_m_s": math.inf}, "speed of inf"),
        ({"hold_s": -1.0}, "hold of -1 s; allowed are 0..65535"),
        ({"hold_s": 70_000.0}, "hold of 70000 s"),
        ({"fence_margin_m": 0.0}, "fence margin"),
    ],
)
def test_values_out_of_range_are_named(changes: dict[str, object], sentence: str) -> None:
    with pytest.raises(MissionError, match=sentence):
        built(**changes)


@pytest.mark.parametrize(
    ("lon", "lat", "sentence"),
    [
        ([], [], "one or more"),
        ([51.5, 51.6], [25.3], "as many longitudes as latitudes"),
        ([51.5, 190.0], [25.3, 25.3], "stop 2 lies at longitude 190"),
        ([51.5], [math.nan], "stop 1 .* latitude nan"),
    ],
)
def test_stops_that_are_none_are_refused(lon: list[float], lat: list[float], sentence: str) -> None:
    with pytest.raises(MissionError, match=sentence):
        build_mission(lon, lat, vehicle=QUAD, autopilot="px4", altitude_m=50)


def test_an_unknown_autopilot_is_named() -> None:
    with pytest.raises(VehicleError, match="unknown autopilot 'betaflight'; known are ardupilot, px4"):
        built(autopilot="betaflight")


@pytest.mark.parametrize(("autopilot", "limit", "most"), [("ardupilot", 650, 645), ("px4", 500, 496)])
def test_the_limit_of_items_is_named(autopilot: str, limit: int, most: int) -> None:
    assert max_stops(AUTOPILOTS[autopilot]) == most
    lon = 51.5 + 0.03 * np.random.default_rng(1).random(most + 1)
    lat = np.full(most + 1, 25.27)
    plan = build_mission(lon[:most], lat[:most], vehicle=QUAD, autopilot=autopilot, altitude_m=50)
    stored = len(plan.items) + (autopilot == "ardupilot")
    assert stored == limit
    with pytest.raises(MissionError, match=f"{most + 1} stops are too many.*stores {limit} items.*{most} stops"):
        build_mission(lon, lat, vehicle=QUAD, autopilot=autopilot, altitude_m=50)


def test_warnings_are_sentences_about_this_flight() -> None:
    assert built().warnings == ()
    said = " ".join(built(home=None, altitude_m=150.0, speed_m_s=15.0).warnings)
    assert "altitude of home above sea level is not known" in said
    assert "beyond the ceiling of 120 m" in said
    assert "above the vehicle's cruise speed of 10 m/s" in said
    far = Home(51.6, 25.27, 1.0, altitude_known=True)
    said = " ".join(built(autopilot="px4", altitude_m=8.0, home=far).warnings)
    assert "refuse a take-off to 8 m" in said
    assert "MIS_DIST_1WP" in said
    across = build_mission([179.99, -179.99], [1.0, 1.0], vehicle=QUAD, autopilot="px4", altitude_m=50)
    assert any("antimeridian" in warning for warning in across.warnings)


@pytest.mark.parametrize(
    ("params", "sentence"),
    [
        ((0, 0, 0, 0, 25.3, 51.5), "has 6 parameters; an item has 7"),
        ((0, 0, 0, 0, math.nan, 51.5, 50), "no position"),
        ((0, 0, 0, 0, 25.3, 51.5, math.nan), "no altitude"),
        ((0, 0, 0, 0, 51.5, 251.5, 50), "allowed are -90..90 and -180..180"),
        ((math.inf, 0, 0, 0, 25.3, 51.5, 50), "infinite"),
    ],
)
def test_an_item_is_checked_once_and_for_all(params: tuple[float, ...], sentence: str) -> None:
    with pytest.raises(MissionError, match=sentence):
        MissionItem(16, 3, params)
