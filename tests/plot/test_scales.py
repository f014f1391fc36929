"""Round numbers at every scale that a box may have."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sparsor.plot.scales import degree_label, graticule, length_label, scale_bar_m

SPANS = st.floats(math.log(1e-3), math.log(170.0)).map(math.exp)


def is_round(value: float) -> bool:
    mantissa = value / 10.0 ** math.floor(math.log10(value) + 1e-9)
    return any(math.isclose(mantissa, factor, rel_tol=1e-9) for factor in (1, 2, 5))


@given(st.floats(-180.0, 180.0), SPANS, st.integers(2, 10))
def test_graticule_steps_are_round_and_few_enough(low: float, span: float, at_most: int) -> None:
    values, step = graticule(low, low + span, at_most)
    assert is_round(step)
    assert len(values) <= at_most + 1
    assert np.all((values >= low - 1e-6 * step) & (values <= low + span + 1e-6 * step))
    np.testing.assert_allclose(np.diff(values), step, rtol=1e-6)
    # No round value between the limits is left out.
    assert len(values) >= math.floor(span / step)


@given(st.floats(-180.0, 180.0), SPANS, st.integers(2, 10))
def test_labels_say_the_value_without_offset_or_exponent(low: float, span: float, at_most: int) -> None:
    values, step = graticule(low, low + span, at_most)
    labels = [degree_label(value, step, "lon") for value in values]
    assert len(set(labels)) == len(labels)
    for value, label in zip(values, labels, strict=True):
        number, hemisphere = label.split("°")
        assert "e" not in number
        assert float(number) <= 180.0
        east = -float(number) if hemisphere == "W" else float(number)
        assert math.isclose((east - value + 180.0) % 360.0 - 180.0, 0.0, abs_tol=1e-3 * step)


def test_labels_across_the_antimeridian_and_at_zero() -> None:
    values, step = graticule(179.9, 180.1, 4)
    assert [degree_label(v, step, "lon") for v in values] == [
        "179.90°E", "179.95°E", "180.00°", "179.95°W", "179.90°W",
    ]  # fmt: skip
    assert [degree_label(v, 1.0, "lat") for v in (-1.0, 0.0, 1.0)] == ["1°S", "0°", "1°N"]


@given(st.floats(math.log(10.0), math.log(3e6)).map(math.exp))
def test_scale_bars_are_round_and_as_long_as_they_can_be(longest: float) -> None:
    length = scale_bar_m(longest)
    assert is_round(length)
    assert 0.4 * longest - 1e-6 <= length <= longest * (1 + 1e-9)


def test_lengths_are_in_metres_or_kilometres() -> None:
    assert [length_label(m) for m in (20, 500, 1000, 5000, 500_000, 1_000_000)] == [
        "20 m", "500 m", "1 km", "5 km", "500 km", "1000 km",
    ]  # fmt: skip
