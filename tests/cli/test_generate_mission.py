"""`generate-mission`: the folder it writes, what it prints, the same bytes every time."""

from __future__ import annotations

import csv
import json
import math
import re
import shutil
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sparsor.design import parse_budget
from sparsor.geodesy.areas import read_area
from sparsor.mission import describe_plan, flight_time_s, plan_faults, read_plan
from sparsor.mission.sidecar import read_sidecar
from sparsor.vehicle import load_vehicle

# design.md, Commands: the keys of generate-mission --json.
KEYS = {
    "plans", "sidecar", "stops", "cells_measured", "path_length_m", "path_length_cells", "coverage_fraction",
    "flight_time_s", "endurance_s", "flyable", "sorties", "expected_relative_error", "planner", "seed", "warnings",
}  # fmt: skip


def numbers(value):
    if isinstance(value, dict | list):
        for part in value.values() if isinstance(value, dict) else value:
            yield from numbers(part)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield value


def test_the_folder_holds_what_was_promised(console, tree):
    ran = console.mission("--name", "doha", "--export", "waypoints,kml,geojson")
    assert ran.code == 0, ran.err
    files = tree(Path("missions/doha"))
    assert set(files) == {
        "mission.toml", "doha.plan", "doha.npz", "preview.png", "doha.waypoints", "doha.kml", "doha.geojson",
    }  # fmt: skip
    assert all(files.values())
    assert files["preview.png"].startswith(b"\x89PNG\r\n\x1a\n")
    with Image.open("missions/doha/preview.png") as picture:
        assert min(picture.size) >= 600
        assert max(picture.size) <= 6000
        assert len(np.unique(np.asarray(picture.convert("L")))) > 50
    assert not plan_faults(read_plan("missions/doha/doha.plan"))
    for word in ("stops", "distance", "of full coverage", "time in the air", "endurance", "flyable", "expected error"):
        assert word in ran.out
    assert all(name in ran.out for name in files)


@pytest.mark.usefixtures("no_picture")
def test_without_a_name_the_box_names_the_mission(console):
    assert console.mission("-q").out.strip() == "missions/box_51.5_25.27_51.53_25.3/box_51.5_25.27_51.53_25.3.plan"
    assert console.mission("-q", "-o", "here/north").out.strip() == "here/north/north.plan"


def test_json_is_one_object_with_the_keys_of_the_design(console):
    ran = console.mission("--name", "doha", "--json")
    assert ran.code == 0
    result = ran.result
    assert set(result) >= KEYS
    assert all(math.isfinite(value) for value in numbers(result))
    assert result["plans"] == ["missions/doha/doha.plan"]
    assert result["sidecar"] == "missions/doha/doha.npz"
    assert all(Path(path).is_file() for path in [*result["plans"], result["sidecar"]])
    assert (result["planner"], result["seed"], result["sorties"]) == ("refined", 0, 1)


@pytest.mark.usefixtures("no_picture")
def test_the_numbers_are_those_of_the_files(console):
    result = console.mission("--name", "doha", "--hold", "2.5", "--home", "51.495", "25.28", "--json").result
    plan, sidecar = read_plan(result["plans"][0]), read_sidecar(Path(result["sidecar"]))
    quad = load_vehicle("quad")
    assert len(plan.stops) == sidecar.stops.size == result["stops"]
    assert sidecar.phi.any(axis=0).sum() == result["cells_measured"] == result["cells_flown_over"] > result["stops"]
    assert describe_plan(plan).path_length_m == pytest.approx(result["path_length_m"], abs=0.1)
    assert flight_time_s(plan, quad) == pytest.approx(result["flight_time_s"], abs=0.1)
    full_m = sidecar.grid.full_coverage_m(sidecar.allowed)
    assert result["coverage_fraction"] * full_m == pytest.approx(result["path_length_m"])
    assert result["path_length_cells"] == pytest.approx(result["coverage_fraction"] * (sidecar.grid.size - 1))
    assert result["endurance_s"] == quad.endurance_s
    assert result["flyable"] == (result["flight_time_s"] <= quad.endurance_s * (1 - quad.reserve_fraction))
    assert sidecar.expected["relative_error"] == result["expected_relative_error"]


@pytest.mark.usefixtures("no_picture")
def test_warnings_go_to_stderr(console):
    warnings = console.mission("--name", "a", "--json").result["warnings"]
    assert any("synthetic" in warning for warning in warnings)
    assert any("--home-altitude" in warning for warning in warnings)
    plain = console.mission("--name", "b")
    assert plain.err.splitlines() == [f"warning: {warning}" for warning in warnings]
    assert "warning" not in plain.out


@pytest.mark.usefixtures("no_picture")
def test_a_flight_beyond_the_endurance_is_marked_and_told_what_would_fly(console):
    ran = console.mission("--hold", "600", "--planner", "monte-carlo", "--no-sorties", "--json")
    assert ran.code == 0
    assert ran.result["flyable"] is False
    sentence = ran.result["warnings"][0]
    assert "planning study" in sentence
    assert "shorten --hold" in sentence  # dwelling alone takes longer than the endurance
    assert (
        "would fit"
        in console.mission("--budget", "30%", "--no-sorties", "--json", "--name", "long").result["warnings"][0]
    )


@pytest.mark.usefixtures("no_picture")
def test_quiet_prints_the_path_only(console):
    ran = console.mission("--name", "doha", "-q")
    assert (ran.code, ran.out) == (0, "missions/doha/doha.plan\n")
    assert "built-in" not in ran.err
    slip = console.mission("--name", "far", "-q", "--home", "25.28", "51.51")
    assert "longitude and latitude swapped?" in slip.err  # said even so


@pytest.mark.usefixtures("no_picture")
def test_verbose_tells_what_won(console):
    out = console.mission("-v", "--planner", "monte-carlo").out
    assert "theta = " in out
    assert "cost" in out


def test_the_same_bytes_for_any_number_of_workers_and_from_mission_toml(console, tree, tmp_path, monkeypatch):
    options = ("--seed", 3, "--export", "waypoints,kml,geojson", "--autopilot", "px4", "--home", 51.505, 25.275)
    for folder, workers in (("one", 1), ("three", 3)):
        ran = console.mission("--name", "m", "-o", folder, "--workers", workers, *options)
        assert ran.code == 0, ran.err
    made = tree(tmp_path / "one")
    assert len(made) == 7
    assert tree(tmp_path / "three") == made

    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    again = console("sparsor", "plan", "../one/mission.toml")
    assert again.code == 0, again.err
    assert tree(tmp_path / "one") == made
    assert tree(tmp_path / "elsewhere") == {}


@pytest.mark.usefixtures("no_picture")
def test_another_seed_is_another_plan(console):
    for seed in (0, 1):
        console.mission("--name", "m", "-o", f"seed{seed}", "--seed", seed, iterations=400)
    assert Path("seed0/m.plan").read_bytes() != Path("seed1/m.plan").read_bytes()


@pytest.mark.usefixtures("no_picture")
def test_a_folder_is_rewritten_only_for_the_same_request(console, tree):
    assert console.mission("--name", "m", "--export", "kml,geojson").code == 0
    before = tree()
    Path("missions/m/m.plan").write_text("spoilt")
    assert console.mission("--name", "m", "--export", "kml,geojson").code == 0
    assert tree() == before

    refused = console.mission("--name", "m", "--export", "kml", "--seed", 9, "--budget", "9%")
    assert refused.code == 2
    assert "'missions/m' holds something else already" in refused.err
    assert "--force" in refused.err
    assert tree() == before

    forced = console.mission("--name", "m", "--export", "kml", "--seed", 9, "--budget", "9%", "--force")
    assert forced.code == 0
    after = tree()
    assert set(before) - set(after) == {"missions/m/m.geojson"}
    assert after["missions/m/m.kml"] != before["missions/m/m.kml"]


@pytest.mark.usefixtures("no_picture")
def test_a_folder_of_somebody_else_is_left_alone(console, tree):
    Path("notes").mkdir()
    Path("notes/diary.txt").write_text("dear diary")
    before = tree()
    refused = console.mission("-o", "notes")
    assert refused.code == 2
    assert tree() == before
    assert console.mission("-o", "notes", "--force").code == 0
    assert Path("notes/diary.txt").read_text() == "dear diary"


@pytest.mark.usefixtures("no_picture")
def test_options_change_parts_of_a_mission_file(console):
    assert console.mission("--name", "m", "--altitude", 70).code == 0
    ran = console("generate-mission", "missions/m/mission.toml", "--name", "n", "--seed", 4, "-q")
    assert (ran.code, ran.out) == (0, "missions/n/n.plan\n")
    old, new = (tomllib.loads(Path(f"missions/{name}/mission.toml").read_text()) for name in "mn")
    assert new == {**old, "name": "n", "search": {**old["search"], "seed": 4}}


@pytest.mark.usefixtures("no_picture")
def test_a_budget_is_kept(console):
    free = console.mission("--name", "free", "--json", "--budget", "10%").result
    assert free["coverage_fraction"] <= 0.10
    full_km = free["path_length_m"] / free["coverage_fraction"] / 1000
    common = ("--hold", 3.2, "--json")
    distance = console.mission("--name", "km", "--budget", f"{full_km * 0.08:.3f}km", *common)
    assert distance.code == 0, distance.err
    assert distance.result["path_length_m"] <= full_km * 80 + 0.5
    for home, share in ((), 1.05), (("--home", 51.49, 25.26), 1.3):
        minutes = share * free["flight_time_s"] / 60
        time = console.mission("--budget", f"{minutes:.4f}min", "--name", f"t{len(home)}", *common, *home)
        assert time.code == 0, time.err
        assert time.result["flight_time_s"] <= minutes * 60 + 0.01  # what is written is rounded to 1e-7 degrees


@pytest.mark.usefixtures("no_picture")
@pytest.mark.parametrize("budget", ["9m", "1min"])
def test_a_budget_that_nobody_meets_names_the_shortest(console, tree, budget):
    for planner, words in (
        ("refined", "no route within .*: the shortest of two cells takes"),
        ("monte-carlo", "no route within .* among 30 samples: the shortest found is"),
    ):
        ran = console.mission("--planner", planner, "--budget", budget)
        assert ran.code == 2
        said = re.search(words + r" ([0-9.]+ (m|km|min))\.", ran.err)
        assert said, ran.err
        assert tree() == {}
        shortest = parse_budget(said[1])
        enough = f"{shortest.value * 1.1:.3f}{'s' if shortest.measure == 'time' else 'm'}"
        # It is true: a little more than that is met.
        assert console.mission("--planner", planner, "--budget", enough, "-o", f"there/{planner}").code == 0
        shutil.rmtree("there")


def test_other_budgets_are_compared_and_the_plan_stays_the_same(console):
    plain = console.mission("--name", "plain", "--json", iterations=500)
    ran = console.mission("--name", "m", "--pareto", "--json", iterations=500)
    assert ran.code == 0, ran.err
    assert Path("missions/m/m.plan").read_bytes() == Path("missions/plain/plain.plan").read_bytes()
    curve = ran.result["pareto"]
    assert [one["budget"] for one in curve] == ["4%", "6%", "8%", "10%", "13%", "17%", "22%", "30%"]
    (planned,) = (one for one in curve if one["budget"] == "10%")
    assert planned["expected_relative_error"] == plain.result["expected_relative_error"]
    for shorter, longer in pairwise(curve):
        assert shorter["path_length_m"] < longer["path_length_m"]
    assert curve[-1]["expected_relative_error"] < 0.5 * curve[0]["expected_relative_error"]
    with Path("missions/m/pareto.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["flight_time_s"]) for row in rows] == [one["flight_time_s"] for one in curve]
    with Image.open("missions/m/pareto.png") as picture:
        assert picture.size[0] == 1400
    again = console("generate-mission", "missions/m/mission.toml")  # without: what it made goes
    assert again.code == 0, again.err
    assert not Path("missions/m/pareto.csv").exists()


def test_another_budget_that_no_mission_can_be_made_for_is_left_out(console, monkeypatch):
    from sparsor.errors import MissionError
    from sparsor.journeys import pareto

    plan = pareto.plan_prepared

    def fails(spec, *rest, **more):
        if spec.search.budget not in ("10%", "8%"):
            raise MissionError("no stop is waited at")
        return plan(spec, *rest, **more)

    monkeypatch.setattr(pareto, "plan_prepared", fails)
    ran = console.mission("--name", "m", "--pareto", "--json")
    assert ran.code == 0, ran.err
    assert [one["budget"] for one in ran.result["pareto"]] == ["8%", "10%"]


def test_without_a_budget_there_is_nothing_to_compare(console, tree):
    ran = console.mission("--pareto", "--lambda-path", 0.01)
    assert (ran.code, "--budget" in ran.err) == (2, True)
    assert tree() == {}


HOUSE = [[51.50, 25.27], [51.53, 25.27], [51.53, 25.285], [51.515, 25.30], [51.50, 25.285], [51.50, 25.27]]
YARD = [[51.51, 25.275], [51.52, 25.275], [51.52, 25.28], [51.51, 25.28], [51.51, 25.275]]


@pytest.mark.usefixtures("no_picture")
def test_no_stop_lies_outside_an_area(console, tmp_path):
    import shapely

    area = tmp_path / "my house.geojson"
    area.write_text(json.dumps({"type": "Polygon", "coordinates": [HOUSE, YARD]}))
    dense = ("--probability", 0.02, "--theta", 1, "--budget", "90%")
    ran = console.mission("--area", area, "--json", "--no-sorties", *dense, box=None, iterations=4)
    assert ran.code == 0, ran.err
    assert ran.result["plans"] == ["missions/my-house/my-house.plan"]
    polygon = read_area(area).polygon
    stops = read_plan(ran.result["plans"][0]).stops
    assert len(stops) > 300  # p and theta leave few cells out: the shape is filled
    rounding = polygon.buffer(1e-7)
    assert all(rounding.covers(shapely.Point(stop.lon_deg, stop.lat_deg)) for stop in stops)
    sidecar = read_sidecar(Path(ran.result["sidecar"]))
    assert sidecar.allowed[sidecar.stops].all()
    assert not sidecar.phi[:, ~sidecar.allowed].any()
    assert not sidecar.allowed.all()

    again = console("generate-mission", "missions/my-house/mission.toml", "-q")
    assert again.code == 0, again.err
    assert tomllib.loads(Path("missions/my-house/mission.toml").read_text())["area"] == {
        "file": "../../my house.geojson"
    }


@pytest.mark.usefixtures("no_picture")
@pytest.mark.parametrize(
    ("options", "filled"),
    [
        (("--probability", 0.03, "--theta", 3), {"probability": 0.03, "theta": 3}),
        (("--lambda-path", 0.01), {"lambda_path": 0.01, "probability": 0.03, "theta": 3}),
        (("--lambda-path", 0.01, "--budget", "12%"), {"lambda_path": 0.01, "budget": "12%"}),
        (("--probability", 0.02), {"probability": 0.02, "budget": "10%"}),
    ],
)
def test_mission_toml_says_what_the_search_was_given(console, options, filled):
    ran = console.mission("--name", "m", "--json", *options)
    assert ran.code == 0, ran.err
    search = tomllib.loads(Path("missions/m/mission.toml").read_text())["search"]
    always = {"planner": "monte-carlo", "paper": False, "rows": 35, "lambda_valid": 1.0, "iterations": 30, "seed": 0}
    assert search == {**always, **filled}
    if "budget" not in filled:
        assert ran.result["coverage_fraction"] > 0.15  # about 89 cells: beyond the default budget
    assert ran.result["theta"] == filled.get("theta", ran.result["theta"])


@pytest.mark.usefixtures("no_picture")
def test_a_box_across_the_antimeridian(console):
    ran = console.mission("--json", box=("179.985", "-17.02", "-179.985", "-16.99"))
    assert ran.code == 0, ran.err
    plan = read_plan(ran.result["plans"][0])
    assert all(abs(stop.lon_deg) > 179.98 for stop in plan.stops)
    assert ran.result["path_length_m"] < 50_000


@pytest.mark.usefixtures("no_picture")
def test_the_sensor_is_told_to_whoever_rebuilds_the_map(console):
    Path("mine.toml").write_text('name = "mine"\nunit = "ug/m3"\nt90_s = 12.0\n', encoding="utf-8")
    for options, answer_s, unit in (
        ((), 30.0, "ppb"),
        (("--planner", "monte-carlo"), None, None),
        (("--t90", 20), 20.0, "ppb"),
        (("--sensor-profile", "no2"), 30.0, "ppb"),
        (("--sensor-profile", "mine.toml"), 12.0, "ug/m3"),
    ):
        assert console.mission("--name", "m", "--force", *options).code == 0
        sensor = console("sparsor", "inspect", "missions/m/m.npz", "--json").result["sensor"]
        assert (sensor and (sensor["t90_s"], sensor["unit"])) == (answer_s and (answer_s, unit))
    again = console("generate-mission", "missions/m/mission.toml", "--force")  # its path leads back to the profile
    assert again.code == 0, again.err
    both = console.mission("--name", "m", "--force", "--t90", 20, "--sensor-profile", "no2")
    assert both.code == 2
    assert "--t90" in both.said
    unknown = console.mission("--name", "m", "--force", "--sensor-profile", "nose")
    assert (unknown.code, "known are no2" in unknown.said) == (2, True)
