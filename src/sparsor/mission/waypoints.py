"""The plain-text mission file, QGC WPL 110: what Mission Planner and MAVProxy load.

Source: mavlink.io, "Mission Plain-Text File Format". It carries no fence and no rally points.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sparsor.mission.items import FLOWN_TO, FRAME_GLOBAL, NAV_WAYPOINT

if TYPE_CHECKING:
    from sparsor.mission.items import MissionItem
    from sparsor.mission.plan import MissionPlan

HEADER = "QGC WPL 110"


def waypoints_bytes(plan: MissionPlan, name: str) -> bytes:
    """Return a plan as .waypoints: row 0 is home above sea level, then one row an item.

    An unknown altitude of home is written as 0; the plan's warnings say so. `name` has no place in this file.
    """
    del name
    home = plan.home
    home_params = (0.0, 0.0, 0.0, 0.0, home.lat_deg, home.lon_deg, home.alt_amsl_m)
    rows = [_row(0, NAV_WAYPOINT, FRAME_GLOBAL, home_params, has_position=True, autocontinue=True)]
    rows += [_item_row(sequence, item) for sequence, item in enumerate(plan.items, start=1)]
    return ("\n".join([HEADER, *rows]) + "\n").encode("ascii")


def _item_row(sequence: int, item: MissionItem) -> str:
    has_position = item.command in FLOWN_TO
    return _row(
        sequence,
        item.command,
        item.frame,
        item.params,
        has_position=has_position,
        autocontinue=item.autocontinue,
    )


def _row(
    sequence: int,
    command: int,
    frame: int,
    params: tuple[float, ...],
    *,
    has_position: bool,
    autocontinue: bool,
) -> str:
    current = int(sequence == 0)
    head = [str(value) for value in (sequence, current, frame, command)]
    middle = [_text(value) for value in params[:4]]
    # Fixed decimals: readers differ in whether they take an exponent.
    tail = [f"{value:.9f}" if has_position else _text(value) for value in params[4:6]]
    return "\t".join([*head, *middle, *tail, _text(params[6]), str(int(autocontinue))])


def _text(value: float) -> str:
    if math.isnan(value):
        return "nan"
    return f"{value:.9f}".rstrip("0").rstrip(".")
