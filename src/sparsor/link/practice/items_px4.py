"""What PX4 takes of a mission, fence or rally item, and what of it comes back.

Source: PX4 v1.15 mavlink_mission.cpp (parse_mavlink_mission_item, handle_mission_item_both,
format_mavlink_mission_item). NaN is taken everywhere, and so is an item of another kind in a fence or among rally
points: only missions are guarded against them.
"""

from __future__ import annotations

import math
from dataclasses import replace

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.storage import (
    CIRCLES,
    FENCE,
    MISSION,
    NONE,
    POLYGONS,
    RALLY_POINT,
    RETURN_POINT,
    Params,
    StoredItem,
    Verdict,
    accepted,
    whole,
)
from sparsor.mission.items import (
    FRAME_GLOBAL,
    FRAME_MISSION,
    FRAME_RELATIVE,
    NAV_LAND,
    NAV_LOITER_TIME,
    NAV_LOITER_TO_ALT,
    NAV_LOITER_UNLIM,
    NAV_TAKEOFF,
    NAV_VTOL_LAND,
    NAV_VTOL_TAKEOFF,
    NAV_WAYPOINT,
)

DO_JUMP, NAV_ROI, DO_SET_ROI = 177, 80, 201
AREAS = POLYGONS | CIRCLES
# Commands with a position; beside the named ones DO_SET_ROI_LOCATION, DO_AUTOTUNE_ENABLE, ARM_DISARM, CONDITION_GATE.
PLACED = frozenset({NAV_WAYPOINT, NAV_LOITER_UNLIM, NAV_LOITER_TIME, NAV_LAND, NAV_TAKEOFF, NAV_LOITER_TO_ALT})
PLACED |= {NAV_ROI, DO_SET_ROI, NAV_VTOL_TAKEOFF, NAV_VTOL_LAND, 195, 212, 400, 4501, RETURN_POINT, RALLY_POINT} | AREAS
# Commands without one, for which MAV_FRAME_MISSION is the only frame.
UNPLACED = frozenset({20, NAV_ROI, 93, 112, 114, DO_JUMP, 178, 179, 187, 189, 196, 197, 200, DO_SET_ROI, 203, 204, 205})
UNPLACED |= {206, 211, 212, 214, 260, 400, 530, 532, 534, 1000, 1001, 2000, 2001, 2003, 2500, 2501, 3000, 42600}
# MAV_ROI that a region of interest may have, with and without a position.
PLACED_ROIS, UNPLACED_ROIS = (0, 3), (0, 1, 2)


def judge(item: StoredItem, kind: int) -> Verdict:
    """Return what PX4 answers to an item of a kind (MAV_MISSION_TYPE), and what it keeps of it."""
    if item.frame == FRAME_MISSION:
        result, kept = _unplaced(item)
    elif item.plain_frame in (FRAME_GLOBAL, FRAME_RELATIVE):
        result, kept = _placed(item)
    else:
        return mavlink.MAV_MISSION_UNSUPPORTED_FRAME, None
    if kept is None:
        return result, None
    if kind == MISSION and kept.command in AREAS | {RALLY_POINT}:
        return mavlink.MAV_MISSION_ERROR, None
    if kind == FENCE:
        if kept.command in POLYGONS and kept.params[0] < 3:
            return mavlink.MAV_MISSION_ERROR, None
        # A fence point has no room for what its altitude is relative to.
        kept = replace(kept, frame=FRAME_GLOBAL, params=(kept.params[0], 0.0, 0.0, 0.0), autocontinue=0)
    return accepted(kept)


def _unplaced(item: StoredItem) -> Verdict:
    p1, p2, p3, p4 = item.params
    if item.command not in UNPLACED:
        return mavlink.MAV_MISSION_UNSUPPORTED, None
    if item.command in (NAV_ROI, DO_SET_ROI):
        if whole(p1, 255, -1) not in UNPLACED_ROIS:
            return mavlink.MAV_MISSION_INVALID_PARAM1, None
        return accepted(replace(item, command=DO_SET_ROI))
    if item.command == DO_JUMP:
        # A negative count in a uint16: 65535 in SITL (C leaves it open; other processors make it 0).
        times = 65_535.0 if p2 < 0 else whole(p2, 65_535)
        return accepted(replace(item, params=(whole(p1, 32_767, -32_768), times, p3, p4)))
    return accepted(item)


def _placed(item: StoredItem) -> Verdict:
    if item.command not in PLACED:
        return mavlink.MAV_MISSION_UNSUPPORTED, None
    command = item.command
    if command in (NAV_ROI, DO_SET_ROI):
        command = DO_SET_ROI
        if whole(item.params[0], 255, -1) not in PLACED_ROIS:
            return mavlink.MAV_MISSION_INVALID_PARAM1, None
    return accepted(replace(item, command=command, frame=item.plain_frame, params=_placed_params(item)))


def _placed_params(item: StoredItem) -> Params:
    p1, p2, p3, p4 = item.params
    yaw_deg = p4 if math.isnan(p4) else p4 % 360.0
    return {
        NAV_WAYPOINT: (p1, p2, 0.0, yaw_deg),
        NAV_LOITER_UNLIM: (0.0, 0.0, p3, yaw_deg),
        NAV_LOITER_TIME: (p1, float(p2 > 0), p3, float(p4 > 0)),
        NAV_LOITER_TO_ALT: (float(p1 > 0), p2, 0.0, float(p4 > 0)),
        NAV_LAND: (0.0, whole(p2, 65_535), 0.0, yaw_deg),
        NAV_TAKEOFF: (0.0, 0.0, 0.0, yaw_deg),
        NAV_VTOL_TAKEOFF: (0.0, 0.0, 0.0, yaw_deg),
        NAV_VTOL_LAND: (0.0, 0.0, 0.0, yaw_deg),
        **dict.fromkeys(POLYGONS, (whole(p1 + 0.5, 65_535), 0.0, 0.0, 0.0)),
        **dict.fromkeys(CIRCLES, (p1, 0.0, 0.0, 0.0)),
    }.get(item.command, NONE)
