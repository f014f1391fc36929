"""What ArduPilot takes of a mission, fence or rally item, and what it keeps of it in its 15 bytes.

Source: ArduPilot's AP_Mission.cpp (sanity_check_params, mavlink_int_to_mission_cmd, mission_cmd_to_mavlink_int),
MissionItemProtocol_Fence.cpp and MissionItemProtocol_Rally.cpp, AC_PolyFence_loader.cpp (validate_fence); the
values read back were also seen on ArduCopter 4.6.2 in SITL.
"""

from __future__ import annotations

import math
import struct
from dataclasses import replace

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.storage import (
    CIRCLES,
    FENCE,
    NONE,
    POLYGONS,
    RALLY,
    RALLY_POINT,
    RETURN_POINT,
    Params,
    StoredItem,
    Verdict,
    accepted,
    whole,
)
from sparsor.mission.items import (
    FLOWN_TO,
    FRAME_GLOBAL,
    FRAME_MISSION,
    FRAME_RELATIVE,
    FRAME_TERRAIN,
    LANDINGS,
    NAV_LAND,
    NAV_LOITER_TIME,
    NAV_LOITER_TO_ALT,
    NAV_LOITER_TURNS,
    NAV_LOITER_UNLIM,
    NAV_PAYLOAD_PLACE,
    NAV_VTOL_LAND,
    NAV_VTOL_TAKEOFF,
    NAV_WAYPOINT,
    TAKE_OFFS,
)

# Beside what is flown to: CONTINUE_AND_CHANGE_ALT, GUIDED_ENABLE, DO_SET_HOME, DO_LAND_START, DO_GO_AROUND, the ROIs.
LOCATED = FLOWN_TO | {30, 92, 179, 189, 191, 195, 201}
WITHOUT_PARAMS = frozenset({NAV_VTOL_TAKEOFF, 189, 191, 195})
# Commands without a position, and which of parameters 1 to 4 (and 5 and 6, as x and y) there is room for.
KEPT = {
    20: "", 83: "123", 93: "1234", 112: "1", 114: "1", 115: "1234", 177: "12", 178: "123", 181: "12", 182: "123",
    183: "12", 184: "1234", 193: "1", 194: "1", 197: "", 203: "1234xy", 205: "123", 206: "13", 207: "1", 208: "1",
    210: "1", 211: "12", 212: "1", 213: "123", 215: "1", 216: "1", 217: "1234", 218: "12", 222: "1234", 223: "123",
    3000: "1", 42600: "1234", 42702: "1234xy", 42703: "1234x",
}  # fmt: skip
GLOBAL_FRAMES = (FRAME_GLOBAL, FRAME_RELATIVE, FRAME_TERRAIN)
MOST_ALTITUDE_M = 83_000.0


def judge(item: StoredItem, kind: int) -> Verdict:
    """Return what ArduPilot answers to an item of a kind (MAV_MISSION_TYPE), and what it keeps of it."""
    if kind == FENCE:
        return _judge_fence(item)
    return _judge_rally(item) if kind == RALLY else _judge_mission(item)


def fence_fault(items: list[StoredItem]) -> str | None:
    """Return what is wrong with a fence that has come in, None for nothing; nothing before is looked at."""
    wanted, first = 0, None
    returns = 0
    for item in items:
        count = int(item.params[0])
        if item.command in POLYGONS:
            if count < 3:
                return f"Invalid vertex count ({count})"
            if wanted == 0:
                wanted, first = count, item
            elif first is not None and (item.command, count) != (first.command, int(first.params[0])):
                return f"Unexpected vertex count want={int(first.params[0])} got={count}"
            wanted -= 1
        elif wanted:
            return "Received incorrect type"
        elif item.command in CIRCLES and not item.params[0] > 0:
            return "Non-positive circle radius"
        returns += item.command == RETURN_POINT
        if returns > 1:
            return "Multiple return points"
        if _off_earth(item) is not None:
            return "Bad lat or lon"
    return "Incorrect item count" if wanted else None


def _judge_mission(item: StoredItem) -> Verdict:
    for number, value in enumerate(item.params, start=1):
        if math.isinf(value) or (math.isnan(value) and not _may_be_nan(item.command, number)):
            return int(mavlink.MAV_MISSION_INVALID_PARAM1) + number - 1, None
    if item.command in KEPT:
        return accepted(_without_position(item, KEPT[item.command]))
    if item.command not in LOCATED:
        return mavlink.MAV_MISSION_UNSUPPORTED, None
    wrong = _off_earth(item)
    if wrong is not None:
        return wrong, None
    if not abs(item.z) < MOST_ALTITUDE_M:
        return mavlink.MAV_MISSION_INVALID_PARAM7, None
    frame = FRAME_GLOBAL if item.frame == FRAME_MISSION else item.plain_frame
    if frame not in GLOBAL_FRAMES:
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME, None
    return accepted(replace(item, frame=frame, params=_located_params(item), z=_centimetres(item.z), autocontinue=1))


def _may_be_nan(command: int, number: int) -> bool:
    if number == 3:
        return command == NAV_VTOL_LAND
    return number == 4 and command in TAKE_OFFS | LANDINGS | {NAV_WAYPOINT}


def _off_earth(item: StoredItem) -> int | None:
    if abs(item.x) > 90e7:
        return int(mavlink.MAV_MISSION_INVALID_PARAM5_X)
    return int(mavlink.MAV_MISSION_INVALID_PARAM6_Y) if abs(item.y) > 180e7 else None


def _without_position(item: StoredItem, kept: str) -> StoredItem:
    p1, p2, p3, p4 = (value if str(number) in kept else 0.0 for number, value in enumerate(item.params, start=1))
    x, y = (value if name in kept else 0 for name, value in (("x", item.x), ("y", item.y)))
    return StoredItem(item.command, FRAME_GLOBAL, (p1, p2, p3, p4), x, y, 0.0)


def _located_params(item: StoredItem) -> Params:
    """Return what one uint16 and two flags beside the position hold of parameters 1 to 4."""
    p1, p2, p3, p4 = item.params
    first, tangent = whole(p1, 65_535), float(p4 > 0)
    match item.command:
        case command if command in WITHOUT_PARAMS:
            return NONE
        case command if command == NAV_LOITER_UNLIM:
            return 0.0, 0.0, math.copysign(whole(abs(p3), 65_535), p3), 0.0
        case command if command == NAV_LOITER_TURNS:
            radius = abs(p3) if abs(p3) <= 255 else 10.0 * whole(abs(p3) * 0.1, 255)
            return whole(p1, 255), 0.0, math.copysign(whole(radius, 2550), p3), tangent
        case command if command == NAV_LOITER_TIME:
            return first, 0.0, -1.0 if p3 < 0 else 1.0, tangent
        case command if command == NAV_LOITER_TO_ALT:
            return 0.0, math.copysign(whole(abs(p2), 65_535), p2), 0.0, tangent
        case command if command == NAV_LAND:
            return first, 0.0, 0.0, -1.0 if p4 < 0 else 1.0
        case command if command == NAV_PAYLOAD_PLACE:
            return whole(p1 * 100.0, 65_535) / 100.0, 0.0, 0.0, 0.0
    return first, 0.0, 0.0, 0.0


def _centimetres(z: float) -> float:
    """Return an altitude as whole centimetres, cut off after a multiplication of C floats."""
    return int(struct.unpack("<f", struct.pack("<f", z * 100.0))[0]) / 100.0


def _judge_fence(item: StoredItem) -> Verdict:
    if item.plain_frame not in GLOBAL_FRAMES:
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME, None
    if item.command not in POLYGONS | CIRCLES | {RETURN_POINT}:
        return mavlink.MAV_MISSION_UNSUPPORTED, None
    first = 0.0 if item.command == RETURN_POINT or not math.isfinite(item.params[0]) else item.params[0]
    if item.command in POLYGONS:
        first = whole(first, 255)
    return accepted(replace(item, frame=FRAME_GLOBAL, params=(first, 0.0, 0.0, 0.0), z=0.0, autocontinue=0))


def _judge_rally(item: StoredItem) -> Verdict:
    if item.command != RALLY_POINT:
        return mavlink.MAV_MISSION_UNSUPPORTED, None
    if item.plain_frame not in GLOBAL_FRAMES:
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME, None
    wrong = _off_earth(item)
    if wrong is not None:
        return wrong, None
    if not -32_768 <= item.z <= 32_767:
        return mavlink.MAV_MISSION_INVALID_PARAM7, None
    return accepted(replace(item, frame=item.plain_frame, params=NONE, z=float(int(item.z)), autocontinue=0))
