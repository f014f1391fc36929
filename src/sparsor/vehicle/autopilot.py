"""What ArduPilot and PX4 take: the limits and habits that change what is written."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from sparsor.errors import VehicleError

if TYPE_CHECKING:
    from sparsor.vehicle.profile import Vehicle


@dataclass(frozen=True)
class Autopilot:
    """Facts about one autopilot.

    Parameters
    ----------
    name, title : str
        As typed, and as people write it.
    firmware_type : int
        MAV_AUTOPILOT, the ``firmwareType`` of a .plan.
    max_items, max_fence_points, max_rally_points : int
        What a usual board stores (smaller boards store less).
    home_is_item_0 : bool
        Whether home takes the first place of the stored mission, and of `max_items`.
    whole_second_holds, max_hold_s : bool, int
        ArduPilot keeps a waypoint's hold as uint16 seconds and drops the fraction.
    yaw : float
        Parameter 4 of an item with a position: NaN leaves the heading to PX4; ArduPilot reads none.
    waypoint_radius : bool
        Whether parameter 2 of a waypoint is read as its acceptance radius.
    """

    name: str
    title: str
    firmware_type: int
    max_items: int
    max_fence_points: int
    max_rally_points: int
    home_is_item_0: bool
    whole_second_holds: bool
    max_hold_s: int
    yaw: float
    waypoint_radius: bool

    def written_hold_s(self, hold_s: float) -> float:
        """Return the hold that is written for a wish of `hold_s` seconds: rounded up where need be."""
        return float(math.ceil(hold_s - 1e-9)) if self.whole_second_holds else hold_s

    def on_board(self, vehicle: Vehicle) -> Autopilot:
        """Return the same autopilot on a vehicle whose board stores less than usual."""
        return replace(
            self,
            max_items=min(self.max_items, vehicle.max_items or self.max_items),
            max_fence_points=min(self.max_fence_points, vehicle.max_fence_points or self.max_fence_points),
            max_rally_points=min(self.max_rally_points, vehicle.max_rally_points or self.max_rally_points),
        )


# Seen in SITL (ArduCopter 4.6.2) and in PX4's sources; see docs/mission-items.md.
AUTOPILOTS = {
    "ardupilot": Autopilot(
        name="ardupilot",
        title="ArduPilot",
        firmware_type=3,
        max_items=650,
        max_fence_points=70,
        max_rally_points=46,
        home_is_item_0=True,
        whole_second_holds=True,
        max_hold_s=65_535,
        yaw=0.0,
        waypoint_radius=False,
    ),
    "px4": Autopilot(
        name="px4",
        title="PX4",
        firmware_type=12,
        max_items=500,
        max_fence_points=64,
        max_rally_points=8,
        home_is_item_0=False,
        whole_second_holds=False,
        max_hold_s=65_535,
        yaw=math.nan,
        waypoint_radius=True,
    ),
}


def autopilot_named(name: str) -> Autopilot:
    """Return the facts about an autopilot.

    Raises
    ------
    VehicleError
        When the name is not one of those known.

    Examples
    --------
    >>> autopilot_named("px4").max_fence_points
    64
    """
    try:
        return AUTOPILOTS[name]
    except KeyError:
        raise VehicleError(f"unknown autopilot '{name}'; known are {', '.join(AUTOPILOTS)}") from None
