"""The .plan file of QGroundControl, written so that MAVSDK's stricter importer takes it too.

Source: QGroundControl's plan format and its reader (MissionController, MissionItem, GeoFenceController).
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

from sparsor.errors import MissionError
from sparsor.mission.items import FLOWN_TO, FRAME_GLOBAL, FRAME_RELATIVE, FRAME_TERRAIN

if TYPE_CHECKING:
    from sparsor.mission.items import MissionItem
    from sparsor.mission.plan import Circle, Fence, MissionPlan

# QGroundControl's AltitudeMode by MAV_FRAME.
ALTITUDE_MODES = {FRAME_RELATIVE: 1, FRAME_GLOBAL: 2, FRAME_TERRAIN: 4}
DECIMALS = 9


def plan_bytes(plan: MissionPlan) -> bytes:
    """Return a plan as the contents of a .plan file: strict JSON, the same bytes for the same plan.

    Raises
    ------
    MissionError
        When the plan holds patterns of QGroundControl: written as plain items they could no longer be edited.
    """
    if plan.complex_items:
        kinds = ", ".join(item.kind for item in plan.complex_items)
        raise MissionError(f"this plan holds patterns of QGroundControl ({kinds}), which only QGroundControl can write")
    document = {
        "fileType": "Plan",
        "groundStation": "sparsor",
        "version": 1,
        "mission": _mission(plan),
        "geoFence": {
            "version": 2,
            "polygons": [_polygon(fence) for fence in plan.fences],
            "circles": [_circle(circle) for circle in plan.circles],
        },
        "rallyPoints": {
            "version": 2,
            "points": [
                [number(point.lat_deg), number(point.lon_deg), number(point.altitude_m)] for point in plan.rally_points
            ],
        },
    }
    text = json.dumps(document, indent=2, sort_keys=True, allow_nan=False)
    return (text + "\n").encode("utf-8")


def number(value: float) -> int | float:
    """Return a number as JSON shows it shortest: whole ones without a fraction, the rest to 1e-9."""
    rounded = round(value, DECIMALS)
    return int(rounded) if rounded == int(rounded) else rounded


def _mission(plan: MissionPlan) -> dict[str, object]:
    home = plan.home
    return {
        "version": 2,
        "firmwareType": plan.firmware_type,
        "vehicleType": plan.vehicle_type,
        "cruiseSpeed": number(plan.cruise_m_s),
        "hoverSpeed": number(plan.hover_m_s),
        "globalPlanAltitudeMode": ALTITUDE_MODES[FRAME_RELATIVE],
        "plannedHomePosition": [number(home.lat_deg), number(home.lon_deg), number(home.alt_amsl_m)],
        "items": [_simple_item(item, position) for position, item in enumerate(plan.items, start=1)],
    }


def _simple_item(item: MissionItem, do_jump_id: int) -> dict[str, object]:
    written: dict[str, object] = {
        "type": "SimpleItem",
        "command": item.command,
        "frame": item.frame,
        "params": [None if math.isnan(value) else number(value) for value in item.params],
        "autoContinue": item.autocontinue,
        "doJumpId": do_jump_id,
    }
    # All three or none: QGroundControl refuses a part of the triple.
    mode = ALTITUDE_MODES.get(item.frame)
    if item.command in FLOWN_TO and mode is not None and not math.isnan(item.altitude_m):
        written |= {"Altitude": number(item.altitude_m), "AltitudeMode": mode, "AMSLAltAboveTerrain": None}
    return written


def _polygon(fence: Fence) -> dict[str, object]:
    corners = [[number(lat), number(lon)] for lon, lat in zip(fence.lon_deg, fence.lat_deg, strict=True)]
    return {"version": 1, "inclusion": fence.inclusion, "polygon": corners}


def _circle(circle: Circle) -> dict[str, object]:
    centre = [number(circle.lat_deg), number(circle.lon_deg)]
    return {
        "version": 1,
        "inclusion": circle.inclusion,
        "circle": {"center": centre, "radius": number(circle.radius_m)},
    }
