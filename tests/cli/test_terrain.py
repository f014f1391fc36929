"""`--terrain`: heights above the ground along all legs; the folder, the check and the map know it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from sparsor.mission import read_plan
from sparsor.mission.sidecar import read_sidecar
from terrains import Hills, hills, write_dem

pytestmark = pytest.mark.usefixtures("no_picture")
HILLS = hills(4, height_m=50.0)


@pytest.fixture
def dem(tmp_path: Path) -> Path:
    return write_dem(tmp_path / "dem.tif", HILLS)


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("--planner", "monte-carlo", "--autopilot", "px4", "--hold", 3, "--terrain-tolerance", 8),
        ("--vehicle", "plane", "--altitude", 70, "--budget", "6km", "--wind", 4, 320, "--home-altitude", 300),
    ],
)
def test_the_plan_the_sidecar_and_the_check_follow_the_ground(console, dem, tmp_path, options):
    ran = console.mission("--name", "m", "--terrain", dem, "--json", *options, iterations=300)
    assert ran.code == 0, ran.err
    height_m = 70 if 70 in options else 50
    tolerance_m = 8 if "--terrain-tolerance" in options else height_m / 10
    plan = read_plan(Path(ran.result["plans"][0]))
    home_m = float(HILLS.at(plan.home.lon_deg, plan.home.lat_deg))
    said = " ".join(ran.result["warnings"])
    if 300 in options:
        assert "--home-altitude is 300 m" in said
    else:
        assert plan.home.alt_amsl_m == pytest.approx(home_m, abs=0.06)
    for stop in plan.stops:
        above = stop.altitude_m + home_m - float(HILLS.at(stop.lon_deg, stop.lat_deg))
        assert above >= height_m - tolerance_m - 0.05
    over = ran.result["terrain"]
    assert over["least_m"] >= height_m - tolerance_m - 0.05
    assert over["file"] == "dem.tif"
    assert over["lowest_m"] < over["highest_m"]
    assert "Trees, buildings and wires are not in such a model" in said
    assert "failsafe return flies straight home" in said
    assert f"{plan.rally_points[0].altitude_m:g} m or more" in said
    folder = tmp_path / "missions/m"
    assert {"m.plan", "m.npz", "mission.toml", "terrain.png"} <= {path.name for path in folder.iterdir()}
    sidecar = read_sidecar(folder / "m.npz")
    assert sidecar.above_ground
    assert sidecar.way[:, 2].max() == pytest.approx(over["highest_m"], abs=0.01)
    checked = console("sparsor", "check", folder, "--json")
    assert checked.code == 0, checked.out
    assert not [one for one in checked.result["warnings"] if "common ceiling" in one]
    if "px4" not in options:
        return
    before = (folder / "m.plan").read_bytes()
    again = console("generate-mission", folder / "mission.toml", "--json")
    assert again.code == 0, again.err
    assert (folder / "m.plan").read_bytes() == before


def test_a_leg_that_was_lowered_fails_the_check(console, dem, tmp_path):
    assert console.mission("--name", "m", "--terrain", dem, "--budget", "6km").code == 0
    file = tmp_path / "missions/m/m.plan"
    document = json.loads(file.read_text())
    item = document["mission"]["items"][4]
    item["params"][6] -= 20
    item["Altitude"] -= 20
    file.write_text(json.dumps(document))
    checked = console("sparsor", "check", tmp_path / "missions/m", "--json")
    assert checked.code == 1
    legs = [one for one in checked.result["faults"] if "of the ground" in one]
    assert ["to item 5" in legs[0], "from item 5" in legs[-1]] == [True, True]
    assert any("at other heights than planned" in one for one in checked.result["warnings"])
    dem.unlink()
    gone = console("sparsor", "check", tmp_path / "missions/m", "--json")
    assert gone.code == 1
    assert any("not checked against the ground" in one for one in gone.result["faults"])


def test_anybodys_plan_is_checked(console, dem, tmp_path):
    assert console.mission("--name", "m", "--budget", "6km", "--altitude", 30).code == 0
    (tmp_path / "missions/m/m.plan").rename(tmp_path / "flat.plan")
    plan = read_plan(tmp_path / "flat.plan")
    home_m = float(HILLS.at(plan.home.lon_deg, plan.home.lat_deg))
    least_m = min(stop.altitude_m + home_m - float(HILLS.at(stop.lon_deg, stop.lat_deg)) for stop in plan.stops)
    assert console("sparsor", "check", "flat.plan").code == 0
    assert console("sparsor", "check", "flat.plan", "--terrain", dem, "--clearance", max(least_m + 1, 0)).code == 1
    nowhere = console("sparsor", "check", "flat.plan", "--terrain", "none.tif")
    assert (nowhere.code, "no terrain file" in nowhere.err) == (2, True)
    alone = console("sparsor", "check", "flat.plan", "--clearance", 10)
    assert (alone.code, "give --terrain" in alone.err) == (2, True)


REFUSED = [
    (("--terrain-tolerance", 5), "only makes sense with --terrain"),
    (("--terrain", "none.tif"), "there is no terrain file"),
    (("--terrain", "dem.tif", "--terrain-tolerance", 50), "has to be below the height"),
    (("--terrain", "dem.tif", "--terrain-tolerance", 0), "greater than 0"),
    (("--terrain", "dem.tif", "--vehicle", "boat"), "a boat stays on the ground"),
    (("--terrain", "elsewhere.tif"), "does not cover the flight"),
    (("--terrain", "gap.tif"), "does not know the ground"),
]


@pytest.mark.usefixtures("dem")
@pytest.mark.parametrize(("options", "words"), REFUSED)
def test_what_cannot_be_followed_is_refused(console, tmp_path, options, words):
    write_dem(tmp_path / "elsewhere.tif", HILLS, crs="EPSG:32639")
    gap = HILLS.heights_m.copy()
    gap[::3, ::3] = -9999
    write_dem(tmp_path / "gap.tif", Hills(gap), nodata=-9999)
    ran = console.mission("--name", "m", *options)
    assert (ran.code, words in ran.said) == (2, True), ran.err
    assert not (tmp_path / "missions").exists()


def test_sorties_follow_the_ground_too(console, dem, tmp_path):
    ran = console.mission(
        "--name", "m", "--terrain", dem, "--budget", "22km", "--sorties", "--json", "--home", 51.504, 25.2815,
        iterations=100,
    )  # fmt: skip
    assert ran.code == 0, ran.err
    assert ran.result["sorties"] > 1
    assert ran.result["terrain"]["least_m"] >= 45 - 0.05
    assert console("sparsor", "check", tmp_path / "missions/m").code == 0
    sidecar = read_sidecar(tmp_path / "missions/m/m.npz")
    waypoints = [item for path in ran.result["plans"] for item in read_plan(Path(path)).items if item.command == 16]
    assert len(sidecar.way) == len(waypoints)


def test_sorties_from_homes_at_different_heights(console, dem, tmp_path):
    homes = [(51.495, 25.265), (51.536, 25.306)]  # the second outside of the box and what lies round it
    ran = console.mission(
        "--name", "m", "--terrain", dem, "--budget", "25km", "--json",
        *(word for home in homes for word in ("--home", *home)), iterations=100,
    )  # fmt: skip
    assert ran.code == 0, ran.err
    plans = [read_plan(Path(path)) for path in ran.result["plans"]]
    over, said = ran.result["terrain"], " ".join(ran.result["warnings"])
    places = dict.fromkeys((plan.home.lon_deg, plan.home.lat_deg) for plan in plans)
    assert len(places) == 2
    assert over["homes_m"] == pytest.approx([float(HILLS.at(*place)) for place in places], abs=0.01)
    rally_m = max(plan.rally_points[0].altitude_m for plan in plans)
    assert over["return_m"] == rally_m
    assert f"{rally_m:g} m or more, as the highest rally point" in said
    assert "take off from the home of the plan that is flown" in said
    up_m = [item.altitude_m for plan in plans for item in plan.items if item.command == 16]
    assert over["highest_m"] == pytest.approx(max(up_m), abs=0.01)
    way = read_sidecar(tmp_path / "missions/m/m.npz").way
    assert way[~np.isnan(way[:, 0]), 2].tolist() == up_m
    assert np.isnan(way[:, 0]).any()
    assert console("sparsor", "check", tmp_path / "missions/m").code == 0


def test_the_ground_is_read_where_a_way_past_a_keep_out_leaves_the_box(console, dem, tmp_path):
    wall = [[51.49, 25.25], [51.497, 25.25], [51.497, 25.315], [51.49, 25.315], [51.49, 25.25]]
    area = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [wall]}}
    (tmp_path / "wall.geojson").write_text(json.dumps(area))
    ran = console.mission(
        "--name", "m", "--terrain", dem, "--budget", "8km", "--keep-out", "wall.geojson", "--home", 51.485, 25.285,
    )  # fmt: skip
    assert ran.code == 0, ran.err


def test_what_the_climbs_take_beyond_a_budget_of_time_is_told(console, tmp_path):
    steep = write_dem(tmp_path / "steep.tif", hills(8, height_m=220.0))
    words = ("--terrain", steep, "--altitude", 130, "--budget", "14min", "--json")
    ran = console.mission("--name", "m", *words, iterations=100)
    assert ran.code == 0, ran.err
    assert ran.result["flight_time_s"] > 14 * 60
    assert any("Climbing and sinking over the ground take longer" in one for one in ran.result["warnings"])
    said = [one for one in ran.result["warnings"] if "the ceiling of 120 m" in one]
    assert ["m above the ground, beyond" in one for one in said] == [True] * 2
