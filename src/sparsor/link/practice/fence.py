"""Whether the vehicle is where its fence lets it be.

ArduPilot watches when FENCE_ENABLE is 1, and then what FENCE_TYPE says: 1 altitude, 2 the circle round home,
4 polygons. PX4 watches unless GF_ACTION is 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.link.practice.storage import CIRCLES, FENCE, POLYGONS

if TYPE_CHECKING:
    from sparsor.link.practice.motion import Motion
    from sparsor.link.practice.parameters import Parameters
    from sparsor.link.practice.place import FlatMap
    from sparsor.link.practice.storage import StoredItem
    from sparsor.link.practice.transfer import MissionStore

Corners = list[tuple[float, float]]
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
        PX4 wants the vehicle inside one of the inclusion areas, ArduPilot inside all.
    """

    def __init__(self, store: MissionStore, parameters: Parameters, place: FlatMap, *, px4: bool) -> None:
        self._store, self._parameters, self._place, self._px4 = store, parameters, place, px4
        self._areas: list[tuple[bool, Corners, float]] = []
        self._known = -1
        self.breached = False
        self.breaches = 0

    def outside(self, motion: Motion) -> str | None:
        """Return which fence the vehicle is outside of, None for none."""
        types, most_up_m, most_away_m = self._watched()
        if types & ALTITUDE and 0 < most_up_m < motion.up_m:
            return "altitude"
        if types & CIRCLE and 0 < most_away_m < motion.distance_m(0.0, 0.0):
            return "circle"
        return "polygon" if types & POLYGON and self._outside_areas(motion) else None

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

    def _outside_areas(self, motion: Motion) -> bool:
        if self._known != self._store.changes[FENCE]:
            self._known = self._store.changes[FENCE]
            self._areas = list(_areas(self._store.items[FENCE], self._place))
        at = (motion.east_m, motion.north_m)
        inside = [(inclusion, _is_inside(at, corners, radius_m)) for inclusion, corners, radius_m in self._areas]
        inclusions = [found for inclusion, found in inside if inclusion]
        kept_in = not inclusions or (any(inclusions) if self._px4 else all(inclusions))
        return not kept_in or any(found for inclusion, found in inside if not inclusion)


def _areas(items: list[StoredItem], place: FlatMap) -> list[tuple[bool, Corners, float]]:
    found, at = [], 0
    while at < len(items):
        item = items[at]
        count = int(item.params[0]) if item.command in POLYGONS else 1
        corners = [place.metres(one.lon_deg, one.lat_deg) for one in items[at : at + count]]
        if item.command in POLYGONS | CIRCLES:
            found.append((item.command in INCLUSIONS, corners, item.params[0]))
        at += count
    return found


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
