"""Maps of flights in ArduPilot's simulation, where their logs are at hand (SPARSOR_LOGS, or beside the project)."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from sparsor.journeys.reconstructing import ReconstructRequest, reconstruct

FOLDER = Path(os.environ.get("SPARSOR_LOGS", Path(__file__).resolve().parents[3] / "shared" / "logs"))
BOX = (51.4995, 25.3000, 51.5035, 25.3032)
M_PER_DEG = 111_318.845
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no logs in {FOLDER}")


def truth(lon_deg, lat_deg, height_m):
    """The simulated field; its formula is beside the logs."""
    north = (lat_deg - 25.3) * M_PER_DEG
    east = (lon_deg - 51.5) * M_PER_DEG * np.cos(np.radians(25.3))
    bump = np.exp(-((north - 180) ** 2 + (east - 150) ** 2) / (2 * 120**2))
    return 20 + 60 * bump * np.exp(-height_m / 200) + 0.02 * east


def made(log, plan, sensor="NO2", decoder="auto"):
    asked = {"plan": FOLDER / plan, "bbox": BOX, "unit": "ug/m3", "sensor": sensor, "decoder": decoder}
    return reconstruct(ReconstructRequest(logs=(FOLDER / log,), **asked))


def test_the_map_of_a_simulated_flight_is_the_field_within_its_own_uncertainty():
    found = made("arducopter_30wp_no2.tlog", "arducopter_30wp_no2.plan")
    flown = found.flown
    assert np.abs(flown.value - truth(flown.lon_deg, flown.lat_deg, flown.alt_m - 10)).max() < 0.01
    assert found.clock == "vehicle"
    height_m = np.median(flown.alt_m[flown.used]) - 10
    wanted = truth(*found.mission.grid.centres_deg(), height_m)
    off = np.abs(found.field_map.values - wanted)
    assert (off < 1.96 * found.field_map.standard_deviation).mean() > 0.95
    assert np.linalg.norm(off) < found.decoded.expected_relative_error * np.linalg.norm(wanted - wanted.mean())


def test_the_vehicles_own_log_gives_the_map_of_the_ground_stations():
    plan = "arducopter_4wp_companion.plan"
    # One decoder for both: two that decode about as well are a toss-up to `auto`.
    one = made("arducopter_4wp_companion.tlog", plan, decoder="kriging")
    other = made("arducopter_4wp_companion.BIN.xz", plan, "NO2S.NO2", "kriging")
    apart = np.abs(one.field_map.values - other.field_map.values)
    assert apart.max() < 0.2
    assert (one.samples.others, other.samples.others) == (("NO2C@1/191",), ("NO2C@1/191",))


def test_a_companions_values_are_timed_by_its_own_clock():
    found = made("arducopter_4wp_companion.tlog", "arducopter_4wp_companion.plan", "NO2C")
    assert found.clock == "companion"
    (use,) = found.samples.clocks
    assert use.rate == pytest.approx(0.1, rel=0.01)
    assert "mapped to the vehicle's" in found.field_map.facts["clock"]
