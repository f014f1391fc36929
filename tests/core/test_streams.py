"""A stream depends on its seed and key and on nothing else."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.core.streams import stream

SEEDS = st.integers(0, 2**70)
KEYS = st.lists(st.integers(0, 2**32 - 1), max_size=3).map(tuple)


def draws(seed, *key):
    return tuple(stream(seed, *key).integers(0, 2**63, size=4).tolist())


@settings(max_examples=60, deadline=None)
@given(SEEDS, KEYS)
def test_the_same_seed_and_key_give_the_same_stream(seed, key):
    assert draws(seed, *key) == draws(seed, *key)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(SEEDS, KEYS), min_size=2, max_size=8, unique=True))
def test_different_seeds_or_keys_give_different_streams(named):
    assert len({draws(seed, *key) for seed, key in named}) == len(named)


def test_neither_the_place_in_the_key_nor_its_length_is_mixed_up():
    keys = [(), (0,), (0, 0), (1,), (1, 0), (0, 1), (12,), (1, 2), (2, 1)]
    assert len({draws(3, *key) for key in keys} | {draws(key, 3) for key in range(3)}) == len(keys) + 3


def test_other_streams_drawn_before_make_no_difference():
    alone = draws(5, 2)
    np.random.default_rng(5).random(100)
    for key in range(4):
        stream(5, key).random(1000)
    assert draws(5, 2) == alone


def test_neighbouring_streams_are_uncorrelated():
    count, length = 60, 2000
    by_key = np.array([stream(1, key).normal(size=length) for key in range(count)])
    by_seed = np.array([stream(seed, 1).normal(size=length) for seed in range(count)])
    for drawn in (by_key, by_seed):
        between = np.corrcoef(drawn)[np.triu_indices(count, 1)]
        assert np.abs(between).max() < 5.5 / np.sqrt(length)
        assert abs(between.std() * np.sqrt(length) - 1) < 0.1
