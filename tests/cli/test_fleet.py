"""Several homes, several vehicles at once."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sparsor.journeys.flown import mission_of_folder
from sparsor.journeys.practising import PracticeRequest, prepare_practice
from sparsor.mission import read_plan, time_plan
from sparsor.mission.sidecar import read_sidecar
from sparsor.vehicle import load_vehicle

pytestmark = pytest.mark.usefixtures("no_picture")
SOUTH = ("--home", 51.504, 25.2695)
NORTH = ("--home", 51.52, 25.302)
QUAD = load_vehicle("quad")


def home_of(path):
    home = read_plan(Path(path)).home
    return home.lon_deg, home.lat_deg


def test_one_flight_has_the_better_home(console):
    words = ("--name", "m", "--budget", "5km", "--json", "--force")
    alone = {home: console.mission(*words, *home).result["flight_time_s"] for home in (SOUTH, NORTH)}
    best = min(alone, key=alone.get)
    worse = NORTH if best is SOUTH else SOUTH
    ran = console.mission(*words, *worse, *best)
    assert ran.code == 0, ran.err
    assert ran.result["flight_time_s"] == alone[best]
    assert home_of(ran.result["plans"][0]) == best[1:]


def test_each_sortie_has_one_of_the_homes_and_the_mission_is_made_again(console, tmp_path):
    words = ("--name", "m", "--budget", "22km", "--planner", "monte-carlo", "--json", *SOUTH)
    ran = console.mission(*words, *NORTH)
    assert ran.code == 0, ran.err
    result = ran.result
    assert result["sorties"] > 1
    assert {home_of(path) for path in result["plans"]} == {SOUTH[1:], NORTH[1:]}
    assert all(time_plan(read_plan(Path(path)), QUAD).used_s <= 1680.0 for path in result["plans"])
    before = [Path(path).read_bytes() for path in result["plans"]]
    folder = tmp_path / "missions/m"
    assert console("sparsor", "check", folder).code == 0
    assert mission_of_folder(folder).warnings == ()
    again = console("generate-mission", folder / "mission.toml", "--json")
    assert again.code == 0, again.err
    assert [Path(path).read_bytes() for path in again.result["plans"]] == before


@pytest.mark.parametrize("homes", [SOUTH, (*SOUTH, *NORTH)])
def test_vehicles_at_once_are_apart_and_check_says_so(console, tmp_path, homes):
    words = ("--name", "m", "--vehicles", 2, "--separation", 12, "--budget", "10km", "--json", *homes)
    ran = console.mission(*words)
    assert ran.code == 0, ran.err
    result, folder = ran.result, tmp_path / "missions/m"
    assert (result["flyable"], result["sorties"], result["vehicles"]) == (True, 2, 2)
    plans = [read_plan(Path(path)) for path in result["plans"]]
    assert sorted(plan.stops[0].altitude_m for plan in plans) == [50.0, 62.0]
    assert result["vehicles_apart_m"] >= 12.0
    assert len({home_of(path) for path in result["plans"]}) == 2
    if len(homes) > 3:
        assert [home_of(path) for path in result["plans"]] == [SOUTH[1:], NORTH[1:]]  # as they were given
    assert max(time_plan(plan, QUAD).seconds for plan in plans) < 0.8 * result["flight_time_s"]
    assert any("RTL_ALT" in one for one in result["warnings"])
    assert sorted(mission_of_folder(folder).heights_m) == [50.0, 62.0]

    checked = console("sparsor", "check", folder, "--json")
    assert checked.code == 0, checked.out
    assert checked.result["vehicles_apart_m"] == pytest.approx(result["vehicles_apart_m"], abs=0.05)
    before = [Path(path).read_bytes() for path in result["plans"]]
    again = console("generate-mission", folder / "mission.toml")
    assert [Path(path).read_bytes() for path in result["plans"]] == before
    assert "in 2 flights at once" in again.out
    assert "2 vehicles at once, none above" in again.err

    high = max(zip(plans, result["plans"], strict=True), key=lambda pair: pair[0].stops[0].altitude_m)
    document = json.loads(Path(high[1]).read_text())
    low = min(plans, key=lambda plan: plan.stops[0].altitude_m).stops[0]
    for item in document["mission"]["items"]:
        if item["command"] == 16:
            item["params"][6] = item["Altitude"] = 55.0
    document["mission"]["items"][2]["params"][4:6] = [low.lat_deg, low.lon_deg]
    Path(high[1]).write_text(json.dumps(document))
    ran = console("sparsor", "check", folder)
    assert ran.code == 1
    assert "m-1.plan may come as near as" in ran.out


def test_vehicles_take_off_again_where_one_battery_each_is_not_enough(console, tmp_path):
    words = ("--name", "m", "--vehicles", 2, "--budget", "30km", "--iterations", 20_000, "--json", *SOUTH)
    ran = console.mission(*words)
    assert ran.code == 0, ran.err
    result, folder = ran.result, tmp_path / "missions/m"
    rounds = result["rounds"]
    assert result["flyable"]
    assert rounds == [1, 1, 2, 2]
    plans = [read_plan(Path(path)) for path in result["plans"]]
    assert all(time_plan(plan, QUAD).used_s <= 1680.0 for plan in plans)
    assert len({home_of(path) for path in result["plans"]}) == 2
    assert result["vehicle_of_each"] == [1, 2, 1, 2]
    assert home_of(result["plans"][0]) == home_of(result["plans"][2]) != home_of(result["plans"][1])
    heights = [plan.stops[0].altitude_m for plan in plans]
    assert heights[:2] == heights[2:]
    said = next(one for one in result["warnings"] if "vehicles at once" in one)
    assert "2 vehicles at once, 4 flights in 2 rounds" in said
    assert f", at {heights[0]:g} m: m-1.plan, m-3.plan. Vehicle 2 from" in said
    assert read_sidecar(folder / "m.npz").rounds == {f"m-{k}.plan": number for k, number in enumerate(rounds, start=1)}
    checked = console("sparsor", "check", folder, "--json")
    assert checked.code == 0, checked.out
    assert checked.result["vehicles_apart_m"] == pytest.approx(result["vehicles_apart_m"], abs=0.05)
    assert result["vehicles_apart_m"] >= 10.0

    for path, plan in zip(result["plans"], plans, strict=True):
        assert prepare_practice(PracticeRequest(mission=Path(path))).settings.home == plan.home

    # Plans of another round may be in the same place, those of one round may not.
    files = [Path(path) for path in result["plans"]]
    for to, of in zip(files[2:], files[:2], strict=True):
        to.write_bytes(of.read_bytes())
    ran = console("sparsor", "check", folder)
    assert "may come as near" not in ran.out
    files[1].write_bytes(files[0].read_bytes())
    ran = console("sparsor", "check", folder)
    assert ran.code == 1
    assert "m-1.plan may come as near as 0.0 m to m-2.plan when" in ran.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--vehicles 3 --altitude 105", "reach 125 m, above the ceiling of 120 m"),
        ("--vehicles 3 --home 51.5 25.27 --home 51.52 25.27", "3 vehicles and 2 homes"),
        ("--vehicles 2 --home 51.504 25.2695 --home 51.504 25.26951", "cannot be kept 10 m apart"),
        ("--vehicles 9", "--vehicles"),
        ("--vehicles 2 --no-sorties", "leave out --no-sorties"),
        ("--home 51.5 25.27 --home 51.5 25.27", "two of the homes are the same place"),
        ("--home 51.5", "given '51.5'"),
        ("--home 51.5 --name m", "given '51.5'"),
        ("--home 51.5 25.27 --home 200 25", "180"),
    ],
)
def test_what_cannot_be_is_said_in_a_sentence(console, tree, words, said):
    ran = console.mission(*words.split())
    assert ran.code == 2, ran.err
    assert said in ran.said
    assert "Traceback" not in ran.err
    assert not [path for path in tree() if path.endswith(".plan")]
