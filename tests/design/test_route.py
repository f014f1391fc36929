from __future__ import annotations

from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.design import shortest_path, unit_legs

LEGS = unit_legs((16, 16))
cells = st.lists(st.integers(0, 255), min_size=2, max_size=40, unique=True).map(np.array)


def length(path):
    return LEGS.path_length(path)


@settings(max_examples=80, deadline=None)
@given(cells)
def test_every_cell_is_visited_once_and_improving_never_lengthens(chosen):
    plain = shortest_path(chosen, LEGS.length, improve=False)
    better = shortest_path(chosen, LEGS.length)
    assert sorted(plain) == sorted(better) == sorted(chosen)
    assert length(better) <= length(plain) + 1e-9


@settings(max_examples=40, deadline=None)
@given(cells)
def test_no_reversal_shortens_the_path_so_it_does_not_cross_itself(chosen):
    path = shortest_path(chosen, LEGS.length)
    for i, j in combinations(range(path.size + 1), 2):
        turned = np.concatenate([path[:i], path[i:j][::-1], path[j:]])
        assert length(turned) >= length(path) - 1e-6


@settings(max_examples=40, deadline=None)
@given(cells)
def test_each_step_of_the_greedy_path_goes_to_a_nearest_cell(chosen):
    path = shortest_path(chosen, LEGS.length, improve=False)
    assert path[0] == chosen[0]
    for k in range(path.size - 1):
        assert LEGS.length[path[k], path[k + 1]] == LEGS.length[path[k], path[k + 1 :]].min()


def test_short_paths_are_close_to_the_best_of_all_orders():
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(25):
        chosen = rng.choice(256, 7, replace=False)
        best = min(length(np.array(order)) for order in permutations(chosen.tolist()))
        ratios.append(length(shortest_path(chosen, LEGS.length)) / best)
    assert min(ratios) >= 1 - 1e-12
    assert np.mean(ratios) < 1.05


@pytest.mark.parametrize("count", [0, 1])
def test_paths_of_none_and_one(count):
    assert shortest_path(np.arange(count), LEGS.length).tolist() == list(range(count))
