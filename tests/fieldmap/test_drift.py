"""A drift is recovered where the route meets itself, and not made up where it does not."""

from __future__ import annotations

import numpy as np
import pytest

from fieldmap.flights import GRID, flight, profile, samples_at
from sparsor.fieldmap.measuring import measure


@pytest.mark.parametrize("t90_s", [0.0, 20.0])
def test_a_drift_is_recovered_and_taken_off(t90_s):
    rates = []
    for seed in range(4):
        samples, _ = flight(seed, t90_s=t90_s, noise=1.0, drift_ppb_h=5.0, across=True)
        drift = measure(samples, GRID, profile(t90_s=t90_s)).drift
        assert drift.applied
        assert drift.revisits > 20
        assert abs(drift.rate_per_h - 5.0) < 4 * drift.sd_per_h
        rates.append(drift.rate_per_h)
    assert np.mean(rates) == pytest.approx(5.0, rel=0.2)


def test_no_drift_is_made_up():
    applied = []
    for seed in range(6):
        samples, _ = flight(seed, noise=1.0, across=True)
        drift = measure(samples, GRID, profile()).drift
        assert abs(drift.rate_per_h) < 4 * drift.sd_per_h
        applied.append(drift.applied)
    assert sum(applied) <= 2


def test_without_revisits_it_is_not_told():
    samples, _ = flight(1, drift_ppb_h=50.0)
    found = measure(samples, GRID, profile())
    assert np.isnan(found.drift.rate_per_h)
    assert not found.drift.applied
    assert not any("drift" in warning for warning in found.warnings)


def test_the_level_is_that_of_the_beginning():
    samples, _ = flight(2, noise=1.0, drift_ppb_h=20.0, across=True)
    still, _ = flight(2, noise=1.0, across=True)
    found, wanted = (measure(one, GRID, profile()).measurements for one in (samples, still))
    assert found.values.mean() == pytest.approx(wanted.values.mean(), abs=1.0)
    drifted = np.std(found.values - wanted.values)
    assert drifted < 0.25 * np.std(20.0 * samples.time_s / 3600)


def test_what_the_profile_expects_is_handed_on_even_where_nothing_tells_it():
    samples, _ = flight(1)
    assert not measure(samples, GRID, profile()).measurements.drift_sd.any()
    rows = measure(samples, GRID, profile(drift_sd_per_h=6.0)).measurements
    hours = np.ptp(samples.time_s) / 3600
    assert rows.drift_sd.min() >= 0
    assert np.ptp(rows.drift_sd) == pytest.approx(6.0 * hours, rel=0.1)
    # The lines are flown northwards: the later a cell, the further north.
    assert np.corrcoef(rows.drift_sd, -rows.weights.argmax(axis=1))[0, 1] > 0.9


def test_boots_that_no_clock_joins_tell_no_drift():
    samples, _ = flight(1, drift_ppb_h=20.0, across=True)
    half = samples.value.size // 2
    boot = (np.arange(samples.value.size) >= half).astype(int)
    box = GRID.box
    east = (samples.lon_deg - box.west_deg) / box.width_deg
    north = (samples.lat_deg - box.south_deg) / box.height_deg
    time_s = np.where(boot, samples.time_s - samples.time_s[half], samples.time_s)
    apart = samples_at(east, north, samples.value, time_s=time_s, boot=boot)
    joined = samples_at(east, north, samples.value, time_s=time_s, boot=boot, unix_s=1.7e9 + samples.time_s)
    assert np.isnan(measure(apart, GRID, profile()).drift.rate_per_h)
    assert measure(joined, GRID, profile()).drift.rate_per_h == pytest.approx(20.0, rel=0.3)
