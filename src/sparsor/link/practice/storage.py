"""What the practice autopilot stores of a mission item, and which items it refuses.

ArduPilot packs items into 15 bytes, so what is read back differs from what was sent; PX4 keeps the parameters
that its own item has room for. Source: docs/practice-autopilot.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.mission.items import (
    FLOWN_TO,
    FRAME_GLOBAL,
    FRAME_MISSION,
    FRAME_RELATIVE,
    FRAME_TERRAIN,
    LANDINGS,
    NAV_DELAY,
    NAV_LOITER_TIME,
    NAV_RETURN_TO_LAUNCH,
    NAV_WAYPOINT,
    TAKE_OFFS,
)

if TYPE_CHECKING:
    from sparsor.link.practice.exchange import Message

MISSION, FENCE, RALLY = 0, 1, 2
KINDS = (MISSION, FENCE, RALLY)
POLYGONS = frozenset({5001, 5002})
CIRCLES = frozenset({5003, 5004})
RETURN_POINT, RALLY_POINT = 5000, 5100
# MAV_FRAME with positions as integers, and the frame of the same altitude.
PLAIN_FRAME = {5: FRAME_GLOBAL, 6: FRAME_RELATIVE, 11: FRAME_TERRAIN}
INT_FRAME = {FRAME_GLOBAL: 5, FRAME_RELATIVE: 6}
# Commands beside FLOWN_TO whose position is kept: DO_SET_HOME, DO_LAND_START, DO_SET_ROI_LOCATION, DO_SET_ROI.
PLACED = FLOWN_TO | {179, 189, 195, 201}

ARDUPILOT_COMMANDS = PLACED | {20, 92, 93, 112, 114, 115, 177, 178, 181, 182, 183, 184, 197, 203, 205, 206, 211, 212}
ARDUPILOT_COMMANDS |= {216, 218, 222, 3000, 42702, 42703}
PX4_PLACED = frozenset({16, 17, 19, 21, 22, 31, 80, 84, 85, 195, 201, 4501})
PX4_UNPLACED = frozenset({20, 93, 112, 114, 177, 178, 179, 187, 189, 195, 197, 200, 201, 203, 205, 206, 212, 214})
PX4_UNPLACED |= {530, 532, 1000, 2000, 2001, 2003, 2500, 2501, 3000}


@dataclass(frozen=True)
class StoredItem:
    """One item as the autopilot holds it (MISSION_ITEM_INT).

    Parameters
    ----------
    command, frame : int
        MAV_CMD and MAV_FRAME.
    params : tuple of float (4,)
        Parameters 1 to 4.
    x, y : int
        Latitude and longitude in 1e-7 degrees, or parameters 5 and 6.
    z : float
        Altitude in metres by the frame, or parameter 7.
    autocontinue : int
        As sent.
    """

    command: int
    frame: int
    params: tuple[float, float, float, float]
    x: int
    y: int
    z: float
    autocontinue: int = 1

    @property
    def lat_deg(self) -> float:
        """Latitude of an item with a position."""
        return self.x * 1e-7

    @property
    def lon_deg(self) -> float:
        """Longitude of an item with a position."""
        return self.y * 1e-7


Verdict = tuple[int, StoredItem | None]
"""MAV_MISSION_RESULT, and what is stored when it is MAV_MISSION_ACCEPTED."""


def item_in(message: Message) -> StoredItem:
    """Return what a MISSION_ITEM_INT, or an old MISSION_ITEM in degrees, holds."""
    x, y = message.x, message.y
    if message.get_type() == "MISSION_ITEM":
        scale = 1.0 if message.frame == FRAME_MISSION else 1e7
        x, y = (round(value * scale) if math.isfinite(value) else 0 for value in (x, y))
    params = tuple(_one_nan(getattr(message, f"param{number}")) for number in range(1, 5))
    return StoredItem(message.command, message.frame, params, x, y, _one_nan(message.z), message.autocontinue)  # type: ignore[arg-type]


def judge(item: StoredItem, kind: int, *, px4: bool) -> Verdict:
    """Return what an autopilot answers to an item of a kind (MAV_MISSION_TYPE), and what it keeps of it."""
    if not px4 and item.command in PLACED | POLYGONS | CIRCLES | {RETURN_POINT, RALLY_POINT}:
        if abs(item.x) > 90e7:
            return mavlink.MAV_MISSION_INVALID_PARAM5_X, None
        if abs(item.y) > 180e7:
            return mavlink.MAV_MISSION_INVALID_PARAM6_Y, None
    if kind == FENCE:
        return _judge_fence(item, px4=px4)
    if kind == RALLY:
        return _judge_rally(item, px4=px4)
    return _judge_px4(item) if px4 else _judge_ardupilot(item)


def _judge_ardupilot(item: StoredItem) -> Verdict:
    if item.command not in ARDUPILOT_COMMANDS:
        return mavlink.MAV_MISSION_UNSUPPORTED, None
    heading_may_be_nan = item.command in TAKE_OFFS | LANDINGS | {NAV_WAYPOINT}
    for number, value in enumerate((*item.params, 0.0, 0.0, item.z), start=1):
        if math.isinf(value) or (math.isnan(value) and not (number == 4 and heading_may_be_nan)):
            return _invalid_param(number), None
    frame = PLAIN_FRAME.get(item.frame, item.frame)
    if item.command not in PLACED:
        # The speed's "relative" flag and the like are dropped; any frame is taken and none is kept.
        params = (*item.params[:3], 0.0)
        if item.command == NAV_RETURN_TO_LAUNCH:
            params = (0.0, 0.0, 0.0, 0.0)
        return mavlink.MAV_MISSION_ACCEPTED, replace(item, frame=FRAME_GLOBAL, params=params, x=0, y=0, z=0.0)
    if frame not in (FRAME_GLOBAL, FRAME_RELATIVE, FRAME_TERRAIN):
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME, None
    # Altitudes are whole centimetres; holds are uint16 seconds; the other parameters have no room.
    first = float(min(max(int(item.params[0]), 0), 65_535))
    params = (first, 0.0, 0.0, 0.0)
    if item.command not in TAKE_OFFS | LANDINGS | {NAV_WAYPOINT, NAV_LOITER_TIME}:
        params = item.params
    z = round(item.z * 100.0) / 100.0
    return mavlink.MAV_MISSION_ACCEPTED, replace(item, frame=frame, params=params, z=z)


def _judge_px4(item: StoredItem) -> Verdict:
    frame = PLAIN_FRAME.get(item.frame, item.frame)
    if frame == FRAME_MISSION:
        if item.command not in PX4_UNPLACED:
            return mavlink.MAV_MISSION_UNSUPPORTED, None
        return mavlink.MAV_MISSION_ACCEPTED, item
    if frame not in (FRAME_GLOBAL, FRAME_RELATIVE):
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME, None
    if item.command not in PX4_PLACED:
        return mavlink.MAV_MISSION_UNSUPPORTED, None
    p1, p2, p3, p4 = item.params
    kept = {
        NAV_WAYPOINT: (p1, p2, 0.0, p4),
        22: (0.0, 0.0, 0.0, p4),
        21: (0.0, p2, 0.0, p4),
    }.get(item.command, (p1, p2, p3, p4))
    return mavlink.MAV_MISSION_ACCEPTED, replace(item, frame=frame, params=kept)


def _judge_fence(item: StoredItem, *, px4: bool) -> Verdict:
    frame = PLAIN_FRAME.get(item.frame, item.frame)
    if frame not in (FRAME_GLOBAL, FRAME_RELATIVE):
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME, None
    if item.command not in POLYGONS | CIRCLES | {RETURN_POINT}:
        return mavlink.MAV_MISSION_UNSUPPORTED if px4 else mavlink.MAV_MISSION_INVALID, None
    first = item.params[0]
    if item.command in POLYGONS and not 3 <= first <= 65_535:
        return mavlink.MAV_MISSION_ERROR if px4 else mavlink.MAV_MISSION_INVALID_PARAM1, None
    if item.command in CIRCLES and not first > 0:
        return mavlink.MAV_MISSION_ERROR if px4 else mavlink.MAV_MISSION_INVALID_PARAM1, None
    kept_frame = frame if px4 else FRAME_GLOBAL
    z = item.z if px4 and math.isfinite(item.z) else 0.0
    if item.command == RETURN_POINT:
        first = 0.0
    return mavlink.MAV_MISSION_ACCEPTED, replace(item, frame=kept_frame, params=(first, 0.0, 0.0, 0.0), z=z)


def _judge_rally(item: StoredItem, *, px4: bool) -> Verdict:
    frame = PLAIN_FRAME.get(item.frame, item.frame)
    if item.command != RALLY_POINT:
        return mavlink.MAV_MISSION_UNSUPPORTED, None
    if frame not in (FRAME_GLOBAL, FRAME_RELATIVE, *(() if px4 else (FRAME_TERRAIN,))):
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME, None
    if not math.isfinite(item.z):
        return mavlink.MAV_MISSION_INVALID_PARAM7, None
    # ArduPilot's rally points have whole metres (int16).
    z = item.z if px4 else float(int(min(max(item.z, -32_768.0), 32_767.0)))
    return mavlink.MAV_MISSION_ACCEPTED, replace(item, frame=frame, params=(0.0, 0.0, 0.0, 0.0), z=z)


def fence_is_whole(items: list[StoredItem]) -> bool:
    """Whether every polygon of a fence has the number of corners that its corners say."""
    at = 0
    while at < len(items):
        item = items[at]
        count = int(item.params[0]) if item.command in POLYGONS else 1
        corners = items[at : at + count]
        if len(corners) < count or any(
            (one.command, one.params[0]) != (item.command, item.params[0]) for one in corners
        ):
            return False
        at += count
    return True


def waits_s(item: StoredItem) -> float:
    """Return how long the vehicle stays at an item, seconds."""
    waits = item.command in (NAV_WAYPOINT, NAV_LOITER_TIME, NAV_DELAY)
    return item.params[0] if waits and item.params[0] > 0 else 0.0


def _one_nan(value: float) -> float:
    # One NaN object for all: tuples then compare equal where both hold it.
    return math.nan if math.isnan(value) else value


def _invalid_param(number: int) -> int:
    return int(mavlink.MAV_MISSION_INVALID_PARAM1) + number - 1
