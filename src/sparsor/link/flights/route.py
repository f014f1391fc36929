"""How far the rest of a mission is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.geodesy.lengths import distance_m
from sparsor.mission.items import DO_CHANGE_SPEED, LANDINGS, NAV_RETURN_TO_LAUNCH
from sparsor.vehicle import landing_seconds, load_vehicle

if TYPE_CHECKING:
    from sparsor.mission import MissionItem, MissionPlan


class Route:
    """The places of a plan in flight order, and the lengths between them.

    Parameters
    ----------
    plan : MissionPlan
    """

    def __init__(self, plan: MissionPlan) -> None:
        self._plan = plan
        placed = [(place, *_lon_lat(plan, item)) for place, item in enumerate(plan.items) if _is_placed(item)]
        self._places = [place for place, _, _ in placed]
        self._lon_deg = np.array([lon for _, lon, _ in placed], dtype=np.float64)
        self._lat_deg = np.array([lat for _, _, lat in placed], dtype=np.float64)
        legs_m = distance_m(self._lon_deg[:-1], self._lat_deg[:-1], self._lon_deg[1:], self._lat_deg[1:])
        self._rest_m = np.append(np.cumsum(legs_m[::-1])[::-1], 0.0)

    def left_m(self, item: int, lon_deg: float, lat_deg: float) -> float:
        """Return the way from a place over item `item` (0 is the plan's first) to the end, metres."""
        here = next((number for number, place in enumerate(self._places) if place >= item), None)
        if here is None:
            return 0.0
        to_it_m = distance_m(lon_deg, lat_deg, self._lon_deg[here : here + 1], self._lat_deg[here : here + 1])
        return float(to_it_m[0] + self._rest_m[here])

    def left_s(self, item: int, left_m: float, height_m: float) -> float:
        """Return how long the rest takes: the way at the plan's speed, the holds, the landing, seconds."""
        rest = self._plan.items[item:]
        lands = any(one.command in LANDINGS or one.command == NAV_RETURN_TO_LAUNCH for one in rest)
        landing_s = landing_seconds(load_vehicle("quad"), max(height_m, 0.0)) if lands else 0.0
        return left_m / self._speed_m_s(item) + sum(one.hold_s for one in rest) + landing_s

    def home_m(self, lon_deg: float, lat_deg: float) -> float:
        """Return the straight way from a place to home, metres."""
        home = self._plan.home
        return float(distance_m(lon_deg, lat_deg, [home.lon_deg], [home.lat_deg])[0])

    def home_s(self, item: int, home_m: float, height_m: float) -> float:
        """Return how long the way home takes from item `item`, with the landing, seconds."""
        return home_m / self._speed_m_s(item) + landing_seconds(load_vehicle("quad"), max(height_m, 0.0))

    def _speed_m_s(self, item: int) -> float:
        asked = [one.params[1] for one in self._plan.items[: item + 1] if one.command == DO_CHANGE_SPEED]
        return next((speed for speed in reversed(asked) if speed > 0), max(self._plan.hover_m_s, 1.0))


def _is_placed(item: MissionItem) -> bool:
    return item.command == NAV_RETURN_TO_LAUNCH or (item.has_position and (item.lon_deg, item.lat_deg) != (0.0, 0.0))


def _lon_lat(plan: MissionPlan, item: MissionItem) -> tuple[float, float]:
    if item.command == NAV_RETURN_TO_LAUNCH:
        return plan.home.place
    return item.lon_deg, item.lat_deg
