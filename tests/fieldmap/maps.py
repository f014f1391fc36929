"""A map and its samples, made up, for the tests of the files."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from sparsor.fieldmap.fieldmap import FieldMap, FlownSamples
from sparsor.geodesy import BoundingBox, Grid

BOX = (51.50, 25.27, 51.53, 25.30)
ACROSS = (179.9, -17.0, -179.9, -16.8)
NAME = 'doha <b> & "co"'


def example_map(box: tuple[float, float, float, float] = BOX, *, factor: int = 1, **changes: Any) -> FieldMap:
    """Return a map whose values tell where they lie: a thousand a row, one a column."""
    grid = Grid(BoundingBox(*box), (20, 30))
    row, column = np.divmod(np.arange(grid.size), grid.shape[1])
    allowed = column < 28
    finer = None
    if factor > 1:
        fine = np.arange(grid.size * factor**2)
        fine_row, fine_column = np.divmod(fine, grid.shape[1] * factor)
        finer = 1000.0 * fine_row + fine_column
    made = FieldMap(
        name=NAME,
        quantity="NO2",
        unit="ug/m3",
        grid=grid,
        values=1000.0 * row + column,
        standard_deviation=1.0 + row / 10,
        measured=(row + column) % 3 == 0,
        allowed=allowed,
        decoder="kriging",
        facts={"mission": NAME, "logs": "flight.tlog, sha256 0123456789abcdef", "decoder": "kriging"},
        finer=finer,
    )
    return replace(made, **changes)


def example_samples(box: tuple[float, float, float, float] = BOX, count: int = 60) -> FlownSamples:
    """Return samples along a diagonal of the box; some were left out, in two boots."""
    grid = Grid(BoundingBox(*box), (count, count))
    lon_deg, lat_deg = grid.centres_deg(np.arange(count) * (count + 1))
    boot = (np.arange(count) >= count * 2 // 3).astype(np.int64)
    reason = np.full(count, "", dtype="<U40")
    reason[5:8] = "spike <i>"
    reason[-2:] = "frozen"
    return FlownSamples(
        time_s=10.0 * np.arange(count) - 50.0 * boot,
        lon_deg=lon_deg,
        lat_deg=lat_deg,
        alt_m=np.where(np.arange(count) == 3, np.nan, 60.0),
        value=20.0 + np.sin(np.arange(count) / 7),
        air=20.0 + np.sin(np.arange(count) / 7),
        clock=np.full(count, "vehicle"),
        boot=boot,
        unix_s=1.7e9 + 10.0 * np.arange(count),
        reason=reason,
    )
