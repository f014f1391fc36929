"""Sorties as they are flown: every stop in one of them, none beyond the endurance less reserve, item by item."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sparsor.design import Candidate
from sparsor.errors import MissionError
from sparsor.journeys.fleet import cut_for_vehicles
from sparsor.journeys.flights import Flights
from sparsor.journeys.preparing import prepare
from sparsor.journeys.sorties import Sorties, cut_into_sorties
from sparsor.mission import Home, time_plan
from sparsor.mission.separation import nearest
from sparsor.mission.specification import specification
from sparsor.vehicle import usable_seconds

BOX = (51.50, 25.27, 51.53, 25.30)


@pytest.fixture(scope="module", params=["quad", "plane"])
def prepared(request):
    flight = {"vehicle": request.param, "wind": (5.0, 300.0), "drop_unreachable": True}
    spec = specification({"name": "m", "area": {"bbox": BOX}, "flight": flight}, base=Path())
    return spec, prepare(spec)


@settings(
    max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(seed=st.integers(0, 10_000), homes=st.integers(1, 2), hold_s=st.sampled_from([0.0, 90.0]))
def test_no_sortie_is_beyond_the_endurance_and_every_stop_in_one(prepared, seed, homes, hold_s):
    spec, ready = prepared
    spec = spec.model_copy(update={"flight": spec.flight.model_copy(update={"hold_s": hold_s})})
    rng = np.random.default_rng(seed)
    stops = rng.permutation(1024)[: rng.integers(3, 16)]
    places = rng.uniform((51.45, 25.22), (51.58, 25.35), (homes, 2))
    route = Candidate(0, 0.0, 0.0, 0.0, 0.0, np.zeros((1, 1024), dtype=bool), stops, 0.0, 0)
    flights = Flights(spec, ready, route, tuple(Home(*place) for place in places))
    cut = cut_into_sorties(flights)
    if isinstance(cut, str):
        assert "nothing would be left" in cut
        return
    assert isinstance(cut, Sorties)
    assert sorted(np.concatenate([*cut.orders, cut.dropped]).tolist()) == list(range(stops.size))
    for plan, time in zip(cut.plans, cut.times, strict=True):
        assert time == time_plan(plan, ready.vehicle, ready.wind)
        assert time.used_s <= usable_seconds(ready.vehicle)
        assert any(np.allclose((plan.home.lon_deg, plan.home.lat_deg), place, atol=1e-6) for place in places)


@settings(
    max_examples=6, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(seed=st.integers(0, 10_000), vehicles=st.integers(2, 3), own=st.booleans(), hold_s=st.sampled_from([0.0, 150.0]))
def test_vehicles_at_once_take_off_as_often_as_their_batteries_need(seed, vehicles, own, hold_s):
    rng = np.random.default_rng(seed)
    stops = rng.permutation(1024)[: rng.integers(3, 24)]
    places = [
        tuple(place) for place in rng.uniform((51.50, 25.27), (51.53, 25.30), (vehicles if own else 1, 2)).tolist()
    ]
    flight = {"vehicle": "quad", "vehicles": vehicles, "hold_s": hold_s, "separation_m": 12.0, "homes": places}
    spec = specification({"name": "m", "area": {"bbox": BOX}, "flight": flight}, base=Path())
    ready = prepare(spec)
    route = Candidate(0, 0.0, 0.0, 0.0, 0.0, np.zeros((1, 1024), dtype=bool), stops, 0.0, 0)
    flights = Flights(spec, ready, route, tuple(Home(*place) for place in places))
    try:
        cut = cut_for_vehicles(flights)
    except MissionError as error:
        assert own, error  # places beside one home are always found for these
        assert "cannot be kept 12 m apart" in str(error)
        return
    assert isinstance(cut, Sorties)
    assert sorted(np.concatenate(cut.orders).tolist()) == list(range(stops.size))
    assert all(time.used_s <= usable_seconds(ready.vehicle) for time in cut.times)
    assert list(cut.rounds) == sorted(cut.rounds)
    for number in range(1, max(cut.rounds, default=0) + 1):
        plans = [plan for plan, its in zip(cut.plans, cut.rounds, strict=True) if its == number]
        assert 1 <= len(plans) <= vehicles
        assert nearest(plans, ready.vehicle).distance_m >= 12.0 - 1e-6
    if cut.vehicles:  # else they are flown one after the other
        assert all(1 <= its <= vehicles for its in cut.vehicles)
        at = {(its, plan.home, plan.stops[0].altitude_m) for its, plan in zip(cut.vehicles, cut.plans, strict=True)}
        assert len(at) == len({*cut.vehicles})  # each keeps its place and its height
        for its, home, _ in at:
            assert not own or (home.lon_deg, home.lat_deg) == pytest.approx(places[its - 1], abs=1e-6)
    if max(cut.rounds, default=1) > 1:  # and not more often than they need
        assert sum(time.used_s for time in cut.times) > 0.6 * (max(cut.rounds) - 1) * usable_seconds(ready.vehicle)
