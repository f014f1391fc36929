"""Units: there and back, and refusals that say what is allowed."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sparsor.errors import CalibrationError
from sparsor.fieldmap.units import MOLAR_MASS_G, UNITS, converted


@given(
    value=st.floats(-1e6, 1e6),
    unit=st.sampled_from(UNITS),
    other=st.sampled_from(UNITS),
    gas=st.sampled_from(sorted(MOLAR_MASS_G)),
    temperature_c=st.floats(-60, 60),
    pressure_hpa=st.floats(300, 1100),
)
def test_there_and_back(value, unit, other, gas, temperature_c, pressure_hpa):
    there = converted(value, unit, other, gas, temperature_c, pressure_hpa)
    back = converted(there, other, unit, gas, temperature_c, pressure_hpa)
    assert float(back) == pytest.approx(value, rel=1e-12, abs=1e-12)


def test_known_factors():
    # EU practice: 20 degrees C and 1013 hPa.
    assert float(converted(1, "ppb", "ug/m3", "NO2", 20, 1013)) == pytest.approx(1.9125, abs=1e-3)
    assert float(converted(1, "ppb", "µg/m³", "O3", 20, 1013)) == pytest.approx(1.9954, abs=1e-3)
    assert float(converted(1, "ppm", "mg/m3", "CO", 20, 1013)) == pytest.approx(1.1642, abs=1e-3)
    assert float(converted(2, "ppm", "ppb", "anything")) == pytest.approx(2000)


def test_thinner_air_holds_less():
    assert converted(1, "ppb", "ug/m3", "NO2", 25, 500) < converted(1, "ppb", "ug/m3", "NO2", 25, 1000)
    assert converted(1, "ppb", "ug/m3", "NO2", 40, 1000) < converted(1, "ppb", "ug/m3", "NO2", 0, 1000)


def test_the_same_unit_needs_no_conversion():
    assert float(converted(7, "counts", "counts", "PM")) == 7


@pytest.mark.parametrize(
    ("unit", "wanted", "gas", "air", "sentence"),
    [
        ("counts", "ppb", "NO2", (25, 1013), "unit 'counts' .* ppb, ppm, ng/m3, ug/m3, mg/m3"),
        ("ppb", "mol/m2", "NO2", (25, 1013), "unit 'mol/m2'"),
        ("ppb", "ug/m3", "Xe", (25, 1013), "gas 'Xe' .* NO2, NO, O3"),
        ("ppb", "ug/m3", "NO2", (300, 1013), r"temperature of 300 degrees C .* -120\.\.125"),
        ("ppb", "ug/m3", "NO2", (25, 101325), "pressure of 101325 hPa"),
        ("ppb", "ug/m3", "NO2", (float("nan"), 1013), "temperature of nan"),
    ],
)
def test_what_cannot_be_converted_is_refused(unit, wanted, gas, air, sentence):
    with pytest.raises(CalibrationError, match=sentence):
        converted(1.0, unit, wanted, gas, *air)
