"""One practice flight in the vehicle's own log and in the ground station's: both tell the same."""

from __future__ import annotations

import numpy as np
import pytest

from flightlog.recorded import COMPANION_LATE_S, COMPANION_RATE, HEIGHT_M, recorded_flight
from mission_strategies import AUTOPILOT_NAMES
from sparsor.fieldmap.mission_part import mission_part
from sparsor.flightlog import read_log, read_logs, samples
from sparsor.geodesy import BoundingBox, Grid

M_PER_DEG = 111_000.0
GRID = Grid(BoundingBox(51.50, 25.26, 51.53, 25.30))


@pytest.fixture(scope="module", params=AUTOPILOT_NAMES)
def flight(request, tmp_path_factory):
    flown = recorded_flight(request.param, tmp_path_factory.mktemp("vehicle"))
    path = tmp_path_factory.mktemp("station") / "flight.tlog"
    path.write_bytes(flown.tlog)
    return path, flown.vehicle_log


def test_the_vehicles_own_log_gives_the_ground_stations_samples(flight):
    station, vehicle = (samples(read_log(path), sensor="NO2") for path in flight)
    inside = (station.time_s > vehicle.time_s[0] - 0.01) & (station.time_s < vehicle.time_s[-1] + 0.01)
    assert inside.sum() == vehicle.value.size > 60
    assert vehicle.value.tolist() == station.value[inside].tolist()
    assert vehicle.time_s == pytest.approx(station.time_s[inside], abs=0.01)
    for name in ("lon_deg", "lat_deg"):
        apart_m = (getattr(vehicle, name) - getattr(station, name)[inside]) * M_PER_DEG
        assert np.abs(apart_m).max() < 1.0
    assert np.abs(vehicle.alt_m - station.alt_m[inside]).max() < 0.5
    if np.isfinite(vehicle.height_m).any():  # PX4's practice log does not tell home
        assert np.abs(vehicle.height_m - station.height_m[inside]).max() < 0.5


def test_either_log_tells_the_mission_from_take_off_and_landing(flight):
    found = [samples(read_log(path), sensor="NO2") for path in flight]
    parts = [mission_part(one, GRID, HEIGHT_M) for one in found]
    assert [part.warnings for part in parts] == [(), ()]
    station, vehicle = (set(one.value[part.in_flight]) for one, part in zip(found, parts, strict=True))
    assert 60 < len(vehicle) < found[1].value.size
    assert len(station ^ vehicle) <= 2  # one at the edge of the band, going up and coming down


def test_both_know_the_time_of_day_and_what_happened(flight):
    station, vehicle = (read_log(path) for path in flight)
    offsets_s = [log.boots[0].unix_offset_s for log in (station, vehicle)]
    assert offsets_s[0] == pytest.approx(offsets_s[1], abs=0.1)
    heard, kept = ([one for one in log.events if one.kind.endswith("armed")] for log in (station, vehicle))
    assert [one.kind for one in heard] == [one.kind for one in kept] == ["armed", "disarmed"]
    assert [one.time_s for one in heard] == pytest.approx([one.time_s for one in kept], abs=1.1)  # heartbeats


def test_together_they_are_one_flight(flight):
    log = read_logs(flight)
    assert len(log.boots) == 1
    alone = samples(read_log(flight[0]), sensor="NO2")
    assert samples(log, sensor="NO2").value.tolist() == alone.value.tolist()


def test_the_companions_clock_is_recovered_from_the_ground_stations_log(flight):
    found = samples(read_log(flight[0]), sensor="NO2C")
    (use,) = found.clocks
    assert (use.clock, use.rate) == ("companion", pytest.approx(COMPANION_RATE, rel=1e-3))
    assert use.offset_s == pytest.approx(COMPANION_LATE_S, abs=0.2)
    assert found.time_s == pytest.approx(found.value / 0.1, abs=0.2)


def test_a_listed_mission_is_not_a_flown_one(flight):
    for log in map(read_log, flight):
        armed_s = next(one.time_s for one in log.events if one.kind == "armed")
        started = [one for one in log.events if one.kind == "item_current" and one.value > 1]
        assert all(one.time_s > armed_s + 1.0 for one in started)
