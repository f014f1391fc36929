"""The rule for models of another ground size (decision 8)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sparsor.prior.mismatch import mismatch_factor

ratios = st.floats(1.0, 1e4)


@given(st.floats(0.0, 1.0))
def test_the_same_size_costs_nothing_and_nothing_is_gained(ratio):
    assert mismatch_factor(ratio) == 1.0


@given(ratios, ratios)
def test_more_difference_costs_more(one, other):
    low, high = sorted((one, other))
    assert 1.0 <= mismatch_factor(low) <= mismatch_factor(high)


@given(ratios, ratios)
def test_two_steps_cost_their_product(one, other):
    assert mismatch_factor(one * other) == pytest.approx(mismatch_factor(one) * mismatch_factor(other), rel=1e-9)


def test_the_built_in_sizes_keep_it_below_a_tenth():
    assert 1.05 < mismatch_factor(1.57) < 1.10
