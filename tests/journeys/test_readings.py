"""From what a sensor logged to concentrations."""

from __future__ import annotations

import numpy as np
import pytest

from sparsor.fieldmap.units import converted
from sparsor.flightlog import read_log, samples
from sparsor.journeys.readings import concentrations
from sparsor.vehicle import load_sensor


def test_a_barometer_that_shows_nothing_yet_does_not_spoil_the_conversion(tmp_path):
    pressure = np.array([0.0, 900.0, 900.0, 900.0])
    rows = [f"{k},51.500{k},25.3,10,{one},20" for k, one in enumerate(pressure)]
    (tmp_path / "t.csv").write_text("\n".join(["time_s,lon,lat,NO2,press_abs,temperature", *rows]), encoding="utf-8")
    log = read_log(tmp_path / "t.csv")
    logged = samples(log, sensor="NO2", max_gap_s=10.0)
    profile = load_sensor().model_copy(update={"unit": "ppb"})
    made = concentrations(log, logged, profile=profile, calibration=None, unit="ug/m3", t90_s=None)
    assert made.value == pytest.approx(converted(10.0, "ppb", "ug/m3", "NO2", 20.0, [1013.25, 900.0, 900.0, 900.0]))
    assert "20.0 degrees C and 900 hPa" in made.words
