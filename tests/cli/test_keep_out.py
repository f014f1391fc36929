"""`--keep-out`: no cell inside, no leg across, and the plan, the sidecar and the check know it."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import rasterio
import shapely

from sparsor.geodesy.lengths import distance_m
from sparsor.geodesy.plane import LocalPlane
from sparsor.mission import read_plan
from sparsor.mission.sidecar import read_sidecar

pytestmark = pytest.mark.usefixtures("no_picture")
EXAMPLE = Path(__file__).parents[2] / "geo" / "keep-out-example.geojson"
HOME = ("--home", 51.504, 25.2815)  # west of the stadium
MARGIN_M = 40.0


def nearest_m(start, end):
    """How near a leg comes to the stadium and to the rim of the mast's circle, metres."""
    stadium, mast = json.loads(EXAMPLE.read_text())["features"]
    corners = np.array(stadium["geometry"]["coordinates"][0])
    plane = LocalPlane(*corners[0])
    line = np.linspace(start, end, 400)
    path = shapely.LineString(plane.metres(*line.T))
    to_mast = distance_m(*line.T, *mast["geometry"]["coordinates"]).min() - mast["properties"]["radius_m"]
    return min(shapely.Polygon(plane.metres(*corners.T)).distance(path), to_mast)


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("--planner", "monte-carlo", "--autopilot", "px4"),
        ("--budget", "22min", "--wind", 4, 20, "--seed", 3),
        ("--vehicle", "vtol", "--budget", "9km"),
        ("--vehicle", "boat", "--budget", "5km"),
    ],
)
def test_nothing_comes_near(console, tmp_path, options):
    words = ("--name", "m", "--keep-out", EXAMPLE, "--keep-out-margin", MARGIN_M, "--json", *HOME, *options)
    ran = console.mission(*words, iterations=300)
    assert ran.code == 0, ran.err
    assert any("failsafe return flies straight" in one for one in ran.result["warnings"])
    plan = read_plan(Path(ran.result["plans"][0]))
    flown = [(plan.home.lon_deg, plan.home.lat_deg)]
    flown += [(item.lon_deg, item.lat_deg) for item in plan.items if item.has_position]
    assert all(nearest_m(*leg) >= MARGIN_M - 0.1 for leg in pairwise(flown))
    assert len(plan.fences) == 2
    assert not plan.fences[1].inclusion
    assert [round(one.radius_m) for one in plan.circles] == [150]
    folder = tmp_path / "missions/m"
    sidecar = read_sidecar(folder / "m.npz")
    assert sidecar.allowed.all()  # what is kept out of belongs to the map all the same
    assert sidecar.kept_out.any()
    assert not sidecar.kept_out[sidecar.stops].any()
    assert not sidecar.phi[:, sidecar.kept_out].any()
    assert console("sparsor", "check", folder).code == 0
    inspected = console("sparsor", "inspect", folder / "m.plan", "--json").result
    assert inspected["stops"] == ran.result["stops"]
    again = console("generate-mission", folder / "mission.toml", "--json")
    assert again.code == 0, again.err


def test_a_time_budget_counts_the_ways_past(console):
    ran = console.mission(
        "--name", "m", "--keep-out", EXAMPLE, "--budget", "15min", "--json", "--home", 51.507, 25.2805, iterations=300
    )
    assert ran.code == 0, ran.err
    assert ran.result["flight_time_s"] <= 15 * 60


def test_a_home_in_a_keep_out_is_refused(console):
    ran = console.mission("--name", "m", "--keep-out", EXAMPLE, "--home", 51.51, 25.282)
    assert ran.code == 2
    assert "lies in a keep-out (Stadium, Mast)" in ran.err


def test_several_files_and_a_missing_one(console):
    ran = console.mission("--name", "m", "--keep-out", EXAMPLE, "--keep-out", "none.kml")
    assert ran.code == 2
    assert "there is no keep-out file" in ran.err


def test_the_map_goes_on_over_what_is_kept_out_of(console, tmp_path):
    """A log of the flight: the cells inside have values, known less well than those around; the error counts them."""
    ran = console.mission("--name", "m", "--keep-out", EXAMPLE, "--json", "--t90", 0, *HOME, iterations=600)
    assert ran.code == 0, ran.err
    folder = tmp_path / "missions/m"
    sidecar = read_sidecar(folder / "m.npz")
    lon, lat = np.transpose([(stop.lon_deg, stop.lat_deg) for stop in read_plan(folder / "m.plan").stops])
    along = np.linspace(0, lon.size - 1, 1200)
    lon, lat = np.interp(along, np.arange(lon.size), lon), np.interp(along, np.arange(lon.size), lat)
    value = 30 + 20 * np.sin((lon - 51.5) * 150) + 10 * np.cos((lat - 25.27) * 120)
    rows = np.column_stack([100 + np.arange(1200.0), lon, lat, np.full(1200, 60), np.full(1200, 50), value])
    header = "time_s,lon_deg,lat_deg,alt_m,height_m,NO2"
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header=header, comments="", fmt="%.8f")
    words = ("--mission", folder, "--unit", "ppb", "--json", "-o", "map.tif")
    made = console("reconstruct-map", "log.csv", *words)
    assert made.code == 0, made.err
    with rasterio.open("map.tif") as dataset:
        values, deviation, measured = (layer.ravel() for layer in dataset.read())
    kept_out = sidecar.kept_out
    assert np.isfinite(values[kept_out]).all()
    assert measured[kept_out].sum() == 0
    assert np.median(deviation[kept_out]) > 1.5 * np.median(deviation[measured > 0])


def test_the_expected_error_counts_what_is_kept_out_of():
    from sparsor.journeys.planning import plan_prepared
    from sparsor.journeys.preparing import prepare
    from sparsor.mission.specification import specification

    asked = {
        "name": "m",
        "area": {"bbox": (51.50, 25.27, 51.53, 25.30)},
        "search": {"iterations": 60},
        "flight": {"keep_out": (EXAMPLE,)},
    }
    spec = specification(asked, base=Path("/"))
    prepared = prepare(spec)
    place, model = prepared.place, prepared.prior.model
    assert place.inside.all()
    assert 0 < (~place.allowed).sum() < 100
    planned = plan_prepared(spec, prepared)
    assert place.allowed[planned.candidate.stops].all()
    # Were the kept-out cells all noise, knowing the others as well as before would not be enough.
    rng = np.random.default_rng(0)
    noisy = model.validation.copy()
    noisy[:, ~place.allowed] += rng.normal(0, 5 * noisy.std(), (len(noisy), (~place.allowed).sum()))
    worse = replace(prepared, prior=replace(prepared.prior, model=replace(model, validation=noisy)))
    assert plan_prepared(spec, worse).expected_relative_error > 1.5 * planned.expected_relative_error
