"""What a check finds in plans, ours and anybody's."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mission_strategies import AUTOPILOT_NAMES, KINDS, QUAD, example_plan
from sparsor.geodesy.lengths import offset_deg
from sparsor.mission import Circle, Fence, MissionItem, MissionPlan, RallyPoint, check_faults, judged_faults
from sparsor.vehicle import SteadyWind, load_vehicle

HOME = (51.505, 25.265)


def failing(plan: MissionPlan) -> str:
    return " ".join(fault.sentence for fault in judged_faults(plan) if fault.fails)


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
@pytest.mark.parametrize("kind", KINDS)
def test_our_own_plans_pass(kind: str, autopilot: str) -> None:
    vehicle = load_vehicle(kind)
    plan = example_plan(autopilot, vehicle=vehicle, hold_s=0 if vehicle.circles else 4, span_deg=0.01)
    assert [fault.sentence for fault in check_faults(plan, vehicle)] == []


@settings(max_examples=60, deadline=None)
@given(st.floats(0, 360), st.floats(1, 300))
def test_a_leg_through_a_circle_is_found_whatever_its_ends(angle: float, off_m: float) -> None:
    """A circle of 200 m beside the middle of a leg: crossed exactly where it is nearer than that."""
    plan = example_plan(stops=2)
    first, second = plan.stops
    middle = ((first.lon_deg + second.lon_deg) / 2, (first.lat_deg + second.lat_deg) / 2)
    east, north = (second.lon_deg - first.lon_deg) * 0.9, second.lat_deg - first.lat_deg
    length = (east**2 + north**2) ** 0.5
    side = 1 if angle < 180 else -1
    lon, lat = offset_deg(*middle, side * off_m * north / length, -side * off_m * east / length)
    circle = Circle(float(lon), float(lat), 200.0, inclusion=False)
    said = failing(replace(plan, circles=(circle,)))
    if abs(off_m - 200) > 5:
        assert ("The leg from item 3 to item 4 crosses fence circle 1." in said) == (off_m < 200)


def test_an_exclusion_between_two_stops_is_found() -> None:
    plan = example_plan(stops=2)
    first, second = plan.stops
    lon, lat = (first.lon_deg + second.lon_deg) / 2, (first.lat_deg + second.lat_deg) / 2
    box = Fence(
        tuple(lon + east for east in (-1e-3, 1e-3, 1e-3, -1e-3)),
        tuple(lat + north for north in (-1e-3, -1e-3, 1e-3, 1e-3)),
        inclusion=False,
    )
    assert "The leg from item 3 to item 4 crosses fence polygon 2." in failing(
        replace(plan, fences=(*plan.fences, box))
    )


def test_an_inclusion_with_a_bay_is_left_by_the_leg_across_it() -> None:
    plan = example_plan(stops=2)
    (first, second), home = plan.stops, plan.home
    west, east = sorted((first.lon_deg, second.lon_deg))
    south, north = min(first.lat_deg, home.lat_deg) - 0.1, max(first.lat_deg, second.lat_deg) + 0.1
    middle = (west + east) / 2
    bay = Fence(
        (west - 0.1, east + 0.1, east + 0.1, middle + 1e-4, middle, middle - 1e-4, west - 0.1),
        (south, south, north, north, min(first.lat_deg, second.lat_deg) - 0.001, north, north),
    )
    assert "leaves fence polygon 1" in failing(replace(plan, fences=(bay,)))


def test_rally_points_and_order() -> None:
    plan = example_plan()
    away = replace(plan, rally_points=(RallyPoint(52.5, 25.3, 50.0),))
    assert "Rally point 1 lies outside fence polygon 1." in failing(away)
    assert "not a take-off" in failing(replace(plan, items=plan.items[1:]))
    assert "neither lands nor returns" in failing(replace(plan, items=plan.items[:-1]))
    late = (*plan.items[1:4], plan.items[0], *plan.items[4:])
    assert "A take-off comes after other items" in failing(replace(plan, items=late))
    assert "takes off or lands, which a rover" in failing(replace(plan, vehicle_type=10))
    home = MissionItem(20, 2, (0.0,) * 7)
    said = [fault.sentence for fault in judged_faults(replace(plan, items=(*plan.items[:-2], home)))]
    assert any("straight line home" in sentence for sentence in said)


def test_endurance_is_a_fault_but_of_a_study_a_warning() -> None:
    tired = QUAD.model_copy(update={"endurance_s": 60.0})
    plan = example_plan()
    for study in (False, True):
        (found,) = check_faults(plan, tired, study=study)
        assert "which has 1 min less its reserve" in found.sentence
        assert found.fails != study


def test_the_vehicles_own_limits() -> None:
    plan = example_plan()
    small = QUAD.model_copy(update={"max_items": 5, "ceiling_m": 40.0})
    found = {fault.sentence: fault.fails for fault in check_faults(plan, small)}
    assert found["14 mission items are more than the 5 that the profile of the quad has."]
    assert not found["The flight goes up to 60 m above home, beyond the ceiling of 40 m in the vehicle profile."]
    plane = load_vehicle("plane")
    assert any("another kind of vehicle" in fault.sentence and fault.fails for fault in check_faults(plan, plane))
    windy = check_faults(plan, QUAD, SteadyWind(12, 0))
    assert any("cannot be flown against" in fault.sentence and fault.fails for fault in windy)


def test_a_plane_is_told_what_it_does_not_do() -> None:
    plane = load_vehicle("plane")
    plan = example_plan(vehicle=plane, hold_s=0)
    held = tuple(replace(item, params=(5.0, *item.params[1:])) if item.command == 16 else item for item in plan.items)
    said = " ".join(fault.sentence for fault in judged_faults(replace(plan, items=held)))
    assert "Waypoints hold, which a plane does not" in said
    bare = tuple(item for item in plan.items if item.command != 189)
    said = " ".join(fault.sentence for fault in judged_faults(replace(plan, items=bare)))
    assert "The landing has no DO_LAND_START before it" in said
