"""The whole journey on a known field: plan, practice flight, log of a slow and noisy sensor, map in the sensor's unit.

The flight is flown once; twenty sensors are carried along its track, each with noise and drop-outs of its own.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from threadpoolctl import threadpool_limits

from practice_rig import Rig, mission_messages
from sparsor.core.metrics import centred_relative_error
from sparsor.journeys.folder import write_mission
from sparsor.journeys.planning import plan_mission
from sparsor.journeys.reconstructing import ReconstructRequest, reconstruct
from sparsor.link.practice import PracticeSensor, SensorSettings, built_in_over
from sparsor.mission.specification import specification

if TYPE_CHECKING:
    from pathlib import Path

    from sparsor.journeys.planning import PlannedMission

BOX = (51.50, 25.27, 51.52, 25.29)
ALTITUDE_M = 50.0
SEEDS, UNCORRECTED = 20, 4
SENSOR = SensorSettings(low_ppb=10.0, high_ppb=70.0, t90_s=20.0, noise_ppb=5.0, drop_out_fraction=0.1)
TRUTH = built_in_over(BOX)
STEP_S = 0.2
POSITION_HZ = 4
BEGIN_UNIX_US = 1_750_000_000_000_000
FINE = 8  # points a side in each cell


@dataclass(frozen=True)
class Flown:
    """A planned mission, its folder, and where the vehicle was: seconds, degrees east and north, m above home."""

    mission: PlannedMission
    folder: Path
    track: np.ndarray
    positions: list[Any]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("missions") / "known"
    asked = {
        "name": "known",
        "area": {"bbox": BOX},
        "search": {"iterations": 60, "budget": "15%"},
        "flight": {"altitude_m": ALTITUDE_M, "speed_m_s": 10.0, "hold_s": 2.0},
    }
    with threadpool_limits(1):  # beside other test processes
        mission = plan_mission(specification(asked, base=folder))
    write_mission(mission, folder, preview=False)
    return Flown(mission, folder, *practice_flight(mission))


def practice_flight(mission):
    """Fly a mission from the test's own clock; returns the track at every step, and the positions it sent."""
    rig = Rig.of("ardupilot", plan=mission.plan)
    rig.run(20.0)
    rig.send(mavlink.MAVLink_request_data_stream_message(1, 1, mavlink.MAV_DATA_STREAM_POSITION, POSITION_HZ, 1))
    assert rig.upload(mission_messages(mission.plan, "ardupilot")) == mavlink.MAV_MISSION_ACCEPTED
    rig.take_off()
    track = []

    def landed():
        track.append((rig.vehicle.time_s, *rig.flight.lon_lat_deg, rig.flight.motion.up_m))
        return not rig.flight.armed

    assert rig.run(2 * mission.flight_time_s, until=landed, step_s=STEP_S)
    return np.array(track), [one for one in rig.heard if one.get_type() == "GLOBAL_POSITION_INT"]


def log_of(flown, seed, path, begin_us=BEGIN_UNIX_US):
    """Write the .tlog of a flight with a sensor on board."""
    sensor = PracticeSensor(TRUTH, SENSOR, seed)
    messages = [(one.time_boot_ms, one) for one in flown.positions]
    for time_s, lon_deg, lat_deg, _ in flown.track:
        value = sensor.step(lon_deg, lat_deg, time_s)
        if value is not None:
            at_ms = round(1000 * time_s)
            messages.append((at_ms, mavlink.MAVLink_named_value_float_message(at_ms, b"NO2", value)))
    vehicle = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    records = [
        struct.pack(">Q", begin_us + 1000 * at_ms) + message.pack(vehicle)
        for at_ms, message in sorted(messages, key=lambda one: one[0])
    ]
    path.write_bytes(b"".join(records))
    return path


def cell_means(grid):
    """Return the field's mean in every cell, ppb."""
    rows, columns = grid.shape
    west, south, east, north = BOX
    lon = west + (np.arange(columns * FINE) + 0.5) / (columns * FINE) * (east - west)
    lat = north - (np.arange(rows * FINE) + 0.5) / (rows * FINE) * (north - south)
    share = np.array([[TRUTH(one, other) for one in lon] for other in lat])
    ppb = SENSOR.low_ppb + (SENSOR.high_ppb - SENSOR.low_ppb) * share
    return ppb.reshape(rows, FINE, columns, FINE).mean(axis=(1, 3)).ravel()


def error(flown, truth, log, t90_s):
    """Return the map's error, as it is stated, and the share of the true cells within 1.96 standard deviations."""
    request = ReconstructRequest(logs=(log,), mission=flown.folder, unit="ppb", t90_s=t90_s)
    with threadpool_limits(1):
        found = reconstruct(request).decoded
    within = np.abs(found.values - truth) <= 1.96 * found.standard_deviation
    realised = float(centred_relative_error(truth[None], found.values[None])[0])
    return realised, found.expected_relative_error, within.mean()


@pytest.mark.timeout(300)
def test_field_to_plan_to_flight_to_log_to_map(flown, tmp_path):
    truth = cell_means(flown.mission.place.grid)
    logs = [log_of(flown, seed, tmp_path / f"{seed}.tlog") for seed in range(SEEDS)]
    errors, stated, covered = np.transpose([error(flown, truth, log, SENSOR.t90_s) for log in logs])
    bound = 1.25 * np.hypot(flown.mission.expected_relative_error, SENSOR.noise_ppb / truth.std())
    uncorrected = np.mean([error(flown, truth, log, 0.0)[0] for log in logs[:UNCORRECTED]])
    assert errors.mean() <= bound
    assert errors.mean() < 1.25 * stated.mean()
    assert uncorrected > 1.25 * errors[:UNCORRECTED].mean()
    assert covered.mean() > 0.9
