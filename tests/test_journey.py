"""The whole journey on a known truth: field, plan, flight, map.

Hills of known shape are made into a GeoTIFF; a mission over ground beside it is planned from that field; the
truth is measured at the mission's stops; the map is decoded from nothing but those values and the sidecar.
"""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin
from threadpoolctl import threadpool_limits

from sparsor.cli.main import generate_mission
from sparsor.core.metrics import centred_relative_error
from sparsor.design import lasso
from sparsor.mission import read_plan
from sparsor.mission.sidecar import read_sidecar

WEST, NORTH, PIXEL_DEG, PIXELS = 51.0, 26.0, 0.01, 110
BOX = (51.40, 24.50, 51.75, 24.82)  # south of the raster: nothing there was learned
UNIT_PER_HILL, PLAIN = 40.0, 15.0


def hills():
    """Return centres (degrees), widths (degrees) and heights of the hills, over the raster and the box."""
    rng = np.random.default_rng(11)
    return rng.uniform([[50.9], [24.4], [0.07], [0.0]], [[52.2], [26.1], [0.13], [1.0]], (4, 110)).T


def truth(lon_deg, lat_deg):
    """Return the concentration at points."""
    total = np.full(np.broadcast(lon_deg, lat_deg).shape, PLAIN)
    for lon, lat, width, height in hills():
        squared = ((lon_deg - lon) * np.cos(np.radians(25.3))) ** 2 + (lat_deg - lat) ** 2
        total += UNIT_PER_HILL * height * np.exp(-squared / (2 * width**2))
    return total


def cell_means(grid, cells):
    """Return the truth's mean over cells, from 6 x 6 points in each."""
    lon, lat = grid.centres_deg(cells)
    part = (np.arange(6) + 0.5) / 6 - 0.5
    east = part * grid.box.width_deg / grid.shape[1]
    north = part * grid.box.height_deg / grid.shape[0]
    values = truth(lon[:, None, None] + east[None, :, None], lat[:, None, None] + north[None, None, :])
    return values.mean(axis=(1, 2))


def field_file(folder):
    lon = WEST + (np.arange(PIXELS) + 0.5) * PIXEL_DEG
    lat = NORTH - (np.arange(PIXELS) + 0.5) * PIXEL_DEG
    placed = {"crs": "EPSG:4326", "transform": from_origin(WEST, NORTH, PIXEL_DEG, PIXEL_DEG)}
    size = {"height": PIXELS, "width": PIXELS, "count": 1, "dtype": "float32"}
    with rasterio.open(folder / "hills.tif", "w", driver="GTiff", **size, **placed) as dataset:
        dataset.write(truth(lon[None, :], lat[:, None]).astype(np.float32), 1)
    return folder / "hills.tif"


def run(monkeypatch, capsys, *words):
    monkeypatch.setattr(sys, "argv", ["generate-mission", *map(str, words)])
    with threadpool_limits(1), pytest.raises(SystemExit) as end:  # beside other test processes
        generate_mission()
    captured = capsys.readouterr()
    assert end.value.code == 0, captured.err
    return json.loads(captured.out)


def test_field_to_plan_to_map(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("SPARSOR_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    told = run(
        monkeypatch, capsys, "--bbox", *BOX, "--field", field_file(tmp_path), "--budget", "15%",
        "--planner", "monte-carlo", "--iterations", 100, "--name", "hills", "--json",
    )  # fmt: skip

    # What a vehicle does: it measures where the plan says.
    stops = read_plan(told["plans"][0]).stops
    sidecar = read_sidecar(tmp_path / told["sidecar"])
    grid, model = sidecar.grid, sidecar.model
    visited = grid.cell_at([stop.lon_deg for stop in stops], [stop.lat_deg for stop in stops])
    measured = np.full(grid.size, np.nan)
    measured[visited] = cell_means(grid, visited)

    # What reconstruction does: the sums of Phi, the LASSO, the field's unit.
    low, high = model.scale
    scaled = (np.nan_to_num(measured) - low) / (high - low) - model.mean
    sums = np.where(sidecar.phi, scaled, 0.0).sum(axis=1)
    assert not (sidecar.phi & np.isnan(measured)).any()  # every summand was measured
    code = lasso(sidecar.phi @ model.dictionary, sums[None], sidecar.lasso_weight)
    estimate = (code @ model.dictionary.T + model.mean) * (high - low) + low

    real = cell_means(grid, np.arange(grid.size))[None]
    error = centred_relative_error(real, estimate)[0]
    mean_alone = centred_relative_error(real, (model.mean * (high - low) + low)[None])[0]
    assert error < 2.5 * told["expected_relative_error"]  # 0.04; the ground is new, so not on the dot
    assert error < 0.2 * mean_alone
