"""What docs/mission-items.md says is what is written, and its numbers are MAVLink's."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common as mavlink

from sparsor.mission import Home, build_mission, items
from sparsor.vehicle import load_vehicle

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "mission-items.md"
STOP = (51.52, 25.29)
HOME = Home(51.505, 25.265, 12.0, altitude_known=True)
WORDS = {
    "home latitude": HOME.lat_deg,
    "home longitude": HOME.lon_deg,
    "latitude": STOP[1],
    "longitude": STOP[0],
    "altitude": 55.0,
    "hold": 7.0,
    "null": math.nan,
}


def table(title: str) -> list[list[str]]:
    section = DOCUMENT.read_text(encoding="utf-8").split(f"\n## {title}\n")[1].split("\n## ")[0]
    rows = [line for line in section.splitlines() if line.startswith("|")][2:]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


@pytest.mark.parametrize(("title", "autopilot"), [("ArduPilot", "ardupilot"), ("PX4", "px4")])
@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("Multirotor", "quad"),
        ("Plane", "plane"),
        ("VTOL", "vtol"),
        ("Rover and boat", "rover"),
        ("Rover and boat", "boat"),
    ],
)
def test_the_tables_are_what_is_written(name: str, kind: str, title: str, autopilot: str) -> None:
    vehicle = load_vehicle(kind)
    speed_m_s = 19.5 if vehicle.circles else 4.5
    plan = build_mission(
        [STOP[0]], [STOP[1]], home=HOME, vehicle=vehicle, autopilot=autopilot,
        altitude_m=55 if vehicle.flies else 0, speed_m_s=speed_m_s, hold_s=0 if vehicle.circles else 7,
    )  # fmt: skip
    rows = table(f"{name}, {title}")
    assert len(rows) == len(plan.items)
    words = WORDS | {"radius": vehicle.acceptance_radius_m, "turn": vehicle.turn_radius_m, "speed": speed_m_s}
    for place, item in (("climb-out", plan.items[0]), ("circle", plan.items[-2])):
        words |= {f"{place} latitude": item.params[4], f"{place} longitude": item.params[5]}
    words["low"] = 40.0
    for row, item in zip(rows, plan.items, strict=True):
        number, name = row[1].split()
        assert mavlink.enums["MAV_CMD"][int(number)].name == f"MAV_CMD_{name}"
        assert (item.command, item.frame) == (int(number), int(row[2])), row[0]
        expected = [words[cell] if cell in words else float(cell) for cell in row[3:]]
        assert list(item.params) == pytest.approx(expected, nan_ok=True), row[0]


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("kind", ["plane", "vtol"])
def test_what_cannot_wait_circles(kind: str, autopilot: str) -> None:
    vehicle = load_vehicle(kind)
    plan = build_mission([STOP[0]], [STOP[1]], home=HOME, vehicle=vehicle, autopilot=autopilot, altitude_m=55, hold_s=7)
    (stop,) = plan.stops
    row = next(
        row for row in table("Planes and VTOLs") if row[0] == {"ardupilot": "ArduPilot", "px4": "PX4"}[autopilot]
    )
    words = WORDS | {"turn": vehicle.turn_radius_m}
    assert list(stop.params) == [words[cell] if cell in words else float(cell) for cell in row[3:]]
    assert (stop.command, stop.hold_s) == (19, 7)


def test_commands_and_frames_are_mavlinks() -> None:
    names = [name for name in vars(items) if name.startswith("NAV_")]
    assert len(names) == 13
    for name in names:
        assert getattr(items, name) == getattr(mavlink, f"MAV_CMD_{name}")
    assert items.DO_LAND_START == mavlink.MAV_CMD_DO_LAND_START
    assert items.AIR_SPEED == mavlink.SPEED_TYPE_AIRSPEED
    assert items.DO_CHANGE_SPEED == mavlink.MAV_CMD_DO_CHANGE_SPEED
    assert items.FRAME_GLOBAL == mavlink.MAV_FRAME_GLOBAL
    assert items.FRAME_MISSION == mavlink.MAV_FRAME_MISSION
    assert items.FRAME_RELATIVE == mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
    assert items.FRAME_TERRAIN == mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT
    assert items.GROUND_SPEED == mavlink.SPEED_TYPE_GROUNDSPEED
