"""The sensor that flies: its response, its noise, its silences, and its seed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mission_strategies import example_plan
from practice_rig import Rig, mission_messages
from sparsor.errors import FieldError, InputError
from sparsor.geodesy import BoundingBox, Grid
from sparsor.link.practice import PracticeSensor, RasterTruth, SensorSettings, built_in_truth

QUIET = {"noise_ppb": 0.0}


def readings(sensor, seconds, lon=51.5, lat=25.27, dt=0.05):
    found = {}
    for step in range(1, round(seconds / dt) + 1):
        value = sensor.step(lon, lat, step * dt)
        if value is not None:
            found[round(step * dt, 6)] = value
    return found


@given(st.floats(1, 80))
def test_after_t90_it_shows_ninety_per_cent_of_a_step(t90):
    level = 0.0

    def truth(_lon, _lat):
        return level

    sensor = PracticeSensor(truth, SensorSettings(t90_s=t90, interval_s=0.05, **QUIET), seed=0)
    readings(sensor, 1.0)
    level = 1.0
    values = [sensor.step(0, 0, 1.0 + 0.05 * step) for step in range(1, round(t90 / 0.05) + 1)]
    assert values[-1] == pytest.approx(10 + 60 * 0.9, abs=60 * 0.15 * 0.05 / t90 * 2 + 0.01)


def test_without_a_response_time_it_reads_the_truth():
    sensor = PracticeSensor(lambda lon, _lat: lon, SensorSettings(t90_s=0, low_ppb=5, high_ppb=25, **QUIET), seed=0)
    assert set(readings(sensor, 20, lon=0.25).values()) == {10.0}


def test_samples_come_at_their_interval_and_lost_ones_do_not():
    every = readings(PracticeSensor(lambda *_: 0.5, SensorSettings(**QUIET), seed=1), 1000)
    assert np.diff(sorted(every)) == pytest.approx(1.0)
    lossy = readings(PracticeSensor(lambda *_: 0.5, SensorSettings(drop_out_fraction=0.3, **QUIET), seed=1), 1000)
    assert len(lossy) == pytest.approx(700, abs=60)
    assert set(lossy) < set(every)


def test_noise_has_its_size_and_drift_grows():
    values = readings(PracticeSensor(lambda *_: 0.5, SensorSettings(noise_ppb=5), seed=3), 3000)
    assert np.std(list(values.values())) == pytest.approx(5, rel=0.1)
    ends = [
        list(readings(PracticeSensor(lambda *_: 0.5, SensorSettings(drift_ppb_h=20, **QUIET), s), 900, dt=1).values())[
            -1
        ]
        for s in range(60)
    ]
    assert np.std(ends) == pytest.approx(10, rel=0.35)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_the_same_seed_flies_the_same_samples(autopilot):
    plan = example_plan(autopilot, stops=2)

    def samples(seed, step_s):
        truth = built_in_truth(plan.home.lon_deg, plan.home.lat_deg, cells=64)
        settings = SensorSettings(noise_ppb=5, drop_out_fraction=0.1, drift_ppb_h=2)
        rig = Rig.of(autopilot, plan=plan, truth=truth, seed=seed, sensor=settings)
        rig.upload(mission_messages(plan, autopilot))
        rig.run(10)
        rig.take_off()
        rig.run(200, step_s=step_s)
        return rig

    one, other = samples(7, 0.5), samples(7, 2.5)
    assert one.vehicle.samples == other.vehicle.samples
    assert len(one.vehicle.samples) > 150
    assert [s.value for s in samples(8, 0.5).vehicle.samples] != [s.value for s in one.vehicle.samples]
    sent = [m for m in one.heard if m.get_type() == "NAMED_VALUE_FLOAT"]
    assert [m.time_boot_ms for m in sent] == [round(s.time_s * 1000) for s in one.vehicle.samples]
    assert {m.name for m in sent} == {"NO2"}


def test_the_built_in_truth_runs_from_0_to_1_and_is_the_field():
    truth = built_in_truth(51.53, 25.29, side_m=4000, cells=32)
    west, south, east, north = truth.box
    assert (truth.values.min(), truth.values.max()) == (0, 1)
    lon, lat = Grid(BoundingBox(*truth.box)).centres_deg(np.arange(1024))
    assert [truth(*place) for place in zip(lon, lat, strict=True)] == pytest.approx(truth.values.ravel(), abs=1e-5)
    assert truth(west - 1, north + 1) == pytest.approx(truth.values[0, 0])
    assert truth(east + 1, south - 1) == pytest.approx(truth.values[-1, -1], abs=1e-4)


def test_a_raster_is_read_between_its_centres():
    truth = RasterTruth(np.array([[0.0, 1.0], [0.0, 1.0]]), (0.0, 0.0, 2.0, 2.0))
    assert truth(1.0, 1.0) == pytest.approx(0.5)
    assert truth(0.75, 1.7) == pytest.approx(0.25)


def test_beyond_the_domain_there_is_no_built_in_field():
    with pytest.raises(FieldError):
        built_in_truth(-70.0, 40.0)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"name": "NITROGENDIOXIDE"}, "1 to 10 characters"),
        ({"low_ppb": 70.0}, "LO below HI"),
        ({"t90_s": -1.0}, "t90_s is -1"),
        ({"drop_out_fraction": 1.0}, "drop-outs of 1"),
        ({"interval_s": 0.0}, "interval of 0"),
    ],
)
def test_settings_out_of_range_are_named(wrong, sentence):
    with pytest.raises(InputError, match=sentence):
        SensorSettings(**wrong)
