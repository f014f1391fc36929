"""Vehicles at once: no two are nearer, anywhere on their ways at any time, than what is stated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sparsor.geodesy.lengths import wgs84
from sparsor.mission import Home, build_mission
from sparsor.mission.apart import flights_apart
from sparsor.mission.items import LANDINGS, TAKE_OFFS, WAYPOINTS
from sparsor.mission.separation import nearest
from sparsor.vehicle import load_vehicle

QUAD, ROVER, PLANE, VTOL = map(load_vehicle, ("quad", "rover", "plane", "vtol"))
STEP_M = 4.0


def sampled(plan) -> np.ndarray:
    """Where a multirotor is on its way, (n, 3): on the Earth's surface about home's latitude, and its height.

    Independent of what is tested: geodesics, walked in steps, climbs and descents on the spot.
    """
    at, up = (plan.home.lon_deg, plan.home.lat_deg), 0.0
    places = [(*at, up)]

    def walk(to):
        nonlocal at
        _, _, length = wgs84().inv(*at, *to)
        between = wgs84().npts(*at, *to, int(length / STEP_M)) if length > STEP_M else []
        places.extend((lon, lat, up) for lon, lat in [*between, to])
        at = to

    def rise(to):
        nonlocal up
        places.extend((*at, float(height)) for height in np.arange(min(up, to), max(up, to), 1.0))
        up = to
        places.append((*at, up))

    for item in plan.items:
        if item.command in TAKE_OFFS:
            rise(item.altitude_m)
        elif item.command in WAYPOINTS:
            walk((item.lon_deg, item.lat_deg))
        elif item.command in LANDINGS:
            walk((item.lon_deg, item.lat_deg))
            rise(0.0)
    return np.array(places)


def around(rng, span_deg, lat, count) -> np.ndarray:
    return rng.uniform(-span_deg, span_deg, (count, 2)) + np.array([51.5, lat])


def least_sampled_m(one: np.ndarray, other: np.ndarray) -> float:
    from pyproj import Transformer

    to_earth = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    from scipy.spatial import cKDTree

    here, there = (np.column_stack(to_earth.transform(*places.T)) for places in (one, other))
    return float(cKDTree(here).query(there)[0].min())


def built(rng, home, altitude_m, vehicle=QUAD, span_deg=0.01, stops=5):
    lon = (home[0] + span_deg * rng.uniform(-1, 1, stops) + 180.0) % 360.0 - 180.0
    lat = home[1] + span_deg * rng.uniform(-1, 1, stops)
    return build_mission(
        lon, lat, vehicle=vehicle, autopilot="ardupilot", altitude_m=altitude_m, home=Home(*home)
    )  # fmt: skip


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    lat=st.floats(-70, 70),
    lon=st.sampled_from([51.5, 179.9999, -0.001]),
    span_deg=st.sampled_from([0.0005, 0.005, 0.05]),
    rise_m=st.sampled_from([0.0, 5.0, 40.0]),
)
def test_no_sample_of_two_ways_is_nearer_than_the_least_distance(seed, lat, lon, span_deg, rise_m):
    rng = np.random.default_rng(seed)
    first = built(rng, (lon, lat), 50.0, span_deg=span_deg)
    beside = ((lon + 0.0004 + 180) % 360 - 180, lat + 0.0003)
    second = built(rng, beside, 50.0 + rise_m, span_deg=span_deg)
    least = nearest([first, second], QUAD).distance_m
    found = least_sampled_m(sampled(first), sampled(second))
    assert found >= least - 1e-3
    assert least >= 0.98 * found - 2.0 * STEP_M  # and it is no empty promise


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    vehicles=st.integers(2, 5),
    lat=st.floats(-60, 60),
    separation_m=st.floats(2, 40),
    own=st.booleans(),
)
def test_planned_vehicles_are_never_nearer_than_stated(seed, vehicles, lat, separation_m, own):
    rng = np.random.default_rng(seed)
    stops = [around(rng, 0.01, lat, 4) for _ in range(vehicles)]
    homes = [Home(*around(rng, 0.012, lat, 1)[0]) for _ in range(vehicles if own else 1)]
    found = flights_apart(
        lambda number, home, altitude_m: build_mission(
            *stops[number].T, vehicle=QUAD, autopilot="px4", altitude_m=altitude_m, home=home
        ),
        [(tuple(one[0]), tuple(one[-1])) for one in stops],
        homes,
        vehicle=QUAD,
        lowest_m=30.0,
        separation_m=separation_m,
    )
    assume(found is not None)
    assert found.distance_m >= separation_m - 1e-6
    ways = [sampled(plan) for plan in found.plans]
    for place, one in enumerate(ways):
        for other in ways[:place]:
            assert least_sampled_m(one, other) >= separation_m - 2e-3
    assert len({(plan.home.lon_deg, plan.home.lat_deg) for plan in found.plans}) == vehicles
    assert sorted(found.heights_m) == pytest.approx([30.0 + separation_m * n for n in range(vehicles)])


@pytest.mark.parametrize("vehicle", [QUAD, PLANE, VTOL])
def test_each_kind_flies_at_once_from_homes_of_their_own(vehicle):
    rng = np.random.default_rng(3)
    stops = [around(rng, 0.008, 25.3, 5) + np.array([side, 0.0]) for side in (-0.02, 0.02)]
    found = flights_apart(
        lambda number, home, altitude_m: build_mission(
            *stops[number].T, vehicle=vehicle, autopilot="ardupilot", altitude_m=altitude_m, home=home
        ),
        [(tuple(one[0]), tuple(one[-1])) for one in stops],
        [Home(51.46, 25.3), Home(51.54, 25.3)],
        vehicle=vehicle,
        lowest_m=50.0,
        separation_m=10.0,
    )
    assert found is not None
    assert found.distance_m == nearest(found.plans, vehicle).distance_m
    assert found.distance_m >= 10.0


def test_a_plane_is_wider_than_its_legs():
    legs = {"vehicle": PLANE, "autopilot": "px4", "altitude_m": 50}
    one = build_mission([51.5, 51.51], [25.3] * 2, home=Home(51.49, 25.3), **legs)
    other = build_mission([51.5, 51.51], [25.33] * 2, home=Home(51.49, 25.33), **legs)
    room_m = 4 * PLANE.turn_radius_m  # two turn radii beside a leg, each
    assert nearest([one, other], PLANE).distance_m < wgs84().inv(51.5, 25.3, 51.5, 25.33)[2] - room_m


def test_a_climb_through_the_other_s_way_is_seen():
    low = build_mission(
        [51.501, 51.499], [25.3, 25.3], vehicle=QUAD, autopilot="px4", altitude_m=30.0, home=Home(51.502, 25.3)
    )
    above = build_mission([51.5], [25.31], vehicle=QUAD, autopilot="px4", altitude_m=60.0, home=Home(51.5, 25.3))
    assert nearest([low, above], QUAD).distance_m == pytest.approx(0.0, abs=0.01)
    under = replace(above, items=tuple(replace(i, params=(*i.params[:6], min(i.params[6], 20.0))) for i in above.items))
    assert nearest([low, under], QUAD).distance_m == pytest.approx(10.0)


def test_the_same_place_or_a_way_on_the_ground_is_refused():
    def build(_number, home, altitude_m, vehicle=QUAD):
        return build_mission([51.5], [25.31], vehicle=vehicle, autopilot="px4", altitude_m=altitude_m, home=home)

    ways = [((51.5, 25.31), (51.5, 25.31))] * 2
    same = [Home(51.5, 25.3), Home(51.5, 25.30001)]
    assert flights_apart(build, ways, same, vehicle=QUAD, lowest_m=30.0, separation_m=10.0) is None

    def driven(number, home, altitude_m):
        return build(number, home, altitude_m, ROVER)

    assert flights_apart(driven, ways, same[:1], vehicle=ROVER, lowest_m=0.0, separation_m=10.0) is None


def test_flights_of_different_rounds_stand_in_the_same_places_and_may_cross():
    rng = np.random.default_rng(5)
    stops = [around(rng, 0.01, 25.3, 4) for _ in range(5)]

    def build(number, home, altitude_m):
        return build_mission(*stops[number].T, vehicle=QUAD, autopilot="px4", altitude_m=altitude_m, home=home)

    rounds = (1, 1, 2, 2, 3)
    found = flights_apart(
        build, [(tuple(one[0]), tuple(one[-1])) for one in stops], [Home(51.5, 25.31)], vehicle=QUAD, lowest_m=30.0,
        separation_m=12.0, rounds=rounds,
    )  # fmt: skip
    assert found is not None
    # A vehicle keeps its place and its height.
    assert len({(plan.home, height_m) for plan, height_m in zip(found.plans, found.heights_m, strict=True)}) == 2
    assert [sorted(found.vehicles[k : k + 2]) for k in (0, 2, 4)] == [[0, 1], [0, 1], [0]]
    assert sorted(found.heights_m[:2]) == [30.0, 42.0]
    assert all(
        plan.stops[0].altitude_m == height_m for plan, height_m in zip(found.plans, found.heights_m, strict=True)
    )
    assert found.distance_m == nearest(found.plans, QUAD, rounds).distance_m
    assert min(nearest(found.plans[k : k + 2], QUAD).distance_m for k in (0, 2)) >= found.distance_m >= 12.0
    assert nearest(found.plans, QUAD).distance_m < 1.0  # all at once they would not be apart


def test_who_does_not_fly_in_a_round_stands_at_home():
    def driven(stops, home):
        return build_mission(
            *np.transpose(stops), vehicle=ROVER, autopilot="px4", altitude_m=0.0, home=Home(*home)
        )  # fmt: skip

    first = driven([(51.50, 25.301), (51.50, 25.302)], (51.50, 25.30))
    second = driven([(51.51, 25.301), (51.51, 25.302)], (51.51, 25.30))
    through = driven([(51.505, 25.30), (51.515, 25.30)], (51.50, 25.30))
    assert nearest([first, second], ROVER).distance_m > 500
    found = nearest([first, second, through], ROVER, (1, 1, 2))
    assert (found.first, found.second, found.parked) == (2, 1, True)
    assert found.distance_m < 1.0
    assert not nearest([first, second, through], ROVER, (1, 2, 3)).distance_m > 1.0
    # And no such rounds are planned.
    plans = [first, second, through]
    ways = [((51.50, 25.301), (51.50, 25.302)), ((51.51, 25.301), (51.51, 25.302)), ((51.505, 25.30), (51.515, 25.30))]
    homes = [plan.home for plan in plans]
    planned = {"vehicle": ROVER, "lowest_m": 0.0, "separation_m": 10.0}
    assert flights_apart(lambda k, *_: plans[k], ways[:2], homes[:2], **planned) is not None
    assert flights_apart(lambda k, *_: plans[k], ways, homes, rounds=(1, 1, 2), **planned) is None


def test_a_home_on_a_hill_counts_where_its_height_is_known():
    rng = np.random.default_rng(1)
    one, other = built(rng, (51.5, 25.3), 50.0), built(rng, (51.502, 25.3), 90.0)
    level = nearest([one, other], QUAD).distance_m

    def raised(plan, amsl_m):
        return replace(plan, home=replace(plan.home, alt_amsl_m=amsl_m, altitude_known=True))

    assert nearest([raised(one, 100.0), raised(other, 100.0)], QUAD).distance_m == level
    assert nearest([raised(one, 140.0), raised(other, 100.0)], QUAD).distance_m < 1.0 < level
