from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sparsor.design import unit_legs

ROWS, COLUMNS = 9, 14
LEGS = unit_legs((ROWS, COLUMNS))
cell = st.integers(0, ROWS * COLUMNS - 1)


@given(cell, cell)
def test_the_seconds_in_the_cells_sum_to_those_of_the_leg(start, end):
    crossed, seconds = LEGS.crossed(start, end)
    assert crossed[0] == start
    assert crossed[-1] == end
    assert len(set(crossed.tolist())) == crossed.size
    np.testing.assert_allclose(seconds.sum(), LEGS.seconds[start, end], atol=1e-9)
    assert start == end or (seconds > 0).all()


@given(cell, cell)
def test_the_way_back_crosses_the_same_cells(start, end):
    there, back = LEGS.crossed(start, end), LEGS.crossed(end, start)
    np.testing.assert_array_equal(there[0], back[0][::-1])
    np.testing.assert_allclose(there[1], back[1][::-1], atol=1e-9)


@given(cell, cell)
def test_crossed_cells_agree_with_walking_the_line(start, end):
    row, column = np.divmod([start, end], COLUMNS)
    along = (np.arange(20_000) + 0.5) / 20_000
    walked = np.floor(row[0] + along * (row[1] - row[0]) + 0.5) * COLUMNS + np.floor(
        column[0] + along * (column[1] - column[0]) + 0.5
    )
    crossed, seconds = LEGS.crossed(start, end)
    counts = {int(value): int(count) for value, count in zip(*np.unique(walked, return_counts=True), strict=True)}
    for value, spent in zip(crossed, seconds, strict=True):
        expected = counts.get(int(value), 0) / 20_000 * LEGS.seconds[start, end]
        assert abs(expected - spent) < 0.01


def test_cells_under_a_path_hold_its_stops():
    under = LEGS.cells_under(np.array([0, 5, 40]))
    assert {0, 1, 2, 3, 4, 5, 40} <= set(under.tolist())


def test_legs_kept_inside_cross_allowed_cells_only():
    rng = np.random.default_rng(3)
    legs = replace(LEGS, allowed=rng.random(LEGS.size) < 0.9)
    inside = legs.kept_inside()
    for start, end in rng.integers(0, LEGS.size, (400, 2)):
        clear = legs.allowed[legs.crossed(start, end)[0]].all()
        assert inside.leaves(np.array([start, end])) == (not clear)
        if clear:
            assert inside.length[start, end] == LEGS.length[start, end]
