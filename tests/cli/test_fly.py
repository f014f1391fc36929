"""`sparsor fly` and `upload-mission --start` as people type them: questions, Ctrl-C, exit codes, one JSON object."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time

import pytest
import typer
from typer.testing import CliRunner

from link.bad_link import BadLink
from link.flight_rig import practice, short_plan, url_of
from mission_strategies import KNOWN_HOME, example_plan
from sparsor.cli.fly import fly
from sparsor.cli.upload import upload
from sparsor.mission import Home, plan_bytes

PROGRAM = "import sys, typer; from sparsor.cli.{0} import {0}; typer.run({0})"
WAIT_S = 90.0


def run(command, *words):
    app = typer.Typer()
    app.command()(command)
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture(autouse=True)
def heartbeats_are_quick(monkeypatch):
    monkeypatch.setattr("sparsor.link.vehicles.OTHERS_S", 0.3)
    monkeypatch.setattr("sparsor.link.flights.flying.SETTLE_S", 0.4)
    monkeypatch.setattr("sparsor.link.missions.checks.POSITION_S", 0.3)


@pytest.fixture
def mission(tmp_path):
    folder = tmp_path / "doha"
    folder.mkdir()
    (folder / "doha.plan").write_bytes(plan_bytes(short_plan()))
    return folder


def test_a_flight_is_one_json_object_and_a_recording_in_the_folder(mission):
    with practice() as server:
        ran = run(fly, mission, "--connect", url_of(server), "--yes", "--enable-fence", "--json")
    assert ran.exit_code == 0, ran.output
    result = json.loads(ran.stdout)
    assert re.fullmatch(r"doha-\d{8}-\d{6}\.tlog", os.path.basename(result["tlog"]))  # noqa: PTH119
    assert sorted(path.suffix for path in mission.iterdir()) == [".plan", ".tlog"]
    assert (result["complete"], result["reached"], result["missed"], result["warnings"]) == (True, 5, [], [])
    assert result["fence_enforced"]
    assert result["samples"] > 0.9 * result["seconds"] > 30
    assert "item 3 of 8 reached" in ran.stderr


def test_a_flight_in_a_table_and_in_one_word(mission):
    with practice() as server:
        ran = run(fly, mission, "--connect", url_of(server), "--yes", "-q")
        assert ran.exit_code == 0
        assert ran.stdout.strip().endswith(".tlog")
        assert not ran.stderr
    with practice() as server:
        ran = run(fly, mission, "--connect", url_of(server), "--yes", "-o", mission / "two.tlog")
    assert re.search(r"outcome +complete", ran.stdout)
    assert ran.stderr.index("battery: 100 %") < ran.stderr.index("\narmed\n")
    assert ran.stderr.index("\nlanded\n") < ran.stderr.index("\ndisarmed\n")
    assert f"reconstruct-map {mission / 'two.tlog'} --plan {mission / 'doha.plan'} --bbox W S E N" in ran.stdout
    assert re.search(r"waypoints +5 reached", ran.stdout)


def test_without_a_terminal_it_starts_only_with_yes(mission):
    for command, more in ((fly, ()), (upload, ("--start",))):
        ran = run(command, mission, "--connect", "udpout://127.0.0.1:9", *more)
        assert ran.exit_code == 2
        assert "--yes" in ran.stderr


def test_an_upload_starts_when_it_is_asked_to(mission):
    with practice(speedup=10) as server:
        ran = run(upload, mission, "--connect", url_of(server), "--start", "--yes", "--json")
        assert ran.exit_code == 0, ran.output
        assert json.loads(ran.stdout)["started"] is True
        assert server.autopilot.flight.armed
        ran = run(upload, mission, "--connect", url_of(server), "--json")
        assert ran.exit_code == 2
        refused = json.loads(ran.stdout)
        assert "armed" in refused["error"]
        assert refused["vehicle_state"] == "unchanged"
    ran = run(upload, mission, "--connect", "udpout://127.0.0.1:9", "--start", "--yes", "--dry-run")
    assert ran.exit_code == 2
    assert "dry run" in ran.stderr


def test_a_failure_is_one_json_object_too(mission):
    with practice(speedup=10, ready_s=3000) as server:
        ran = run(fly, mission, "--connect", url_of(server), "--yes", "--json", "--ready-timeout", "1")
    assert ran.exit_code == 1
    failed = json.loads(ran.stdout)
    assert "PreArm" in failed["error"]
    assert failed["vehicle_state"] == "disarmed, it holds the plan"
    assert failed["tlog"] in {str(path) for path in mission.iterdir()}


def test_a_ctrl_c_before_anything_is_sent_is_one_json_object_too(mission, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("sparsor.journeys.flying.find_vehicle", interrupt)
    ran = run(fly, mission, "--connect", "udpout://127.0.0.1:9", "--yes", "--json")
    assert ran.exit_code == 130
    assert json.loads(ran.stdout) == {"error": "interrupted", "vehicle_state": "unchanged"}
    assert [path.suffix for path in mission.iterdir()] == [".plan"]


def test_a_file_of_the_mission_that_is_no_plan_is_answered_with_the_folder(mission):
    (mission / "doha.npz").write_bytes(b"PK")
    for command in (upload, fly):
        ran = run(command, mission / "doha.npz", "--connect", "udpout://127.0.0.1:9", *(["--yes"] * (command is fly)))
        assert ran.exit_code == 2
        assert f"give the mission folder '{mission}'" in ran.stderr


def test_a_plan_for_another_place_is_refused_before_it_is_sent(mission):
    away = Home(KNOWN_HOME.lon_deg, KNOWN_HOME.lat_deg + 0.5, 12.5, altitude_known=True)
    (mission / "doha.plan").write_bytes(plan_bytes(example_plan(home=away)))
    with practice() as server:
        for command, more in ((fly, ()), (upload, ("--start",))):
            ran = run(command, mission, "--connect", url_of(server), "--yes", "--json", *more)
            assert ran.exit_code == 2, ran.output
            assert "home lies 55" in ran.stderr
            assert json.loads(ran.stdout)["vehicle_state"] == "unchanged"
        assert not server.autopilot.flight.armed


def test_warnings_come_before_the_motors_even_when_they_are_not_asked_about(mission):
    away = Home(KNOWN_HOME.lon_deg, KNOWN_HOME.lat_deg + 0.0108, 12.5, altitude_known=True)
    (mission / "doha.plan").write_bytes(plan_bytes(example_plan(home=away)))
    with practice(speedup=10) as server:
        ran = run(upload, mission, "--connect", url_of(server), "--start", "--yes", "-q")
        assert ran.exit_code == 0, ran.output
    assert ran.stderr.count("home lies 1.2 km") == 1


def test_a_fence_that_is_not_enforced_is_said(mission):
    with practice() as server:
        ran = run(upload, mission, "--connect", url_of(server))
    assert ran.exit_code == 0
    assert re.search(r"NOT enforced.*--enable-fence", " ".join(ran.stdout.split()))


def test_a_home_far_from_the_vehicle_is_said(mission):
    away = Home(KNOWN_HOME.lon_deg, KNOWN_HOME.lat_deg + 0.0108, 12.5, altitude_known=True)
    plan = mission / "doha.plan"
    plan.write_bytes(plan_bytes(example_plan(home=away)))
    with practice() as server:
        ran = run(upload, plan, "--connect", url_of(server), "--dry-run", "--json")
    assert "The plan's home lies 1.2 km from the vehicle." in json.loads(ran.stdout)["warnings"]


def wait_for(true, running=None):
    deadline_s = time.monotonic() + WAIT_S
    while not true():
        assert time.monotonic() < deadline_s
        assert running is None or running.poll() is None
        time.sleep(0.02)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for one process")
def test_a_ctrl_c_in_mid_upload_brings_the_old_plan_back(tmp_path):
    old, new = tmp_path / "old.plan", tmp_path / "new.plan"
    old.write_bytes(plan_bytes(short_plan()))
    new.write_bytes(plan_bytes(example_plan(stops=30)))
    with practice() as server, BadLink(server.udp_port, delay_s=0.05) as link:
        assert run(upload, old, "--connect", url_of(server)).exit_code == 0
        before = list(server.autopilot.store.items[0])
        counted, receive = [], server.autopilot.receive

        def heard(message, peer, now_s):
            counted.append(message.get_type())
            return receive(message, peer, now_s)

        server.autopilot.receive = heard
        words = [sys.executable, "-c", PROGRAM.format("upload"), str(new), "--connect", link.url, "--json"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
            try:
                wait_for(lambda: counted.count("MISSION_ITEM_INT") > 5, running)
                running.send_signal(signal.SIGINT)
                out, err = running.communicate(timeout=WAIT_S)
            finally:
                running.kill()
        assert running.returncode == 130, out + err
        assert "it holds its old plan again" in err
        assert json.loads(out)["vehicle_state"] == "it holds its old plan again"
        assert [(item.command, item.x, item.y) for item in server.autopilot.store.items[0]] == [
            (item.command, item.x, item.y) for item in before
        ]


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="there are no pseudo-terminals here")
@pytest.mark.parametrize(
    ("answer", "code", "end"), [(b"r\n", 1, "returned early"), (b"k\n", 130, "flies on by itself")]
)
def test_a_ctrl_c_in_flight_asks_on_the_terminal(answer, code, end, mission):
    main, other = os.openpty()
    with practice(speedup=10) as server:
        words = [sys.executable, "-c", PROGRAM.format("fly"), str(mission), "--connect", url_of(server)]
        environment = {**os.environ, "COLUMNS": "200", "TERM": "xterm"}
        seen = b""

        def until(words):
            nonlocal seen
            deadline_s = time.monotonic() + WAIT_S
            while words not in seen:
                assert time.monotonic() < deadline_s, seen.decode()
                seen += os.read(main, 65_536)
            seen = seen.partition(words)[2]

        with subprocess.Popen(words, stdin=other, stdout=other, stderr=other, env=environment) as running:
            os.close(other)
            try:
                until(b"arm and start?")
                os.write(main, b"y\n")
                until(b"item 3 of 8 reached")
                running.send_signal(signal.SIGINT)
                until(b"go on watching (c)?")
                os.write(main, answer)
                until(end.encode())
                wait_for(lambda: running.poll() is not None)
            finally:
                running.kill()
        os.close(main)
        assert running.returncode == code
        assert server.autopilot.flight.armed is (code == 130)
