"""`--trigger`: in the plan, in mission.toml, and past the check."""

from __future__ import annotations

from pathlib import Path

import pytest

from sparsor.mission import read_plan
from sparsor.mission.specification import read_specification

pytestmark = pytest.mark.usefixtures("no_picture")
SWITCHES = {181, 183, 206, 217}


def test_they_are_planned_checked_and_remembered(console, tmp_path):
    words = ("--planner", "monte-carlo", "--budget", "5km", "--trigger", "servo:9:1900:1100", "--trigger", "message:7")
    ran = console.mission("--name", "m", *words, "--json")
    assert ran.code == 0, ran.err
    plan = read_plan(Path(ran.result["plans"][0]))
    assert len(plan.stops) == ran.result["stops"]
    assert sum(item.command in SWITCHES for item in plan.items) == 4 * len(plan.stops)
    folder = tmp_path / "missions/m"
    assert read_specification(folder / "mission.toml").flight.trigger == ("servo:9:1900:1100", "message:7")
    assert console("sparsor", "check", folder).code == 0
    inspected = console("sparsor", "inspect", folder / "m.plan", "--json").result
    assert inspected["stops"] == ran.result["stops"]
    before = (folder / "m.plan").read_bytes()
    assert console("generate-mission", folder / "mission.toml").code == 0
    assert (folder / "m.plan").read_bytes() == before


def test_a_sortie_that_dwells_nowhere_switches_nothing(console):
    words = ("--budget", "25km", "--trigger", "relay:0", "--trigger", "camera-distance:20", "--json")
    ran = console.mission("--name", "m", *words, iterations=2000)
    assert ran.code == 0, ran.err
    plans = [read_plan(Path(path)) for path in ran.result["plans"]]
    dwelt = [sum(stop.hold_s > 0 for stop in plan.stops) for plan in plans]
    assert min(dwelt) == 0 < max(dwelt)
    assert [sum(item.command == 181 for item in plan.items) for plan in plans] == [2 * count for count in dwelt]
    assert [sum(item.command == 206 for item in plan.items) for plan in plans] == [2] * len(plans)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--trigger", "pump"), "a trigger 'pump'; allowed are servo:CHANNEL"),
        (("--trigger", "relay:1", "--autopilot", "px4"), "PX4 refuses a mission with a relay trigger"),
        (("--trigger", "relay:1", "--planner", "monte-carlo", "--hold", 0, "--budget", "5km"), "no stop is waited at"),
    ],
)
def test_what_cannot_be_switched_is_refused(console, tmp_path, options, words):
    ran = console.mission("--name", "m", *options)
    assert (ran.code, words in ran.said) == (2, True), ran.err
    assert not (tmp_path / "missions").exists()
