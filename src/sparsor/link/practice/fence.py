"""Whether the vehicle is where its fence lets it be.

ArduPilot watches when FENCE_ENABLE is 1, and then what FENCE_TYPE says: 1 altitude, 2 the circle round home,
4 polygons. PX4 watches unless GF_ACTION is 0; it wants the vehicle inside all inclusions, as ArduPilot does, and
leaves out an area that home is on the wrong side of (PX4 v1.15 geofence.cpp).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sparsor.link.practice.storage import CIRCLES, FENCE, POLYGONS

if TYPE_CHECKING:
    from sparsor.link.practice.motion import Motion
    from sparsor.link.practice.parameters import Parameters
    from sparsor.link.practice.place import FlatMap
    from sparsor.link.practice.storage import StoredItem
    from sparsor.link.practice.transfer import MissionStore

Corners = list[tuple[float, float]]
Area = tuple[bool, Corners, float]
"""Whether the vehicle has to be inside, the corners in metres round home, and the radius of a circle's one."""
HOME = (0.0, 0.0)
INCLUSIONS = frozenset({5001, 5003})
ALTITUDE, CIRCLE, POLYGON = 1, 2, 4


class FenceWatch:
    """Looks whether a place is outside the fence.

    Parameters
    ----------
    store : MissionStore
    parameters : Parameters
    place : FlatMap
        Round home.
    px4 : bool
        Whose parameters it is.
    """

    def __init__(self, store: MissionStore, parameters: Parameters, place: FlatMap, *, px4: bool) -> None:
        self._store, self._parameters, self._place, self._px4 = store, parameters, place, px4
        self._areas: list[Area] = []
        self._known = -1
        self.breached = False
        self.breaches = 0

    def outside(self, motion: Motion) -> str | None:
        """Return which fence the vehicle is outside of, None for none."""
        return self.shuts_out(motion.east_m, motion.north_m, motion.up_m)

    def shuts_out(self, east_m: float, north_m: float, up_m: float) -> str | None:
        """Return which fence a place is outside of, None for none; metres east, north and above home."""
        types, most_up_m, most_away_m = self._watched()
        if types & ALTITUDE and 0 < most_up_m < up_m:
            return "altitude"
        if types & CIRCLE and 0 < most_away_m < math.hypot(east_m, north_m):
            return "circle"
        return "polygon" if types & POLYGON and self._outside_areas((east_m, north_m)) else None

    def crossed(self, motion: Motion) -> str | None:
        """Return which fence the vehicle has left since the last look, None for none."""
        outside = self.outside(motion)
        new = outside if not self.breached else None
        self.breached = outside is not None
        self.breaches += new is not None
        return new

    def _watched(self) -> tuple[int, float, float]:
        values = self._parameters
        if self._px4:
            types = ALTITUDE | CIRCLE | POLYGON if values["GF_ACTION"] else 0
            return types, values["GF_MAX_VER_DIST"], values["GF_MAX_HOR_DIST"]
        types = int(values["FENCE_TYPE"]) if values["FENCE_ENABLE"] else 0
        return types, values["FENCE_ALT_MAX"], values["FENCE_RADIUS"]

    def _outside_areas(self, at: tuple[float, float]) -> bool:
        if self._known != self._store.changes[FENCE]:
            self._known = self._store.changes[FENCE]
            areas = _areas(self._store.items[FENCE], self._place)
            self._areas = [area for area in areas if not self._px4 or _allows(area, HOME)]
        return not all(_allows(area, at) for area in self._areas)


def leaves_out(items: list[StoredItem], place: FlatMap) -> bool:
    """Whether an area of a fence has the origin of `place` on the wrong side."""
    return not all(_allows(area, HOME) for area in _areas(items, place))


def _areas(items: list[StoredItem], place: FlatMap) -> list[Area]:
    found, at = [], 0
    while at < len(items):
        item = items[at]
        count = int(item.params[0]) if item.command in POLYGONS else 1
        corners = [place.metres(one.lon_deg, one.lat_deg) for one in items[at : at + count]]
        if item.command in POLYGONS | CIRCLES:
            # A polygon that ends too early, which PX4 takes, holds nothing.
            found.append((item.command in INCLUSIONS, corners if len(corners) == count else [], item.params[0]))
        at += count
    return found


def _allows(area: Area, at: tuple[float, float]) -> bool:
    inclusion, corners, radius_m = area
    return _is_inside(at, corners, radius_m) == inclusion


def _is_inside(at: tuple[float, float], corners: Corners, radius_m: float) -> bool:
    """Whether a point is in a polygon, by counting the edges east of it, or in a circle of one corner."""
    east, north = at
    if len(corners) == 1:
        return (corners[0][0] - east) ** 2 + (corners[0][1] - north) ** 2 <= radius_m**2
    inside = False
    for (east0, north0), (east1, north1) in zip(corners, corners[1:] + corners[:1], strict=True):
        if (north0 > north) != (north1 > north):
            inside ^= east < east0 + (north - north0) / (north1 - north0) * (east1 - east0)
    return inside
