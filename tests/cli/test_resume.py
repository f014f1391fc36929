"""`generate-mission --resume`: what was flown is kept, the rest is planned anew within what is left of the budget."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from sparsor.design import parse_budget
from sparsor.geodesy.lengths import distance_m
from sparsor.mission import read_plan
from sparsor.mission.sidecar import read_sidecar

pytestmark = pytest.mark.usefixtures("no_picture")
SPEED_M_S, HEIGHT_M, BEGIN_S = 10.0, 50.0, 1.7e9
BOX = (51.50, 25.27, 51.53, 25.30)
SOON = ("--iterations", 30)


def flight(plan, path, *, part=1.0, begin_s=BEGIN_S, east_deg=0.0):
    """A table of what a vehicle samples that flies over a plan's stops, up to where the log ends."""
    stops = np.array([[stop.lon_deg, stop.lat_deg] for stop in read_plan(plan).stops])
    legs_m = distance_m(stops[:-1, 0], stops[:-1, 1], stops[1:, 0], stops[1:, 1])
    at_m = np.concatenate(([0.0], np.cumsum(legs_m)))
    along_m = np.arange(0.0, part * at_m[-1], SPEED_M_S)
    lon, lat = (np.interp(along_m, at_m, stops[:, k]) for k in (0, 1))
    east, north = (lon - 51.52) / 0.01, (lat - 25.28) / 0.01
    value = 20 + 30 * np.exp(-(east**2 + north**2) / 2) + np.random.default_rng(3).standard_normal(lon.size)
    height_m = np.full(lon.size, HEIGHT_M)
    rows = np.column_stack((begin_s + along_m / SPEED_M_S, lon + east_deg, lat, 10 + height_m, height_m, value))
    header = "time_s,lon_deg,lat_deg,alt_m,height_m,NO2"
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.8f")
    return path


@pytest.fixture(scope="module")
def made(tmp_path_factory, cache):
    """A mission of the refined search, one of Algorithm 1, a log of 40 % of each, and what resumes the first."""
    from sparsor.journeys.folder import write_mission
    from sparsor.journeys.planning import plan_mission
    from sparsor.journeys.resuming import resumed_specification
    from sparsor.mission.specification import specification

    base = tmp_path_factory.mktemp("flown")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SPARSOR_CACHE_DIR", str(cache))
        for name, search in (("doha", {"iterations": 400}), ("paper", {"planner": "monte-carlo", "iterations": 30})):
            asked = {"name": name, "area": {"bbox": BOX}, "search": search, "sensor": {"t90_s": 0.0}}
            write_mission(plan_mission(specification(asked, base=base)), base / "missions" / name, preview=False)
            flight(base / "missions" / name / f"{name}.plan", base / f"{name}.csv", part=0.4)
        soon = {"search": {"iterations": 30}}
        spec, _ = resumed_specification(base / "missions" / "doha", (base / "doha.csv",), soon, base=base)
        # By its specification alone, as its mission.toml makes it again.
        write_mission(plan_mission(spec), base / "missions" / "doha-2", preview=False)
    return base


@pytest.fixture
def here(console, made, tmp_path):
    """The same in the test's own folder, which is the working one."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return console


def resumed(console, *options, log="doha.csv", mission="missions/doha", code=0):
    ran = console("generate-mission", "--resume", log, "--mission", mission, *SOON, "--json", *options)
    assert ran.code == code, ran.err
    return ran.result


def test_what_is_left_is_planned_beside_the_old_mission(here, tree):
    before = tree()
    result = resumed(here)
    assert result["plans"] == ["missions/doha-2/doha-2.plan"]
    # The old folder is as it was, and the new one the same as by its mission.toml.
    assert {name: content for name, content in tree().items() if name in before} == before
    old, new = read_sidecar(Path("missions/doha/doha.npz")), read_sidecar(Path("missions/doha-2/doha-2.npz"))
    total_m = 0.1 * old.grid.full_coverage_m(old.allowed)
    told = result["resumed"]
    left_m = parse_budget(told["budget"]).value
    assert told["path_length_m"] + left_m == pytest.approx(total_m, abs=0.1)
    assert result["path_length_m"] <= left_m
    lon, lat = old.grid.centres_deg(old.stops)
    route_m = distance_m(lon[:-1], lat[:-1], lon[1:], lat[1:]).sum()
    assert told["path_length_m"] == pytest.approx(0.4 * route_m, abs=1.5 * old.grid.box.north_m / 32)
    # Home stays where it was; the map is of all that was and will be flown over.
    assert new.home[:2] == pytest.approx(old.home[:2], abs=1e-7)
    assert set(new.flown.tolist()) < set(old.stops.tolist())
    assert new.phi.any(axis=0).sum() > max(told["cells_measured"], result["cells_flown_over"])
    inspected = here("sparsor", "inspect", "missions/doha-2/doha-2.npz")
    assert f"{new.flown.size} more were measured by the flights that it resumes" in inspected.out
    document = tomllib.loads(Path("missions/doha-2/mission.toml").read_text(encoding="utf-8"))
    assert document["resume"] == {"mission": "../doha", "logs": ["../../doha.csv"]}


def test_the_logs_of_both_flights_give_one_map_with_no_stop_missed(here):
    flight(Path("missions/doha-2/doha-2.plan"), Path("later.csv"), begin_s=BEGIN_S + 3000)
    before = read_sidecar(Path("missions/doha-2/doha-2.npz")).flown
    command = ("reconstruct-map", "--mission", "missions/doha-2", "--decoder", "mmse", "--json", "-o", "m.csv")
    ran = here(*command, "doha.csv", "later.csv")
    assert ran.code == 0, ran.err
    assert (ran.result["cells_missed"], ran.result["missed_stops"]) == (0, [])
    alone = here(*command, "later.csv", "--force")
    assert 0 < alone.result["cells_missed"] <= before.size
    assert ran.result["cells_measured"] > alone.result["cells_measured"]
    assert any("'doha-2' resumes: give their logs too" in one for one in alone.result["warnings"])


def test_a_resumed_mission_can_be_resumed_itself(here):
    first = tomllib.loads(Path("missions/doha-2/mission.toml").read_text(encoding="utf-8"))
    flight(Path("missions/doha-2/doha-2.plan"), Path("later.csv"), part=0.5, begin_s=BEGIN_S + 3000)
    second = resumed(here, log="later.csv", mission="missions/doha-2")
    assert second["plans"] == ["missions/doha-3/doha-3.plan"]
    told = second["resumed"]
    assert told["logs"][-1].endswith("later.csv")
    assert len(told["logs"]) == 2
    left_m = parse_budget(told["budget"]).value
    assert told["path_length_m"] + left_m == pytest.approx(parse_budget(first["search"]["budget"]).value, abs=0.1)
    refused = here("generate-mission", "--resume", "doha.csv", "--mission", "missions/doha-2")
    assert refused.code == 2
    assert "give the log of its own flight" in refused.said


def test_a_mission_of_algorithm_1_goes_on_by_the_refined_search_with_the_budget_given(here):
    result = resumed(here, "--name", "rest", "--budget", "2km", log="paper.csv", mission="missions/paper")
    assert (result["planner"], result["plans"]) == ("refined", ["missions/rest/rest.plan"])
    assert result["resumed"]["stops_measured"] > 1
    assert result["resumed"]["budget"] == "2km"
    assert result["path_length_m"] <= 2000


def test_a_budget_of_time_is_less_what_was_in_the_air(here):
    toml = Path("missions/doha/mission.toml")
    toml.write_text(re.sub(r'budget = ".*"', 'budget = "25min"', toml.read_text(encoding="utf-8")), encoding="utf-8")
    result = resumed(here, "-o", "rest")
    assert parse_budget(result["resumed"]["budget"]).value == pytest.approx(1500 - result["resumed"]["air_time_s"])
    assert result["flight_time_s"] <= 1500 - result["resumed"]["air_time_s"]
    assert result["plans"] == ["rest/rest.plan"]


def test_sorties_that_were_all_flown_leave_nothing(here):
    box = ("--bbox", *BOX, "--name", "far", "--budget", "30km", "--sorties", *SOON, "--t90", 0, "--json")
    planned = here("generate-mission", *box)
    assert planned.result["sorties"] > 1
    logs = [
        flight(Path(plan), Path(f"{number}.csv"), begin_s=BEGIN_S + 3000 * number)
        for number, plan in enumerate(planned.result["plans"])
    ]
    ran = here("generate-mission", *(word for log in logs for word in ("--resume", log)), "--mission", "missions/far")
    assert ran.code == 2
    assert "nothing is left to plan" in ran.said


def test_where_all_was_flown_nothing_is_planned(here, tree):
    flight(Path("missions/doha/doha.plan"), Path("whole.csv"))
    before = tree()
    ran = here("generate-mission", "--resume", "whole.csv", "--mission", "missions/doha")
    assert ran.code == 2
    assert "nothing is left to plan: the logs cover all" in ran.said
    toml = Path("missions/doha/mission.toml")
    text = toml.read_text(encoding="utf-8")
    toml.write_text(re.sub(r'budget = ".*"', 'budget = "2min"', text), encoding="utf-8")
    ran = here("generate-mission", "--resume", "doha.csv", "--mission", "missions/doha")
    assert ran.code == 2
    assert "nothing is left of the budget of mission 'doha'" in ran.said
    toml.write_text(text, encoding="utf-8")
    assert tree() == before


def test_a_budget_in_per_cent_is_of_what_may_be_flown_to(here):
    keep_out = Path(__file__).parents[2] / "geo" / "keep-out-example.geojson"
    words = ("--bbox", *BOX, "--name", "past", "--keep-out", keep_out, "--t90", 0)
    assert here("generate-mission", *words, *SOON).code == 0
    flight(Path("missions/past/past.plan"), Path("past.csv"), part=0.4)
    told = resumed(here, log="past.csv", mission="missions/past")["resumed"]
    old = read_sidecar(Path("missions/past/past.npz"))
    assert old.kept_out.any()
    total_m = 0.1 * old.grid.full_coverage_m(old.allowed & ~old.kept_out)
    assert told["path_length_m"] + parse_budget(told["budget"]).value == pytest.approx(total_m, abs=0.1)
    asked = tomllib.loads(Path("missions/past-2/mission.toml").read_text(encoding="utf-8"))
    assert (
        asked["flight"]["keep_out"]
        == tomllib.loads(Path("missions/past/mission.toml").read_text(encoding="utf-8"))["flight"]["keep_out"]
    )


def test_a_keep_out_comes_to_those_of_the_mission(here):
    """One that was replaced unseen would be flown over."""
    there = Path(__file__).parents[2] / "geo" / "keep-out-example.geojson"
    crane = {"type": "Point", "coordinates": [51.52, 25.285]}
    feature = {"type": "Feature", "properties": {"radius_m": 150}, "geometry": crane}
    Path("crane.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    words = ("--bbox", *BOX, "--name", "past", "--keep-out", there, "--t90", 0)
    assert here("generate-mission", *words, *SOON).code == 0
    flight(Path("missions/past/past.plan"), Path("past.csv"), part=0.4)
    result = resumed(here, "--keep-out", "crane.geojson", "--keep-out", there, log="past.csv", mission="missions/past")
    asked = tomllib.loads(Path("missions/past-2/mission.toml").read_text(encoding="utf-8"))["flight"]["keep_out"]
    assert [Path("missions/past-2", path).resolve() for path in asked] == [there, Path("crane.geojson").resolve()]
    more = result["cells_kept_out"]
    assert more > read_sidecar(Path("missions/past/past.npz")).kept_out.sum() > 0
    # And of a mission.toml that is planned again.
    again = here(
        "generate-mission", "missions/past/mission.toml", "--keep-out", "crane.geojson", "-o", "again", "--json"
    )
    assert again.code == 0, again.err
    assert again.result["cells_kept_out"] == more


def test_several_homes_in_the_place_of_the_first_stop(here):
    result = resumed(here, "--home", 51.504, 25.2815, "--home", 51.52, 25.275, "-o", "rest")
    assert result["plans"] == ["rest/rest.plan"]
    asked = tomllib.loads(Path("rest/mission.toml").read_text(encoding="utf-8"))
    assert asked["flight"]["homes"] == [[51.504, 25.2815], [51.52, 25.275]]


MISTAKES = {
    "no mission": ("--resume doha.csv", "give its folder (--mission DIR)"),
    "no log": ("--mission missions/doha", "--mission only makes sense with --resume LOG"),
    "a sensor without a log": ("--bbox 51.5 25.27 51.53 25.3 --sensor CO", "--sensor only makes sense with --resume"),
    "a box": ("--resume doha.csv --mission missions/doha --bbox 51.5 25.27 51.53 25.3", "--bbox: not with a mission"),
    "a field and more": (
        "--resume doha.csv --mission missions/doha --field f.tif --altitude 30 --rows 9 --pareto",
        "--field, --rows, --altitude, --pareto: not with a mission",
    ),
    "a coast": ("--resume doha.csv --mission missions/doha --sea-only", "--sea-only: not with a mission"),
    "a terrain": ("--resume doha.csv --mission missions/doha --terrain dem.tif", "--terrain: not with a mission"),
    "the other planner": (
        "--resume doha.csv --mission missions/doha --planner monte-carlo",
        "--planner: not with a mission",
    ),
    "a mission.toml": ("missions/doha/mission.toml --resume doha.csv --mission missions/doha", "leave 'missions/doha/"),
    "no such log": ("--resume nope.csv --mission missions/doha", "cannot read"),
    "no such folder": ("--resume doha.csv --mission missions/nope", "'missions/nope' does not exist"),
    "a log of elsewhere": ("--resume elsewhere.csv --mission missions/doha", "give the mission that was flown"),
    "no such sensor": ("--resume doha.csv --mission missions/doha --sensor CO", "NO2@1/1"),
    "a log of one cell": ("--resume short.csv --mission missions/doha", "at least 2 measurements"),
    "over the old mission": ("--resume doha.csv --mission missions/doha -o missions/doha --force", "written over"),
    "a budget too small": ("--resume doha.csv --mission missions/doha --name x --budget 10m", "no route within 10 m"),
    "over another": ("--resume doha.csv --mission missions/doha --seed 5", "holds something else already"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_what_is_wrong_is_said_and_nothing_is_written(here, tree, case):
    words, said = MISTAKES[case]
    plan = Path("missions/doha/doha.plan")
    flight(plan, Path("elsewhere.csv"), part=0.4, east_deg=1.0)
    flight(plan, Path("short.csv"), part=0.004)
    before = tree()
    ran = here("generate-mission", *words.split(), *SOON)
    assert ran.code == 2, ran.out
    assert "Traceback" not in ran.err
    assert said in ran.said
    assert tree() == before


def test_another_area_in_a_resumed_mission_s_file_is_refused(here):
    toml = Path("missions/doha-2/mission.toml")
    toml.write_text(toml.read_text(encoding="utf-8").replace("51.53", "51.54"), encoding="utf-8")
    ran = here("generate-mission", toml)
    assert ran.code == 2
    assert "the area is not that of the mission that is resumed" in ran.said
    ran = here("generate-mission", toml, "--model", "m.npz")
    assert "--model: not with a mission that is resumed" in ran.said
