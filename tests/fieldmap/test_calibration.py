"""Calibration: readings to concentrations, with other values of the log."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sparsor.errors import CalibrationError
from sparsor.fieldmap.calibration import Ambient, Calibration, Cross, calibrated, read_calibration, value_at
from sparsor.flightlog import read_log, samples

if TYPE_CHECKING:
    from pathlib import Path

EXAMPLE = """
zero = 2.0
span = 1.25
[temperature]
reference = 25.0
zero = 0.1
span = 0.01
[humidity]
source = "RH"
reference = 50.0
zero = -0.02
[cross.O3]
factor = 0.3
"""


@given(
    zero=st.floats(-100, 100),
    span=st.floats(0.1, 10),
    t=st.floats(-20, 60),
    truth=st.floats(0, 500),
    o3=st.floats(0, 99),
)
def test_it_inverts_a_sensor_that_does_all_of_this(zero, span, t, truth, o3):
    calibration = Calibration(
        zero=zero,
        span=span,
        temperature=Ambient(source="T", reference=25.0, zero=0.2, span=0.01),
        cross={"O3": Cross(factor=0.4, reference=10.0)},
    )
    gas = truth + 0.4 * (o3 - 10.0)
    reading = zero + 0.2 * (t - 25) + gas * (1 + 0.01 * (t - 25)) / span
    found = calibration.apply(np.array([reading]), {"T": np.array([t]), "O3": np.array([o3])})
    assert found[0] == pytest.approx(truth, abs=1e-6)


def test_a_file(tmp_path: Path):
    path = tmp_path / "no2.toml"
    path.write_text(EXAMPLE, encoding="utf-8")
    calibration = read_calibration(path)
    assert calibration.sources == ("temperature", "RH", "O3")
    others = {"temperature": np.array([35.0]), "RH": np.array([50.0]), "O3": np.array([10.0])}
    assert calibration.apply(np.array([14.0]), others)[0] == pytest.approx((14 - 2 - 1) * 1.25 / 1.1 - 3)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("zeros = 1", "unknown key 'zeros'; known are zero, span"),
        ("span = 0.0", "span = 0.0 is not allowed: input should be greater than 0"),
        ("[temperature]\nzero = 1.0", "the key 'temperature.reference' is missing"),
        ("[humidity]\nreference = 50.0", "humidity has no source"),
        ("[cross.O3]\nfactor = nan", "cross.O3.factor = nan is not allowed"),
        ("zero = ", "is not TOML"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(tmp_path: Path, text: str, sentence: str):
    path = tmp_path / "no2.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CalibrationError, match=sentence):
        read_calibration(path)


def table(tmp_path: Path):
    """A flight whose ozone comes every ten seconds, and not at the end."""
    path = tmp_path / "flight.csv"
    rows = ["time_s,lon_deg,lat_deg,NO2,O3"]
    for t in range(300):
        ozone = f"{20 + t / 10}" if t % 10 == 0 and t < 200 else ""
        rows.append(f"{t},{51.5 + t * 1e-5:.6f},25.3,{30 + t / 100},{ozone}")
    path.write_text("\n".join(rows), encoding="utf-8")
    log = read_log(path)
    return log, samples(log, sensor="NO2")


def test_other_values_are_interpolated_and_never_held(tmp_path: Path):
    log, own = table(tmp_path)
    ozone = value_at(log, own, "O3")
    known = own.time_s <= 190
    np.testing.assert_allclose(ozone[known], 20 + own.time_s[known] / 10)
    assert np.isnan(ozone[own.time_s > 190]).all()
    found = calibrated(log, own, Calibration(cross={"O3": Cross(factor=0.5)}))
    np.testing.assert_allclose(found[known], own.value[known] - 0.5 * ozone[known])
    assert np.array_equal(np.isnan(found), ~known)


def test_a_value_that_is_not_in_the_log_is_named(tmp_path: Path):
    log, own = table(tmp_path)
    with pytest.raises(CalibrationError, match="the value 'SO2' is not in the log; there are NO2, O3"):
        calibrated(log, own, Calibration(cross={"SO2": Cross(factor=1.0)}))
