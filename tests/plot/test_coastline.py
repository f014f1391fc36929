"""The coastline: where it is, what is cut, and that its file is what the script makes."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod

from sparsor.plot import coastline

GEOD = Geod(ellps="WGS84")
DATA = files("sparsor.plot") / "data"


def length_km(box: tuple[float, float, float, float]) -> float:
    return sum(GEOD.line_length(lon, lat) for lon, lat in coastline(*box)) / 1000


@given(st.floats(38, 62), st.floats(16, 32), st.floats(0.01, 5), st.floats(0.01, 5))
def test_every_point_lies_in_the_box(west: float, south: float, width: float, height: float) -> None:
    for lon, lat in coastline(west, south, west + width, south + height):
        assert len(lon) == len(lat) >= 2
        assert west - 1e-9 <= lon.min() <= lon.max() <= west + width + 1e-9
        assert south - 1e-9 <= lat.min() <= lat.max() <= south + height + 1e-9


@pytest.mark.parametrize("box", [(0.0, 50.0, 5.0, 55.0), (179.0, -18.0, 181.0, -16.0), (46.0, 24.0, 47.0, 25.0)])
def test_there_is_none_outside_the_data_and_none_inland(box: tuple[float, float, float, float]) -> None:
    assert coastline(*box) == []


def test_qatar_is_there() -> None:
    # The coast of Qatar is given as 563 km (CIA World Factbook); this shore is finer and has its islands.
    assert 500 < length_km((50.7, 24.7, 51.8, 26.3)) < 1500
    # Its peninsula: a parallel across it meets the coast in the west and in the east, and nothing between.
    crossings = np.concatenate([lon for lon, _ in coastline(50.6, 25.2, 52.0, 25.21)])
    assert np.all((np.abs(crossings - 50.78) < 0.1) | (np.abs(crossings - 51.6) < 0.1))
    assert np.any(crossings < 51)
    assert np.any(crossings > 51)
    northmost = max(lat.max() for lon, lat in coastline(50.9, 25.5, 51.6, 26.5))
    assert northmost == pytest.approx(26.18, abs=0.03)


def test_two_halves_have_the_length_of_the_whole() -> None:
    west, south, east, north = box = (50.0, 24.0, 54.0, 27.0)
    halves = length_km((west, south, 52.0, north)) + length_km((52.0, south, east, north))
    assert halves == pytest.approx(length_km(box), rel=1e-9)


def test_the_file_is_small_says_where_it_is_from_and_needs_no_pickle() -> None:
    with (DATA / "coastline.npz").open("rb") as stream:
        assert len(stream.read()) < 600_000
        stream.seek(0)
        data = np.load(stream, allow_pickle=False)
        assert "GSHHG" in str(data["attribution"])
        assert "LGPL-3.0-or-later" in str(data["attribution"])
        assert data["offsets"][-1] == len(data["differences"])
    for name in ("README.md", "COPYING", "COPYING.LESSER"):
        assert (DATA / name).is_file()
