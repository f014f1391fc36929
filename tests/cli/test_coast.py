"""`--land-only` and `--sea-only`: cells, stops and legs on one side of the coast, its accuracy away from the other."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely

from sparsor.geodesy.land import packaged_land
from sparsor.geodesy.plane import LocalPlane
from sparsor.mission import read_plan
from sparsor.mission.sidecar import read_sidecar

pytestmark = pytest.mark.usefixtures("no_picture")
# West of a slanted coast with a spit is land, and an island off it.
SPIT = [(51.509, 25.2), (51.511, 25.283), (51.5195, 25.2845), (51.511, 25.286), (51.513, 25.4)]
LAND = [
    [(51.4, 25.2), *SPIT, (51.4, 25.4)],
    [(51.522, 25.291), (51.5255, 25.2912), (51.524, 25.294)],
]
ACCURACY_M = 45.0
OFF_DOHA = ("51.5", "25.15", "51.8", "25.42")


@pytest.fixture
def coast(tmp_path):
    shapes = [{"type": "Polygon", "coordinates": [[*ring, ring[0]]]} for ring in LAND]
    features = [{"type": "Feature", "geometry": shape, "properties": {}} for shape in shapes]
    path = tmp_path / "coast.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def stop_legs(plan):
    places = [(stop.lon_deg, stop.lat_deg) for stop in plan.stops]
    return [
        shapely.LineString(LocalPlane(51.515, 25.285).metres(*np.linspace(*leg, 200).T)) for leg in pairwise(places)
    ]


@pytest.mark.parametrize(
    ("side", "options"),
    [
        ("sea", ("--home", 51.505, 25.285)),
        ("land", ("--planner", "monte-carlo", "--budget", "12%")),
        ("sea", ("--vehicle", "boat", "--keep-out", Path(__file__).parents[2] / "geo" / "keep-out-example.geojson")),
    ],
)
def test_nothing_comes_near_the_other_side(console, tmp_path, coast, side, options):
    words = ("--name", "m", f"--{side}-only", "--coastline", coast, "--coastline-accuracy", ACCURACY_M, "--json")
    ran = console.mission(*words, *options, iterations=200)
    assert ran.code == 0, ran.err
    plane = LocalPlane(51.515, 25.285)
    land = shapely.union_all([shapely.Polygon(plane.metres(*np.transpose(ring))) for ring in LAND])
    other = land if side == "sea" else land.convex_hull.buffer(5000).difference(land)
    folder = tmp_path / "missions/m"
    plan, sidecar = read_plan(folder / "m.plan"), read_sidecar(folder / "m.npz")
    assert len(plan.stops) > 3
    assert min(other.distance(leg) for leg in stop_legs(plan)) >= ACCURACY_M - 0.1
    # The map is of the cells of that side, those too near the other among them.
    centres = shapely.points(plane.metres(*sidecar.grid.centres_deg()))
    assert sidecar.allowed.tolist() == (~shapely.intersects(other, centres)).tolist()
    near = sidecar.allowed & (shapely.distance(other, centres) < ACCURACY_M)
    assert near.any()
    assert sidecar.kept_out[near].all()
    assert not sidecar.kept_out[sidecar.stops].any()
    assert not sidecar.phi[:, ~sidecar.allowed].any()
    said = [one for one in ran.result["warnings"] if "coastline (coast.geojson) is good to 45 m" in one]
    assert len(said) == 1
    assert "It is not written as a fence" in said[0]
    if "--home" in options:
        assert any("The way from or to home passes over the land." in one for one in ran.result["warnings"])
    assert len(plan.fences) == (2 if "--keep-out" in options else 1)
    if side == "land":  # made again from its mission.toml
        before = (folder / "m.plan").read_bytes()
        (folder / "m.plan").unlink()
        again = console("generate-mission", folder / "mission.toml", "--json")
        assert again.code == 0, again.err
        assert again.result["warnings"] == ran.result["warnings"]
        assert (folder / "m.plan").read_bytes() == before


def test_the_packaged_coast_and_its_accuracy(console, tmp_path):
    ran = console.mission("--name", "m", "--sea-only", "--vehicle", "vtol", "--json", box=OFF_DOHA, iterations=100)
    assert ran.code == 0, ran.err
    folder = tmp_path / "missions/m"
    plan, sidecar = read_plan(folder / "m.plan"), read_sidecar(folder / "m.npz")
    plane = LocalPlane(51.515, 25.285)
    land = packaged_land(sidecar.grid.box, (0.05, 0.05)).polygons
    land = shapely.transform(land, lambda points: plane.metres(*points.T))
    assert min(land.distance(leg) for leg in stop_legs(plan)) >= 499.0
    assert any("GSHHG 2.3.6" in one and "good to 500 m (90 %" in one for one in ran.result["warnings"])
    assert any("Home is the first stop, which lies at sea" in one for one in ran.result["warnings"])


def test_a_coast_elsewhere_is_said(console, coast):
    coarse = ("--planner", "monte-carlo", "--coastline", coast, "--coastline-accuracy", 30)
    ran = console.mission("--name", "m", "--sea-only", *coarse, "--json", box=("51.70", "25.27", "51.73", "25.30"))
    assert ran.code == 0, ran.err
    assert any("has no land in or near the box: is it of another place?" in one for one in ran.result["warnings"])
    ran = console.mission("--name", "n", "--land-only", *coarse, box=("51.70", "25.27", "51.73", "25.30"))
    assert ran.code == 2
    assert "holds the centre of one cell at most of land 30 m or more from the sea" in ran.err


@pytest.mark.usefixtures("coast")
@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            ("--sea-only",),
            "--sea-only: the cells are 94 m wide, finer than the coastline, which is good to 500 m: give a",
        ),
        (("--land-only", "--sea-only"), "--land-only and --sea-only leave nothing to fly: give one of them"),
        (("--coastline", "coast.geojson"), "a coastline alone asks for nothing: add --land-only or --sea-only"),
        (("--sea-only", "--coastline-accuracy", 30), "the packaged one is good to 500 m"),
        (("--sea-only", "--coastline", "none.shp", "--coastline-accuracy", 30), "there is no coastline file"),
        (
            ("--sea-only", "--coastline", "coast.geojson"),
            "finer than the coastline, which is good to 500 m: give a better",
        ),
        (
            ("--sea-only", "--coastline", "coast.geojson", "--coastline-accuracy", 0),
            "--coastline-accuracy: Input should",
        ),
    ],
)
def test_what_cannot_be_is_said(console, options, sentence):
    ran = console.mission("--name", "m", *options)
    assert ran.code == 2
    assert sentence in ran.said
    assert not Path("missions").exists()


def test_a_mission_s_side_can_be_changed(coast):
    from sparsor.mission.specification import changed, specification

    asked = {"name": "m", "area": {"bbox": (51.5, 25.27, 51.53, 25.3)}, "coast": {"side": "sea", "file": coast}}
    spec = specification(asked, base=Path("/"))
    assert coast in spec.inputs
    other = changed(spec, {"coast": {"side": "land", "file": None}}, base=Path("/"))
    assert (other.coast.side, other.coast.file) == ("land", coast)
