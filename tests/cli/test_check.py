"""`sparsor check`: our plans pass, what was edited is said, faults end with 1."""

from __future__ import annotations

import json

import pytest

pytestmark = pytest.mark.usefixtures("no_picture")
HOME = ("--home", 51.4995, 25.2695)


def edit(path, change):
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("kind", ["quad", "plane", "vtol", "rover", "boat"])
def test_what_is_written_passes(console, tmp_path, kind, autopilot):
    ran = console.mission(
        "--name", "m", "--vehicle", kind, "--autopilot", autopilot, "--budget", "5km", *HOME, "--wind", 3, 320
    )
    assert ran.code == 0, ran.err
    checked = console("sparsor", "check", tmp_path / "missions/m", "--json")
    assert checked.code == 0, checked.out
    assert checked.result["faults"] == []
    assert checked.result["plans"] == [str(tmp_path / "missions/m/m.plan")]
    assert not [one for one in checked.result["warnings"] if "Edited" in one]


def test_an_edited_plan_is_told_and_what_is_wrong_with_it(console, tmp_path):
    assert console.mission("--name", "m", "--budget", "5km", *HOME).code == 0
    plan = tmp_path / "missions/m/m.plan"
    assert console("sparsor", "check", plan).out.strip() == "m.plan: no fault noticed"

    def away(document):
        document["mission"]["items"][3]["params"][4:6] = [25.6, 51.9]

    edit(plan, away)
    ran = console("sparsor", "check", plan)
    assert ran.code == 1
    assert "Item 4 lies outside fence polygon 1." in ran.out
    assert "Edited since sparsor wrote it: 1 of" in ran.err
    quiet = console("sparsor", "check", plan, "-q")
    assert (quiet.code, quiet.err) == (1, "")


def test_a_study_is_a_warning_and_against_another_vehicle_a_fault(console, tmp_path):
    ran = console.mission("--name", "m", "--budget", "30km", "--no-sorties", "--json", *HOME)
    assert not ran.result["flyable"]
    checked = console("sparsor", "check", tmp_path / "missions/m", "--json")
    assert checked.code == 0
    assert any("less its reserve" in one for one in checked.result["warnings"])
    plane = console("sparsor", "check", tmp_path / "missions/m", "--vehicle", "plane")
    assert plane.code == 1
    assert "another kind of vehicle" in plane.out


def test_anybodys_plan_is_checked_without_a_vehicle(console, tmp_path):
    assert console.mission("--name", "m", "--budget", "5km", *HOME).code == 0
    alone = tmp_path / "theirs.plan"
    alone.write_bytes((tmp_path / "missions/m/m.plan").read_bytes())
    ran = console("sparsor", "check", alone, "--json")
    assert ran.code == 0
    assert "Nothing is known of the vehicle: endurance is not checked; give --vehicle." in ran.result["warnings"]


def test_a_wind_too_strong_is_refused(console):
    ran = console.mission("--name", "m", "--wind", 12, 0)
    assert ran.code == 2
    assert "cannot be flown against" in ran.err


def test_a_changed_vehicle_brings_its_own_height_and_hold(console, tmp_path):
    assert console.mission("--name", "m", "--vehicle", "boat", "--budget", "5km").code == 0
    first = (tmp_path / "missions/m/mission.toml").read_text()
    assert "altitude_m = 0.0" in first
    ran = console("generate-mission", "missions/m/mission.toml", "--vehicle", "plane", "--name", "n")
    assert ran.code == 0, ran.err
    second = (tmp_path / "missions/n/mission.toml").read_text()
    assert "altitude_m = 50.0" in second
    assert "hold_s = 0.0" in second
