"""A bounded sample: everything while it fits, then as much from everywhere."""

from __future__ import annotations

import numpy as np
import pytest

from sparsor.prior.reservoir import Reservoir


def numbered(first, last):
    return np.arange(first, last, dtype=float)[:, None] * np.ones(3)


def filled(most, sizes, *key):
    kept, first = Reservoir(most, 3, *key), 0
    for size in sizes:
        kept.add(numbered(first, first + size))
        first += size
    return kept


@pytest.mark.parametrize("sizes", [[10], [3, 0, 7], [1] * 10])
def test_what_fits_is_kept_whole_and_in_order(sizes):
    kept = filled(10, sizes)
    np.testing.assert_array_equal(kept.maps, numbered(0, 10))
    assert kept.seen == 10


def test_of_more_as_many_as_fit_are_kept_in_order_however_they_come():
    whole = filled(50, [1000])
    assert (whole.seen, len(whole.maps)) == (1000, 50)
    assert (np.diff(whole.maps[:, 0]) > 0).all()
    for sizes in ([400, 600], [1] * 1000, [49, 2, 949]):
        np.testing.assert_array_equal(filled(50, sizes).maps, whole.maps)
    assert not np.array_equal(filled(50, [1000], 1).maps, whole.maps)


def test_every_place_in_the_stream_is_as_likely():
    places = np.concatenate([filled(50, [300] * 5, key).maps[:, 0] for key in range(60)])
    counts, _ = np.histogram(places, bins=5, range=(0, 1500))
    assert np.abs(counts - 600).max() < 4 * np.sqrt(600)
