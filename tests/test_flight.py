"""The whole way of a mission on a vehicle, by the commands that people type: plan, upload, fly, record, download.

It runs on the practice autopilot in both flavours, and on the autopilot that SPARSOR_SITL_URL names. That one
flies in real time, so the mission is a small one round the place where the vehicle stands.
"""

from __future__ import annotations

import json
import os
import sys
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from pymavlink import mavutil
from threadpoolctl import threadpool_limits

from mission_strategies import KNOWN_HOME
from sparsor.cli import main
from sparsor.geodesy.lengths import distance_m
from sparsor.link.connection import Connection
from sparsor.link.practice import PracticeAutopilot, PracticeServer, PracticeSettings, built_in_truth, flavour_named
from sparsor.link.recorder import request_streams
from sparsor.link.vehicles import find_vehicle
from sparsor.mission import read_plan

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

COMMANDS = {"sparsor": main.main, "generate-mission": main.generate_mission, "upload-mission": main.upload_mission}
SIDE_M = 230.0  # the smallest box has 200 m
PATIENT_S = 300  # a simulator that has just been started, on a slow machine, is ready after a minute or two
ALTITUDE_M, SPEED_M_S = 20, 8
RADIUS_M = 3.0  # ArduPilot's WPNAV_RADIUS is 2 m; PX4 looks at the plan's own
POSITION = "GLOBAL_POSITION_INT"


@dataclass
class Target:
    """A vehicle to fly."""

    url: str
    autopilot: str
    practice: PracticeAutopilot | None = None

    @property
    def place(self) -> tuple[float, float]:
        """Where it stands, degrees east and north."""
        if self.practice is not None:
            return KNOWN_HOME.lon_deg, KNOWN_HOME.lat_deg
        with Connection(self.url) as connection:
            vehicle = find_vehicle(connection, None, PATIENT_S)
            assert not vehicle.armed, vehicle.words
            with connection.inbox(POSITION, system_id=vehicle.system_id) as inbox:
                deadline_s = time.monotonic() + PATIENT_S
                while time.monotonic() < deadline_s:  # it may still be waiting for its first fix
                    request_streams(connection, vehicle)
                    for found in inbox.until(time.monotonic() + 2.0):
                        if found.message.lat:
                            return found.message.lon / 1e7, found.message.lat / 1e7
        raise AssertionError("it does not say where it is")


@pytest.fixture(params=["ardupilot", "px4", pytest.param("sitl", marks=pytest.mark.sitl)])
def target(request: pytest.FixtureRequest) -> Iterator[Target]:
    if request.param == "sitl":
        autopilot = os.environ.get("SPARSOR_SITL_AUTOPILOT", "ardupilot").lower()
        yield Target(os.environ["SPARSOR_SITL_URL"], autopilot)
        return
    truth = built_in_truth(KNOWN_HOME.lon_deg, KNOWN_HOME.lat_deg)
    settings = PracticeSettings(home=KNOWN_HOME, flavour=flavour_named(request.param), truth=truth)
    with PracticeServer(PracticeAutopilot(settings), udp=("127.0.0.1", 0), speedup=20) as server:
        yield Target(f"udpout://127.0.0.1:{server.udp_port}", request.param, server.autopilot)


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Any:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SPARSOR_CACHE_DIR", str(tmp_path / "cache"))

    def command(name: str, *words: object, code: int = 0) -> dict[str, Any]:
        capsys.readouterr()
        monkeypatch.setattr(sys, "argv", [name, *map(str, words), "--json"])
        with threadpool_limits(1), pytest.raises(SystemExit) as end:  # beside other test processes
            COMMANDS[name]()
        captured = capsys.readouterr()
        assert end.value.code == code, captured.err + captured.out
        return json.loads(captured.out)

    return command


def plan(run: Any, target: Target) -> dict[str, Any]:
    lon, lat = target.place
    north = SIDE_M / 2 / 111_320.0
    east = north / np.cos(np.radians(lat))
    box = (lon - east, lat - north, lon + east, lat + north)
    return run(
        "generate-mission", "--bbox", *(f"{side:.6f}" for side in box), "--name", "small", "--autopilot",
        target.autopilot, "--home", lon, lat, "--altitude", ALTITUDE_M, "--speed", SPEED_M_S, "--budget", "5%",
        "--hold", 2, "--iterations", 40,
    )  # fmt: skip


def nearest_m(track: np.ndarray, lon_deg: float, lat_deg: float) -> float:
    """The distance between a place and a track, straight between its points."""
    east = (track[:, 0] - lon_deg) * np.cos(np.radians(lat_deg)) * 111_320.0
    north = (track[:, 1] - lat_deg) * 111_320.0
    points = east + 1j * north
    start, step = points[:-1], np.diff(points)
    along = np.clip(np.real(-start * np.conj(step)) / np.maximum(np.abs(step) ** 2, 1e-12), 0, 1)
    return float(np.abs(start + along * step).min())


@pytest.mark.timeout(1800)
def test_plan_upload_fly_record_and_download(target, run, tmp_path):
    planned = plan(run, target)
    assert planned["flyable"], planned["warnings"]

    rehearsed = run("upload-mission", "missions/small", "--connect", target.url, "--dry-run")
    assert rehearsed["vehicle_state"] == "unchanged"
    sent = run("upload-mission", "missions/small", "--connect", target.url)
    assert sent["verified"]
    assert sent["vehicle_state"] == "new plan"

    flown = run(
        "sparsor", "fly", "missions/small", "--connect", target.url, "--yes", "--ready-timeout", PATIENT_S,
        "-o", tmp_path / "flight.tlog",
    )  # fmt: skip
    wanted = read_plan(tmp_path / planned["plans"][0]).stops

    # The .tlog by a reader that is not ours: the whole flight, past every stop, samples among it.
    log = mavutil.mavlink_connection(str(tmp_path / "flight.tlog"))
    track, reached, named = [], set(), 0
    while (message := log.recv_match()) is not None:
        kind = message.get_type()
        assert kind != "BAD_DATA"
        if kind == POSITION and message.lat:
            track.append((message.lon / 1e7, message.lat / 1e7, message.relative_alt / 1e3))
        elif kind == "MISSION_ITEM_REACHED":
            reached.add(message.seq)
        elif kind == "NAMED_VALUE_FLOAT":
            named += 1
    flight = np.array(track)
    away = [nearest_m(flight, stop.lon_deg, stop.lat_deg) for stop in wanted]
    assert max(away) < RADIUS_M, away
    assert flight[:, 2].max() == pytest.approx(ALTITUDE_M, abs=2.0)
    last = distance_m(flight[-1, 0], flight[-1, 1], [flight[0, 0]], [flight[0, 1]])
    assert last < 5.0  # it is back where it began
    assert len(reached) >= len(wanted)
    assert flown["samples"] == named
    if target.practice is not None:
        assert named > 0.9 * flown["seconds"]  # one a second, of the vehicle's own

    listed = run("sparsor", "download", "--connect", target.url, "-o", tmp_path / "own")
    assert (tmp_path / "own").exists()
    assert listed["bytes"] > 1000

    with Connection(target.url) as connection:
        assert not find_vehicle(connection, None, PATIENT_S).armed
