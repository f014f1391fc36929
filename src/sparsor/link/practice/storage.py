"""A mission item as the practice autopilot holds it, and what a whole fence is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.mission.items import FRAME_GLOBAL, FRAME_MISSION, FRAME_RELATIVE, FRAME_TERRAIN

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

Params = tuple[float, float, float, float]
NONE: Params = (0.0, 0.0, 0.0, 0.0)


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
    params: Params
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

    @property
    def plain_frame(self) -> int:
        """The frame, without the difference between positions as integers and as floats."""
        return PLAIN_FRAME.get(self.frame, self.frame)


Verdict = tuple[int, StoredItem | None]
"""MAV_MISSION_RESULT, and what is stored when it is MAV_MISSION_ACCEPTED."""


def item_in(message: Message) -> StoredItem:
    """Return what a MISSION_ITEM_INT, or an old MISSION_ITEM in degrees, holds."""
    x, y = message.x, message.y
    if message.get_type() == "MISSION_ITEM":
        scale = 1.0 if message.frame == FRAME_MISSION else 1e7
        x, y = (round(value * scale) if math.isfinite(value) else 0 for value in (x, y))
    p1, p2, p3, p4 = (_one_nan(getattr(message, f"param{number}")) for number in range(1, 5))
    return StoredItem(message.command, message.frame, (p1, p2, p3, p4), x, y, _one_nan(message.z), message.autocontinue)


def accepted(item: StoredItem) -> Verdict:
    """Return the verdict on an item that is kept."""
    return mavlink.MAV_MISSION_ACCEPTED, item


def whole(value: float, most: int, least: int = 0) -> float:
    """Return a parameter as a whole number of a limited range, as an integer field keeps it; NaN is 0."""
    return 0.0 if math.isnan(value) else float(int(min(max(value, least), most)))


def _one_nan(value: float) -> float:
    # One NaN object for all: tuples then compare equal where both hold it.
    return math.nan if math.isnan(value) else value
