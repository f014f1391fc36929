"""What a flight covered of a route: its legs alone, each part once, up to where it was cut."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldmap.flights import GRID, SIDE_M, samples_at
from sparsor.geodesy.lengths import path_length_m
from sparsor.journeys.covered import air_seconds, covered

COLUMNS = GRID.shape[1]
CELL_M = SIDE_M / COLUMNS
ROUTE = np.array([(2, 2), (2, 29), (12, 29), (20, 6), (29, 25)]) @ np.array([COLUMNS, 1])
HOME = (0.5, 0.02)
TOTAL_M = float(path_length_m(*GRID.centres_deg(ROUTE)))


def shares(cells):
    row, column = np.divmod(np.asarray(cells), COLUMNS)
    return np.column_stack(((column + 0.5) / COLUMNS, 1 - (row + 0.5) / COLUMNS))


def flown(corners, step_m=8.0, noise_m=0.0, **more):
    """Samples along the way over corners, as shares of the box."""
    way = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T)))) * SIDE_M
    at = np.arange(0, way[-1], step_m)
    noise = noise_m / SIDE_M * np.random.default_rng(1).standard_normal((2, at.size))
    east, north = (np.interp(at, way, corners[:, k]) + noise[k] for k in (0, 1))
    return samples_at(east, north, np.zeros(at.size), **more)


def found(samples):
    return covered(GRID, ROUTE, samples, np.ones(samples.value.size, dtype=bool))


def cut(corners, share):
    """The way over corners up to a share of its length."""
    way = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))))
    end = share * way[-1]
    inside = corners[way < end]
    return np.vstack((inside, [np.interp(end, way, corners[:, k]) for k in (0, 1)]))


@settings(max_examples=40, deadline=None)
@given(share=st.floats(0.02, 1.0), noise_m=st.floats(0, 4), step_m=st.floats(1, 30))
def test_the_way_up_to_where_it_was_cut_counts_and_the_rest_is_left(share, noise_m, step_m):
    made = found(flown(cut(shares(ROUTE), share), step_m, noise_m))
    assert made.total_m == pytest.approx(TOTAL_M)
    assert made.length_m == pytest.approx(share * TOTAL_M, abs=1.6 * CELL_M)
    left_m = float(path_length_m(*GRID.centres_deg(made.left))) if made.left.size > 1 else 0.0
    assert left_m == pytest.approx((1 - share) * TOTAL_M, abs=2.5 * CELL_M)
    if made.left.size > 1:
        assert made.left[-1] == ROUTE[-1]


def test_the_ways_from_and_to_home_and_what_is_flown_twice_do_not_count():
    part = cut(shares(ROUTE), 0.4)
    home = np.array([HOME])
    once = found(flown(part)).length_m
    assert found(flown(np.vstack((home, part, home)))).length_m == pytest.approx(once, abs=CELL_M)
    assert found(flown(np.vstack((part, part[::-1])))).length_m == pytest.approx(once, abs=CELL_M)


def test_a_flight_elsewhere_covers_nothing():
    made = found(flown(np.array([[0.1, 0.55], [0.6, 0.62]])))
    assert made.length_m == 0
    assert made.left.tolist() == ROUTE.tolist()


def test_no_sample_and_one_stop_are_no_trouble():
    nothing = samples_at([], [], [])
    assert found(nothing).length_m == 0
    none = np.zeros(flown(shares(ROUTE)).value.size, dtype=bool)
    assert covered(GRID, ROUTE, flown(shares(ROUTE)), none).left.tolist() == ROUTE.tolist()
    assert covered(GRID, ROUTE[:1], nothing, np.zeros(0, dtype=bool)).left.size == 0


def test_the_time_in_the_air_is_that_above_the_ground_boot_by_boot():
    height_m = np.concatenate((np.zeros(10), np.full(61, 50.0), np.zeros(20)))
    boots = np.repeat([0, 1], [40, 51])
    time_s = np.concatenate((np.arange(40.0), 5.0 + np.arange(51.0)))
    path = np.linspace(0.1, 0.9, 91)
    air = samples_at(path, path, path, time_s=time_s, height_m=height_m, boot=boots)
    assert air_seconds(air) == pytest.approx(29 + 30)
    ground = samples_at(path, path, path, time_s=time_s, height_m=0.0, boot=boots)
    assert air_seconds(ground) == pytest.approx(39 + 50)
