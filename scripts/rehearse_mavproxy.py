#!/usr/bin/env python3
"""Let MAVProxy load a mission, a fence and rally points into the practice autopilot and fly it; print what it says.

MAVProxy (GPL) is no part of sparsor: it is installed into a temporary environment, or given with --mavproxy. Ends with
1 when an answer of MAVProxy's does not come. docs/mavproxy.md shows the output.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import queue
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
import venv
from dataclasses import dataclass
from pathlib import Path

import environment

PACKAGES = ("MAVProxy", "future", "setuptools")
MODULES = "wp,rally,fence,param,arm,mode,cmdlong,misc"
PLAN = environment.ROOT / "missions/doha/doha.plan"
STOPS = 6
SPEEDUP = 20
PATIENCE_S = 90.0
ROW = r"^\d+ \d+ -?\d+\.\d{10} -?\d+\.\d{10} "
ACCEPTED = "Got MISSION_ACK: TYPE_{}: ACCEPTED"


@dataclass(frozen=True)
class Step:
    """What is typed, and what MAVProxy has to print after it: patterns, in this order."""

    command: str
    patterns: tuple[str, ...]


def main() -> None:
    environment.require_python()
    if importlib.util.find_spec("sparsor") is None:
        python = environment.python()
        os.execv(python, [str(python), *sys.argv])
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mavproxy", type=Path, help="mavproxy.py of an environment that has it")
    parser.add_argument("--autopilot", choices=("ardupilot", "px4"), help="default: one after the other")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="mavproxy-") as folder:
        mavproxy = options.mavproxy or install(Path(folder) / "environment")
        for autopilot in (options.autopilot,) if options.autopilot else ("ardupilot", "px4"):
            files = write_files(Path(folder), autopilot)
            rehearse(mavproxy, autopilot, files, Path(folder))


def install(folder: Path) -> Path:
    """Make an environment with MAVProxy and return its program."""
    print(f"installing {', '.join(PACKAGES)} into {folder}", flush=True)
    venv.create(folder, with_pip=True)
    environment.run(folder / "bin/python", "-m", "pip", "install", "--quiet", *PACKAGES)
    return folder / "bin/mavproxy.py"


def write_files(folder: Path, autopilot: str) -> dict[str, int]:
    """Write a mission, its fence and its rally points as MAVProxy reads them; returns the items of each file."""
    from sparsor.mission import build_mission, export_bytes, read_plan
    from sparsor.vehicle import load_vehicle

    planned = read_plan(PLAN)
    stops = [item for item in planned.items if item.command == 16][:STOPS]
    plan = build_mission(
        [item.lon_deg for item in stops],
        [item.lat_deg for item in stops],
        home=planned.home,
        vehicle=load_vehicle("quad"),
        autopilot=autopilot,
        altitude_m=50,
        hold_s=5,
    )
    first, *rows = export_bytes(plan, "rehearsal", "waypoints").decode().splitlines()
    if autopilot == "px4":  # row 0 is home, which PX4 would fly to
        rows = [f"{number}\t{row.partition(chr(9))[2]}" for number, row in enumerate(rows[1:])]
    home, fence = plan.home, plan.fences[0]
    corners = list(zip(fence.lat_deg, fence.lon_deg, strict=True))
    # An old fence file: the point to return to, the corners, the first corner again.
    lines = [(home.lat_deg, home.lon_deg), *corners, corners[0]]
    rally = [(0, 0, 3, 5100, 0, 0, 0, 0, home.lat_deg, home.lon_deg, 30, 1)]
    texts = {
        "mission.waypoints": [first, *rows],
        "fence.txt": [f"{lat:.7f} {lon:.7f}" for lat, lon in lines],
        "rally.waypoints": [first, *("\t".join(map(str, row)) for row in rally)],
    }
    for name, text in texts.items():
        (folder / name).write_text("\n".join(text) + "\n")
    return {"wp": len(rows), "fence": len(corners) + 1, "rally": len(rally)}


def steps(autopilot: str, items: dict[str, int]) -> list[Step]:
    """Return the dialogue with a flavour."""
    # MAVProxy does not acknowledge a download, so that PX4 is busy for five seconds more.
    done = ("Operation timeout",) if autopilot == "px4" else ()

    def listing(command: str, what: str) -> Step:
        return Step(f"{command} list", (f"Requesting {items[command]} {what}", *(ROW,) * items[command], *done))

    loading = [
        Step("wp load mission.waypoints", (ACCEPTED.format("MISSION"),)),
        listing("wp", "waypoints"),
        Step("fence load fence.txt", (ACCEPTED.format("FENCE"),)),
        listing("fence", "fence items"),
        Step("rally load rally.waypoints", (ACCEPTED.format("RALLY"),)),
        listing("rally", "rally items"),
    ]
    flying = {
        "ardupilot": [
            Step("param set FENCE_TYPE 4", ()),
            Step("fence enable", ("Got COMMAND_ACK: DO_FENCE_ENABLE: ACCEPTED",)),
            Step("param set DISARM_DELAY 0", ()),
            Step("arm throttle", ("^ARMED",)),
            Step("mode auto", ("Mode AUTO",)),
            Step("long MISSION_START", ("Got COMMAND_ACK: MISSION_START: ACCEPTED", "waypoint 5")),
            Step("mode rtl", ("Mode RTL", "^DISARMED")),
        ],
        "px4": [
            Step("param set COM_DISARM_PRFLT 0", ()),
            # MAVProxy's own 'mode' fails for PX4 ("required argument is not a float").
            Step("long DO_SET_MODE 1 4 4", ("Mode MISSION",)),
            Step("arm throttle", ("^ARMED", "waypoint 4")),
            Step("long NAV_RETURN_TO_LAUNCH", ("Mode RTL", "^DISARMED")),
        ],
    }
    return [*loading, *flying[autopilot], Step("wp clear", (ACCEPTED.format("MISSION"),))]


def rehearse(mavproxy: Path, autopilot: str, items: dict[str, int], folder: Path) -> None:
    """Start the practice autopilot and MAVProxy, and hold the dialogue."""
    from sparsor.mission import read_plan

    home, port = read_plan(PLAN).home, free_port()
    print(f"\n== {autopilot} ==", flush=True)
    place = ("--home", f"{home.lon_deg:.7f}", f"{home.lat_deg:.7f}")
    listening = ("--listen", f"tcp:{port}", "--speedup", str(SPEEDUP))
    practice = Program(sys.executable, "-m", "sparsor", "simulate", *place, "--autopilot", autopilot, *listening)
    with practice:
        practice.wait_for("connect to", "")
        master = ("--master", f"tcp:127.0.0.1:{port}", "--no-state", "--default-modules", MODULES)
        with Program(mavproxy, *master, folder=folder) as program:
            program.wait_for(r"Received \d+ parameters", "")
            for step in steps(autopilot, items):
                print(f"> {step.command}", flush=True)
                program.type(step.command)
                for pattern in step.patterns:
                    program.wait_for(pattern, step.command)
    print(f"{autopilot}: every answer came", flush=True)


class Program:
    """A program that is typed to and listened to; ended when left.

    Parameters
    ----------
    *command : object
    folder : Path, optional
        Where it runs.
    """

    def __init__(self, *command: object, folder: Path = environment.ROOT) -> None:
        words = [str(word) for word in command]
        pipe, unbuffered = subprocess.PIPE, {**os.environ, "PYTHONUNBUFFERED": "1", "TERM": "dumb"}
        self._name = Path(words[0]).name
        self._process = subprocess.Popen(
            words, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True, cwd=folder, env=unbuffered
        )
        self._lines: queue.Queue[str | None] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        try:
            self._process.wait(timeout=3)
        except subprocess.TimeoutExpired:  # MAVProxy goes on reading its input
            self._process.kill()
            self._process.wait()

    def type(self, line: str) -> None:
        """Type a line."""
        assert self._process.stdin is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def wait_for(self, pattern: str, command: str) -> None:
        """Print what it says until a line matches; end with 1 when none does."""
        end = time.monotonic() + PATIENCE_S
        while (left := end - time.monotonic()) > 0:
            try:
                line = self._lines.get(timeout=left)
            except queue.Empty:
                break
            if line is None:
                sys.exit(f"{self._name} ended after '{command}', before it printed /{pattern}/")
            print(f"  {line}", flush=True)
            if re.search(pattern, line):
                return
        sys.exit(f"{self._name} did not print /{pattern}/ after '{command}' within {PATIENCE_S:g} s")

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            # The prompt stands before what is printed next.
            text = re.sub(r"^(\w*> )+", "", line.rstrip())
            if text:
                self._lines.put(text)
        self._lines.put(None)


def free_port() -> int:
    """Return a TCP port that is free now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


if __name__ == "__main__":
    main()
