"""Which waypoints of a mission were reached: by the vehicle's word, or by its track where the link lost the word."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.geodesy.lengths import distance_m
from sparsor.mission.items import WAYPOINTS

if TYPE_CHECKING:
    from sparsor.link.flights.views import Fix
    from sparsor.mission import MissionPlan

NEAR_M: Final = 15.0  # how near a waypoint was passed whose MISSION_ITEM_REACHED the link may have lost


class Reached:
    """Remembers what was reached, left behind and flown over; items by their place in the plan, from 0.

    Parameters
    ----------
    plan : MissionPlan

    Attributes
    ----------
    waypoints : tuple of int
        Places of the waypoints among the plan's items.
    """

    def __init__(self, plan: MissionPlan) -> None:
        self.waypoints = tuple(place for place, item in enumerate(plan.items) if item.command in WAYPOINTS)
        self._items = plan.items
        self._told: set[int] = set()
        self._left_behind: set[int] = set()
        self._track: list[Fix] = []

    def tell(self, place: int) -> bool:
        """Take the vehicle's word that an item was reached; False when it is none, or was said before."""
        news = 0 <= place < len(self._items) and place not in self._told
        if news:
            self._told.add(place)
        return news

    def leave(self, before: int, now: int) -> None:
        """Take note that the mission went on from one item to a later one."""
        self._left_behind |= set(range(before, now)) & set(self.waypoints)

    def fly_over(self, fix: Fix) -> None:
        """Take note of where the vehicle is."""
        self._track.append(fix)

    @property
    def places(self) -> frozenset[int]:
        """Places of the items that were reached.

        The vehicle said so; or its mission went on past a waypoint near which it was (the link may have lost the word).
        """
        return frozenset(self._told | {place for place in self._left_behind if self._was_near(place)})

    @property
    def all_behind(self) -> bool:
        """Whether the last waypoint was reached or left behind."""
        return bool(self.waypoints) and self.waypoints[-1] in self._told | self._left_behind

    def _was_near(self, place: int) -> bool:
        item = self._items[place]
        lon = np.array([fix.lon_deg for fix in self._track])
        lat = np.array([fix.lat_deg for fix in self._track])
        return bool(len(lon)) and float(distance_m(item.lon_deg, item.lat_deg, lon, lat).min()) <= NEAR_M
