"""Plans of every kind lead past what is kept out of, from the ground and back."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mission_strategies import AUTOPILOT_NAMES, KINDS
from practice_rig import Rig, mission_messages
from sparsor.errors import MissionError
from sparsor.geodesy.keepouts import KeepOut
from sparsor.geodesy.lengths import distance_m, wgs84
from sparsor.geodesy.plane import LocalPlane
from sparsor.geodesy.zones import Zones, zones_of
from sparsor.mission import Home, build_mission, export_bytes, judged_faults, parse_plan, plan_bytes, transits
from sparsor.vehicle import SteadyWind, Vehicle, load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable

    from sparsor.mission import MissionPlan

PLANE = LocalPlane(51.5, 25.3)
MARGIN_M = 30.0


def circle(east_m: float, north_m: float, radius_m: float) -> KeepOut:
    lon, lat = PLANE.degrees([east_m, north_m])
    return KeepOut("mast", (float(lon),), (float(lat),), radius_m)


def square(east_m: float, north_m: float, half_m: float) -> KeepOut:
    corners = [[east_m + x * half_m, north_m + y * half_m] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    lon, lat = PLANE.degrees(corners).T
    return KeepOut("stadium", tuple(lon.tolist()), tuple(lat.tolist()))


def zones(*found: KeepOut, margin_m: float = MARGIN_M) -> Zones:
    return zones_of(found, margin_m=margin_m, plane=PLANE, most_points=40, longest_leg_m=5000.0)


def plan_past(kind: str, autopilot: str, kept: Zones, home: Any, stops: Any, wind: SteadyWind) -> MissionPlan:
    vehicle = load_vehicle(kind)
    lon, lat = PLANE.degrees(stops).T
    home_lon, home_lat = PLANE.degrees(home)
    return build_mission(
        lon, lat, home=Home(float(home_lon), float(home_lat)), vehicle=vehicle, autopilot=autopilot,
        altitude_m=50 if vehicle.flies else 0, wind=wind, zones=kept,
    )  # fmt: skip


def margin_of(vehicle: Vehicle) -> float:
    return MARGIN_M + (2 * vehicle.turn_radius_m if vehicle.circles else 0.0)


COORDINATES = st.floats(-2000, 2000)


@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.tuples(COORDINATES, COORDINATES, st.floats(20, 400)), min_size=1, max_size=4),
    st.tuples(COORDINATES, COORDINATES),
    st.tuples(COORDINATES, COORDINATES),
    st.sampled_from(KINDS),
    st.sampled_from(AUTOPILOT_NAMES),
    st.builds(SteadyWind, st.sampled_from([0.0, 4.0]), st.floats(0, 360)),
)
def test_no_leg_comes_within_the_margin(
    masts: list[tuple[float, float, float]], home: Any, stop: Any, kind: str, autopilot: str, wind: SteadyWind
) -> None:
    margin_m = margin_of(load_vehicle(kind))
    kept = zones(*(circle(*mast) for mast in masts), margin_m=margin_m)
    assume(not kept.holds(*PLANE.degrees([home, stop]).T).any())
    try:
        plan = plan_past(kind, autopilot, kept, home, [stop], wind)
    except MissionError as error:
        assert "no direction is free" in str(error) or "there is no way" in str(error)
        return
    flown = [(plan.home.lon_deg, plan.home.lat_deg)]
    flown += [(item.lon_deg, item.lat_deg) for item in plan.items if item.has_position]
    for start, end in pairwise(flown):
        line = np.array([start, *wgs84().npts(*start, *end, 80), end])
        for one in plan.circles:
            assert distance_m(*line.T, one.lon_deg, one.lat_deg).min() >= one.radius_m + margin_m - 0.1
    assert len(plan.stops) == 1
    assert [fault.sentence for fault in judged_faults(plan) if fault.fails] == []
    out, back = transits(plan)
    assert len(out) + len(back) - 4 == len(plan.passing)


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_plan_past_a_keep_out_is_imported_uploaded_and_flown(
    kind: str, autopilot: str, importers: dict[str, Callable[[str], Any]]
) -> None:
    vehicle = load_vehicle(kind)
    kept = zones(square(0, 0, 80), circle(900, 900, 50), margin_m=margin_of(vehicle))
    plan = plan_past(kind, autopilot, kept, (-450, 20), [(450, 0)], SteadyWind())
    assert plan.passing
    document = importers[autopilot](plan_bytes(plan).decode())
    assert len(document.geofence_items) == sum(len(fence.lon_deg) for fence in plan.fences) + 1
    assert {item.command for item in document.geofence_items} == {5001, 5002, 5004}
    again = parse_plan(plan_bytes(plan), "it")
    assert again == plan
    assert len(again.stops) == len(plan.stops) + len(plan.passing)
    rig = Rig.of(autopilot, plan=plan, vehicle=vehicle)
    assert rig.upload(mission_messages(plan, autopilot)) == 0
    rig.run(10)
    rig.take_off()
    assert rig.run(3000, until=lambda: not rig.flight.armed)
    assert rig.flight.landed
    track = np.array(rig.track)[:, 1:3] + np.array([-450, 20])
    assert np.abs(track).max(axis=1).min() > 80  # never over the square


def test_other_files_hold_the_keep_outs() -> None:
    kept = zones(square(0, 0, 80), circle(900, 900, 50))
    plan = plan_past("quad", "px4", kept, (-450, 20), [(450, 0)], SteadyWind())
    assert export_bytes(plan, "it", "geojson").count(b'"radius_m": 50.05') == 1
    assert export_bytes(plan, "it", "kml").count(b"<name>Keep out</name>") == 2


def test_a_home_inside_has_no_way() -> None:
    kept = zones(square(0, 0, 80))
    with pytest.raises(MissionError, match="there is no way between home"):
        plan_past("quad", "px4", kept, (0, 0), [(450, 0)], SteadyWind())


def test_what_is_passed_is_no_part_of_a_plans_equality() -> None:
    kept = zones(square(0, 0, 80))
    plan = plan_past("quad", "px4", kept, (-450, 20), [(450, 0)], SteadyWind())
    assert replace(plan, passing=()) == plan
