from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sparsor.design import Budget, parse_budget, unit_legs
from sparsor.errors import BudgetError


@pytest.mark.parametrize(
    ("text", "measure", "value"),
    [
        ("10%", "fraction", 0.1),
        ("100 %", "fraction", 1.0),
        ("800m", "distance", 800.0),
        ("12.5 km", "distance", 12500.0),
        ("90s", "time", 90.0),
        ("25min", "time", 1500.0),
        ("1e0h", "time", 3600.0),
    ],
)
def test_budgets_are_read_with_their_units(text, measure, value):
    request = parse_budget(text)
    assert request.measure == measure
    assert request.value == pytest.approx(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("10", "no known unit"),
        ("10 miles", "no known unit"),
        ("ten%", "no known unit"),
        ("", "no known unit"),
        ("1.2.3km", "not a number"),
        ("-5km", "above zero"),
        ("0%", "above zero"),
        ("1e999km", "above zero"),
        ("150%", "more than full coverage"),
    ],
)
def test_other_budgets_are_refused_with_the_units_that_are_known(text, message):
    with pytest.raises(BudgetError, match=message):
        parse_budget(text)


def test_time_counts_the_flight_and_distance_only_the_path():
    legs = unit_legs((8, 8))
    stops = np.array([0, 7, 63])
    assert Budget(100, "distance", 5, 60).used(stops, legs) == 14.0
    closing = float(np.hypot(7, 7))
    assert Budget(100, "time", 5, 60).used(stops, legs) == pytest.approx(14 + closing + 3 * 5 + 60)
    home = np.full(64, 3.0)
    assert Budget(100, "time", 5, 60, home).used(stops, legs) == pytest.approx(14 + 6 + 15 + 60)


def test_more_budget_allows_more_stops_and_holds_cost_some():
    legs = unit_legs((32, 32))
    counts = [Budget(limit, "distance").stops_within(legs) for limit in (5, 50, 102, 300, 2000)]
    assert counts == sorted(counts)
    assert counts[0] == 2
    assert 10 <= counts[2] <= 40
    held = Budget(102, "time", per_stop=3.0).stops_within(legs)
    assert held < counts[2]
    half = replace(legs, allowed=np.arange(1024) < 512)
    assert Budget(102, "distance").stops_within(half) > counts[2]
