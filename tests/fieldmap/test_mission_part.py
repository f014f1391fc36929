"""Which samples belong to the mission."""

from __future__ import annotations

import numpy as np
import pytest

from fieldmap.flights import GRID, samples_at
from sparsor.errors import LogError
from sparsor.fieldmap.mission_part import OUTSIDE, missed_stops, mission_part

HEIGHTS = np.concatenate((np.zeros(50), np.linspace(0, 50, 20), np.full(200, 50.0), np.linspace(50, 0, 30)))


def test_take_off_and_landing_are_not_the_mission():
    part = mission_part(samples_at(0.5, 0.5, np.zeros(HEIGHTS.size), height_m=HEIGHTS), GRID, 50.0)
    assert np.array_equal(part.in_flight, np.abs(HEIGHTS - 50) <= 10)
    assert part.warnings == ()


@pytest.mark.parametrize("altitude_m", [None, 120.0])
def test_another_height_than_planned_still_makes_a_map(altitude_m):
    part = mission_part(samples_at(0.5, 0.5, np.zeros(HEIGHTS.size), height_m=HEIGHTS), GRID, altitude_m)
    assert np.array_equal(part.in_flight, HEIGHTS >= 25)
    assert len(part.warnings) == (altitude_m is not None)
    assert all("120 m" in warning and "about 50 m" in warning for warning in part.warnings)


def test_a_long_wait_on_the_ground_is_not_the_mission():
    heights = np.concatenate((np.zeros(5000), HEIGHTS))
    part = mission_part(samples_at(0.5, 0.5, np.zeros(heights.size), height_m=heights), GRID)
    assert part.in_flight.sum() == (heights >= 25).sum()


def test_a_boat_is_on_its_mission_all_the_time():
    heights = 0.3 * np.sin(np.arange(300.0))
    assert mission_part(samples_at(0.5, 0.5, np.zeros(300), height_m=heights), GRID).in_flight.all()


def test_unknown_heights_count():
    samples = samples_at(0.5, 0.5, np.zeros(10), height_m=np.nan)
    assert mission_part(samples, GRID, 50.0).in_flight.all()


def test_altitudes_stand_in_for_heights():
    samples = samples_at(0.5, 0.5, np.zeros(HEIGHTS.size), height_m=HEIGHTS)
    samples.height_m[:] = np.nan
    assert np.array_equal(mission_part(samples, GRID, 50.0).in_flight, np.abs(HEIGHTS - 50) <= 10)


@pytest.mark.parametrize("altitude_m", [None, 50.0])
def test_altitudes_of_a_log_that_begins_in_the_air_are_the_missions(altitude_m):
    heights = HEIGHTS[HEIGHTS > 48]
    samples = samples_at(0.5, 0.5, np.zeros(heights.size), height_m=heights)
    samples.height_m[:] = np.nan
    part = mission_part(samples, GRID, altitude_m)
    assert part.in_flight.all()
    assert part.warnings == ()


def test_outside_the_grid():
    part = mission_part(samples_at([-0.1, 0.5, 1.2], 0.5, np.zeros(3)), GRID)
    assert np.array_equal(part.cell == OUTSIDE, [True, False, True])


def test_a_log_from_elsewhere_is_refused_with_the_distance():
    with pytest.raises(LogError, match=r"none of the 3 samples .* \d+\.\d km from its middle"):
        mission_part(samples_at([5.0, 6.0, 7.0], 0.5, np.zeros(3)), GRID)
    with pytest.raises(LogError, match="no sample with a position"):
        mission_part(samples_at(np.zeros(0), np.zeros(0), np.zeros(0)), GRID)


def over_hills(above_m=0.0):
    """Take-off to 50 m, a way whose heights above home go from 50 m to -20 and to 190 m, and a landing at its end."""
    east = np.concatenate((np.full(30, 0.1), np.linspace(0.1, 0.9, 300), np.full(30, 0.9)))
    up = np.interp(east, [0.1, 0.4, 0.9], [50.0, -20.0, 190.0])
    up[:30] = np.linspace(0, 50, 30, endpoint=False)
    up[-30:] = np.linspace(188, 0, 30)
    up[30:-30] += above_m
    samples = samples_at(east, 0.5, np.zeros(east.size), height_m=up)
    lon, lat = (samples.lon_deg[[0, 142, -1]], samples.lat_deg[[0, 142, -1]])
    return samples, np.column_stack((lon, lat, np.interp(east[[0, 142, -1]], [0.1, 0.4, 0.9], [50.0, -20.0, 190.0])))


def test_parts_of_a_way_are_above_homes_of_their_own():
    samples, way = over_hills()
    raised = way + np.array([0.0, 0.0, 60.0])
    apart = np.full((1, 3), np.nan)
    alone = mission_part(samples, GRID, 50.0, way).in_flight
    assert np.array_equal(mission_part(samples, GRID, 50.0, np.concatenate((raised, apart, way))).in_flight, alone)
    # What lies elsewhere tells nothing of the heights here.
    elsewhere = raised + np.array([0.0, 1.0, 0.0])
    assert np.array_equal(mission_part(samples, GRID, 50.0, np.concatenate((elsewhere, apart, way))).in_flight, alone)


@pytest.mark.parametrize("altitude_m", [50.0, None])
@pytest.mark.parametrize("from_home", [True, False])
def test_a_way_over_hills_is_followed(altitude_m, from_home):
    samples, way = over_hills()
    if not from_home:
        samples.height_m[:] = np.nan
    part = mission_part(samples, GRID, altitude_m, way)
    assert part.warnings == ()
    assert part.in_flight[35:-35].all()
    assert part.in_flight[:23].sum() == part.in_flight[-27:].sum() == 0
    # At one height little of it would be taken.
    assert not mission_part(samples, GRID, 50.0).in_flight[30:-30].all()


def test_another_height_over_hills_still_makes_a_map():
    samples, way = over_hills(above_m=18.0)
    part = mission_part(samples, GRID, 50.0, way)
    assert part.in_flight[35:-35].all()
    assert "not within 10 m of the heights" in part.warnings[0]


def test_missed_stops_in_flight_order():
    assert missed_stops(np.array([9, 3, 7, 1]), np.array([1, 3])).tolist() == [9, 7]


def test_each_of_several_heights_is_the_mission_s():
    heights = np.repeat([0.0, 50.0, 90.0, 130.0], [5, 60, 50, 60])
    samples = samples_at(0.5, 0.5, np.zeros(heights.size), height_m=heights)
    part = mission_part(samples, GRID, 50.0, heights_m=(50.0, 130.0))
    assert np.array_equal(part.in_flight, np.isin(heights, [50.0, 130.0]))
    assert part.warnings == ()
