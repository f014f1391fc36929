"""Hypothesis strategies that several test modules share."""

from __future__ import annotations

import math

from hypothesis import assume
from hypothesis import strategies as st

from sparsor.geodesy import BoundingBox, Grid

EQUATOR_M_PER_DEG = 111_320.0
MERIDIAN_M_PER_DEG = 111_130.0


def sides_m(low: float = 203.0, high: float = 2.97e6) -> st.SearchStrategy[float]:
    """Sides of boxes, as likely small as large, a hair inside the allowed 200 m to 3000 km."""
    return st.floats(math.log(low), math.log(high)).map(math.exp)


@st.composite
def boxes(draw: st.DrawFn, *, across: bool = False) -> BoundingBox:
    """Boxes anywhere but the poles, 200 m to 3000 km; all of them `across` the antimeridian when asked."""
    height_deg = draw(sides_m()) / MERIDIAN_M_PER_DEG
    south = draw(st.floats(-84.9, 84.9 - height_deg))
    scale = math.cos(math.radians(south + height_deg / 2))
    width_deg = draw(sides_m()) / (EQUATOR_M_PER_DEG * scale)
    assume(width_deg < 179.0)
    west = 180.0 - width_deg * draw(st.floats(0.01, 0.99)) if across else draw(st.floats(-180.0, 180.0 - 1e-9))
    east = west + width_deg
    return BoundingBox(west, south, east - 360.0 if east > 180.0 else east, south + height_deg)


@st.composite
def grids(draw: st.DrawFn, *, largest: int = 40, across: bool = False) -> Grid:
    """Grids over such boxes; 32 x 32 or another shape."""
    shape = draw(st.just((32, 32)) | st.tuples(st.integers(2, largest), st.integers(2, largest)))
    return Grid(draw(boxes(across=across)), shape)
