"""Flights over hills: no leg of any kind of vehicle is nearer to the ground than was asked for."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mission_strategies import AUTOPILOT_NAMES
from practice_rig import Rig, mission_messages
from sparsor.errors import MissionError, TerrainError
from sparsor.geodesy.lengths import distance_m, wgs84
from sparsor.mission import Home, MissionPlan, build_mission, judged_faults, parse_plan, plan_bytes, time_plan
from sparsor.mission.clearance import terrain_faults
from sparsor.mission.following import Ground, few_joins, usual_tolerance_m
from sparsor.mission.items import NAV_LAND, NAV_TAKEOFF, WAYPOINTS
from sparsor.vehicle import SteadyWind, Vehicle, load_vehicle
from terrains import Hills, hills, terrain_of, write_dem

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from sparsor.geodesy.terrain import Terrain

FLYING = ("quad", "plane", "vtol")
SEEDS = range(6)
PLACE = st.tuples(st.floats(51.503, 51.532), st.floats(25.272, 25.3))
STEP_M = 4.0
# Here a check that looked as far round its points as the plan round its own, which lie elsewhere, found a fault.
SAMPLED_ELSEWHERE = [(51.505742806493274, 25.278444438131203), (51.52836850874282, 25.28078319462225)]


@pytest.fixture(scope="module")
def grounds(tmp_path_factory: pytest.TempPathFactory) -> dict[int, tuple[Hills, Terrain]]:
    folder = tmp_path_factory.mktemp("dem")
    found = {}
    for seed in SEEDS:
        ground = hills(seed, height_m=(15, 40, 60, 90, 120, 25)[seed], wide=(18, 30, 14, 40, 25, 6)[seed])
        found[seed] = (ground, terrain_of(write_dem(folder / f"{seed}.tif", ground)))
    return found


def over(
    ground: Ground, stops: Any, *, kind: str = "quad", autopilot: str = "ardupilot", wind: Any = None, home: Any = None
) -> MissionPlan:
    lon, lat = np.transpose(stops)
    return build_mission(
        lon, lat, home=None if home is None else Home(*home), vehicle=load_vehicle(kind), autopilot=autopilot,
        altitude_m=0.0, wind=wind or SteadyWind(), ground=ground,
    )  # fmt: skip


def flown_lines(plan: MissionPlan, vehicle: Vehicle) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Points on the legs between take-off and landing: longitude, latitude, height above home."""
    items = [item for item in plan.items if item.command in WAYPOINTS or item.command == NAV_TAKEOFF]
    if vehicle.kind == "vtol":
        items.insert(0, replace(items[0], params=plan.items[0].params))
    for start, end in pairwise(items):
        ends = (start.lon_deg, start.lat_deg, end.lon_deg, end.lat_deg)
        steps = max(int(float(distance_m(*ends)) / STEP_M), 1)
        points = np.array([ends[:2], *wgs84().npts(*ends, steps), ends[2:]])
        share = np.linspace(0, 1, len(points))
        yield *points.T, start.altitude_m + share * (end.altitude_m - start.altitude_m)


@settings(max_examples=80, deadline=None)
@given(
    st.sampled_from(SEEDS),
    st.lists(PLACE, min_size=1, max_size=6),
    st.none() | PLACE,
    st.sampled_from(FLYING),
    st.sampled_from(AUTOPILOT_NAMES),
    st.floats(20.0, 90.0),
    st.floats(0.05, 0.9),
    st.builds(SteadyWind, st.sampled_from([0.0, 5.0]), st.floats(0, 360)),
)
@example(4, SAMPLED_ELSEWHERE, None, "quad", "ardupilot", 20.0, 0.05, SteadyWind(0.0, 0.0))
def test_no_leg_is_nearer_to_the_ground_than_allowed(
    grounds: dict[int, tuple[Hills, Terrain]],
    seed: int,
    stops: list[tuple[float, float]],
    home: Any,
    kind: str,
    autopilot: str,
    height_m: float,
    share: float,
    wind: SteadyWind,
) -> None:
    hilly, terrain = grounds[seed]
    vehicle, ground = load_vehicle(kind), Ground(terrain, height_m, share * height_m)
    try:
        plan = over(ground, stops, kind=kind, autopilot=autopilot, wind=wind, home=home)
    except (TerrainError, MissionError) as error:
        assert vehicle.circles, error
        assert "no direction is free" in str(error) or "would meet the ground" in str(error)
        return
    home_m = float(hilly.at(plan.home.lon_deg, plan.home.lat_deg))
    steepest = 0.0
    for lon, lat, up_m in flown_lines(plan, vehicle):
        above = up_m + home_m - hilly.at(lon, lat)
        assert above.min() >= ground.least_m - 0.02
        length_m = float(distance_m(lon[0], lat[0], lon[-1], lat[-1]))
        if length_m > 100:
            steepest = max(steepest, (up_m[-1] - up_m[0]) / length_m)
        if kind == "quad":
            assert above.max() <= height_m + 2 * ground.tolerance_m + 70 * steepness(hilly)
    if vehicle.circles:
        assert steepest <= vehicle.climb_m_s / (vehicle.cruise_m_s + wind.speed_m_s) + 0.002
    for stop, wanted in zip(plan.stops, stops, strict=True):
        assert (stop.lon_deg, stop.lat_deg) == pytest.approx(wanted, abs=6e-8)
        assert stop.altitude_m + home_m - float(hilly.at(stop.lon_deg, stop.lat_deg)) >= height_m - 0.01
    found = terrain_faults(
        plan, terrain, ground.least_m, home_m=home_m, ceiling_m=1e4,
        reach_m=2 * vehicle.turn_radius_m if vehicle.circles else 0.0,
    )  # fmt: skip
    assert [fault.sentence for fault in found] == []
    assert [fault.sentence for fault in judged_faults(plan, over_terrain=True) if fault.fails] == []


def steepness(hilly: Hills) -> float:
    """The steepest slope of a ground, metres a metre."""
    down, along = np.gradient(hilly.heights_m, 30.8, 27.9)
    return float(np.hypot(down, along).max())


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(-50, 50), min_size=2, max_size=12), st.integers(0, 20).map(lambda whole: whole + 0.137))
def test_each_point_kept_is_the_farthest_that_joins(goal: list[int], tolerance: float) -> None:
    along, height = np.arange(float(len(goal))), np.array(goal, dtype=np.float64)
    kept = few_joins(along, height, height - tolerance, height + tolerance)

    def fits(start: int, end: int) -> bool:
        line = np.interp(along[start : end + 1], along[[start, end]], height[[start, end]])
        return bool((np.abs(line - height[start : end + 1]) <= tolerance + 1e-9).all())

    for start, end in pairwise(kept):
        assert fits(start, end)
        assert not any(fits(start, later) for later in range(end + 1, len(goal)))


def test_a_flight_over_level_ground_is_the_one_without_terrain(tmp_path: Any) -> None:
    level = terrain_of(write_dem(tmp_path / "level.tif", Hills(np.full((330, 330), 7.0))))
    stops = [(51.51, 25.28), (51.53, 25.29), (51.52, 25.3)]
    for kind in FLYING:
        followed = over(Ground(level, 50.0, 5.0), stops, kind=kind)
        plain = build_mission(*np.transpose(stops), vehicle=load_vehicle(kind), autopilot="ardupilot", altitude_m=50)
        heights = [item.altitude_m for item in followed.stops]
        assert heights == pytest.approx([50.1] * 3)  # rounded up
        assert len(followed.items) == len(plain.items) + (kind != "quad")  # over the circle before it sinks
        assert followed.fences == plain.fences


def test_the_heights_hang_on_home(grounds: dict[int, tuple[Hills, Terrain]]) -> None:
    hilly, terrain = grounds[3]
    stops = [(51.51, 25.28), (51.53, 25.29)]
    plans = [over(Ground(terrain, 60.0, 6.0), stops, home=home) for home in ((51.505, 25.29), (51.525, 25.275))]
    amsl = [
        np.array([stop.altitude_m for stop in plan.stops]) + hilly.at(plan.home.lon_deg, plan.home.lat_deg)
        for plan in plans
    ]
    assert amsl[0] == pytest.approx(amsl[1], abs=0.11)
    assert abs(plans[0].stops[0].altitude_m - plans[1].stops[0].altitude_m) > 1


def test_a_cliff_is_too_steep_for_a_plane(tmp_path: Any) -> None:
    cliff = np.zeros((330, 330))
    cliff[:, 190:] = 260.0
    terrain = terrain_of(write_dem(tmp_path / "cliff.tif", Hills(cliff)))
    stops, home = [(51.515, 25.29), (51.53, 25.29)], (51.505, 25.29)
    with pytest.raises(
        TerrainError, match="the leg from stop 2 to the circle before the landing would meet the ground"
    ):
        over(Ground(terrain, 60.0, 6.0), stops, kind="plane", home=home)
    plan = over(Ground(terrain, 60.0, 6.0), stops, home=home)  # a multirotor slows down and climbs
    assert plan.stops[1].altitude_m == pytest.approx(320.1)
    assert plan.rally_points[0].altitude_m == pytest.approx(260 + 54)
    # 260 m at 2.5 m/s up, 1.5 m/s down
    flat = build_mission(
        *np.transpose(stops), home=Home(*home), vehicle=load_vehicle("quad"), autopilot="px4", altitude_m=60
    )
    longer_s = time_plan(plan, load_vehicle("quad")).seconds - time_plan(flat, load_vehicle("quad")).seconds
    assert longer_s > 260 / 2.5 + 260 / 1.5 - 60


def test_ground_that_is_not_known_is_an_error_that_names_the_leg(tmp_path: Any) -> None:
    gap = np.full((330, 330), 5.0)
    gap[:, 200] = np.nan
    terrain = terrain_of(write_dem(tmp_path / "gap.tif", Hills(gap), nodata=-9999.0))
    with pytest.raises(TerrainError, match="does not know the ground under the leg from stop 2 to stop 3"):
        over(Ground(terrain, 50.0, 5.0), [(51.505, 25.29), (51.515, 25.29), (51.535, 25.29)])
    with pytest.raises(TerrainError, match="does not know the ground at home"):
        over(Ground(terrain, 50.0, 5.0), [(51.505, 25.29)], home=(51.47 + 200.5 / 3600, 25.29))


def test_too_many_items_are_an_error_that_says_what_helps(tmp_path: Any) -> None:
    rough = Hills(np.random.default_rng(0).uniform(0, 60, (330, 330)))
    terrain = terrain_of(write_dem(tmp_path / "rough.tif", rough))
    stops = np.random.default_rng(1).uniform((51.505, 25.275), (51.53, 25.3), (40, 2))
    with pytest.raises(MissionError, match=r"over terrain.*too many.*a larger --terrain-tolerance"):
        over(Ground(terrain, 50.0, 2.0), stops)


@pytest.mark.parametrize("tolerance_m", [0.0, 50.0, -1.0, float("nan")])
def test_the_tolerance_is_below_the_height(grounds: dict[int, tuple[Hills, Terrain]], tolerance_m: float) -> None:
    with pytest.raises(TerrainError, match="has to be above 0 and below the height"):
        Ground(grounds[0][1], 50.0, tolerance_m)
    assert (usual_tolerance_m(50), usual_tolerance_m(12)) == (5.0, 2.0)


def test_what_drives_has_no_ground_to_follow(grounds: dict[int, tuple[Hills, Terrain]]) -> None:
    with pytest.raises(MissionError, match="a rover stays on the ground"):
        over(Ground(grounds[0][1], 50.0, 5.0), [(51.51, 25.28)], kind="rover")


def test_anybodys_plan_is_checked(grounds: dict[int, tuple[Hills, Terrain]]) -> None:
    hilly, terrain = grounds[4]
    flat = build_mission([51.505, 51.53], [25.275, 25.3], vehicle=load_vehicle("quad"), autopilot="px4", altitude_m=40)
    home_m = float(hilly.at(51.505, 25.275))
    along = np.linspace(0, 1, 2000)
    least = (home_m + 40 - hilly.at(51.505 + 0.025 * along, 25.275 + 0.025 * along)).min()
    assert least < 30

    def fails(clearance_m: float, plan: MissionPlan = flat) -> list[str]:
        found = terrain_faults(plan, terrain, clearance_m, home_m=home_m, ceiling_m=120)
        return [fault.sentence for fault in found if fault.fails]

    assert fails(least - 10) == []  # the highest pixel near is higher than the ground below
    assert len(fails(least + 0.2)) == 2  # there and back
    # The same heights above the sea instead of home.
    above_sea = tuple(
        replace(item, frame=0, params=(*item.params[:6], item.params[6] + home_m)) if item.frame == 3 else item
        for item in flat.items
    )
    assert fails(least - 10, replace(flat, items=above_sea)) == []
    assert len(fails(least + 0.2, replace(flat, items=above_sea))) == 2
    terrain_frame = tuple(replace(item, frame=10) if item.command in WAYPOINTS else item for item in flat.items)
    found = list(terrain_faults(replace(flat, items=terrain_frame), terrain, 45, home_m=home_m, ceiling_m=120))
    assert [fault.fails for fault in found] == [False]
    assert "frame 10" in found[0].sentence


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
@pytest.mark.parametrize("kind", FLYING)
def test_a_flight_over_hills_is_imported_uploaded_and_flown(
    kind: str,
    autopilot: str,
    importers: dict[str, Callable[[str], Any]],
    grounds: dict[int, tuple[Hills, Terrain]],
) -> None:
    hilly, terrain = grounds[1]
    ground, vehicle = Ground(terrain, 60.0, 6.0), load_vehicle(kind)
    stops, home = [(51.51, 25.282), (51.52, 25.286), (51.512, 25.29)], (51.507, 25.28)
    plan = over(ground, stops, kind=kind, autopilot=autopilot, home=home)
    assert plan.passing
    document = importers[autopilot](plan_bytes(plan).decode())
    altitudes = [item.z for item in document.mission_items if item.command in WAYPOINTS and item.frame == 3]
    assert altitudes == pytest.approx([item.altitude_m for item in plan.items if item.command in WAYPOINTS])
    assert parse_plan(plan_bytes(plan), "it") == plan
    rig = Rig.of(autopilot, plan=plan, vehicle=vehicle)
    assert rig.upload(mission_messages(plan, autopilot)) == 0
    rig.run(10)
    rig.take_off()
    assert rig.run(4000, until=lambda: not rig.flight.armed)
    assert rig.flight.landed
    track = np.array(rig.track)
    home_m = float(hilly.at(*home))
    lon, lat = placed(home, track[:, 1:3])
    above = track[:, 3] + home_m - hilly.at(lon, lat)
    for stop in plan.stops:
        away = distance_m(lon, lat, stop.lon_deg, stop.lat_deg)
        near = int(np.argmin(away))
        assert away[near] < vehicle.acceptance_radius_m + 1
        assert abs(track[near, 3] - stop.altitude_m) < 2 + vehicle.acceptance_radius_m * 0.3
    if kind == "quad":
        survey = slice(*np.flatnonzero(track[:, 3] > plan.items[0].altitude_m - 0.6)[[0, -1]])
        assert above[survey].min() > ground.least_m - 2.0
        assert above[survey].max() < ground.height_m + 2 * ground.tolerance_m


def placed(home: tuple[float, float], metres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    from sparsor.geodesy.plane import LocalPlane

    lon, lat = LocalPlane(*home).degrees(metres).T
    return lon, lat


def test_a_landing_of_a_plane_is_checked(tmp_path: Any) -> None:
    """A wall in the approach of a plan that was made without terrain."""
    wall = np.zeros((330, 330))
    plan = build_mission(
        [51.51, 51.53], [25.28, 25.3], home=Home(51.505, 25.28), vehicle=load_vehicle("plane"), autopilot="px4",
        altitude_m=60, wind=SteadyWind(3, 270),
    )  # fmt: skip
    assert plan.items[-1].command == NAV_LAND
    column = int((51.507 - 51.47) * 3600)
    wall[:, column : column + 2] = 25.0
    terrain = terrain_of(write_dem(tmp_path / "wall.tif", Hills(wall)))
    found = [fault.sentence for fault in terrain_faults(plan, terrain, 30, home_m=0.0, ceiling_m=120) if fault.fails]
    assert any("climbs out or comes in" in sentence for sentence in found)
