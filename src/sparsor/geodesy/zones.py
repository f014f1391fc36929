"""Keep-outs as they are flown round: what is written as a fence, that with its margin, and the shortest way past."""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely

from sparsor.errors import AreaError
from sparsor.geodesy.barred import Barred, widened
from sparsor.geodesy.outward import MITRE, corners, simplified_outward
from sparsor.geodesy.plane import LocalPlane

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

    from sparsor.geodesy.keepouts import KeepOut

Points = list[tuple[float, float]]
ROUNDING_M = 0.05  # corners are written to 1e-7 degrees, about a centimetre
ASIDE_M = 0.3  # of a way's corners from the margin that they pass
LEAST_CORNERS = 4
EARTH_M = 6_371_000.0
MOST_BULGE_M = 25.0


@dataclass(frozen=True)
class Zones(Barred):
    """What is kept out of, over one mission.

    Parameters
    ----------
    polygons : tuple of lists of (longitude, latitude)
        Exclusion fences: each holds its keep-out, with no more corners than the autopilot has room for.
    circles : tuple of (longitude, latitude, radius in metres)
    names : tuple of str
    """

    polygons: tuple[Points, ...]
    circles: tuple[tuple[float, float, float], ...]
    names: tuple[str, ...]

    @property
    def fence_points(self) -> int:
        """How many fence points they take."""
        return sum(map(len, self.polygons)) + len(self.circles)

    def way(self, start: tuple[float, float], end: tuple[float, float]) -> Points | None:
        """Return the points between two places on the shortest way past; none where it is straight; None for no way."""
        lengths, before = self._from(self.plane.metres(*start))
        goal = self.plane.metres(*end)
        ends = np.vstack([self.plane.metres(*start)[None], self._corners])
        total = lengths + np.where(self._sees(ends, goal), np.hypot(*(ends - goal).T), math.inf)
        node = int(np.argmin(total))
        if not math.isfinite(total[node]):
            return None
        passed = []
        while node != 0:
            passed.append(node - 1)
            node = int(before[node])
        found = self.plane.degrees(self._corners[passed[::-1]]) if passed else np.empty((0, 2))
        return [(round(float(lon), 7), round(float(lat), 7)) for lon, lat in found]

    def lengths_m(self, start: tuple[float, float], lon_deg: ArrayLike, lat_deg: ArrayLike) -> NDArray[np.float64]:
        """Return the lengths of the shortest ways from a place to others, metres, (n,); infinite for no way."""
        origin = self.plane.metres(*start)
        lengths, _ = self._from(origin)
        nodes = np.vstack([origin[None], self._corners])
        goals = self.plane.metres(lon_deg, lat_deg).reshape(-1, 2)
        best = np.full(len(goals), math.inf)
        for node, length in zip(nodes, lengths, strict=True):
            if math.isfinite(length):
                away = np.hypot(*(goals - node).T)
                candidates = np.flatnonzero(length + away < best)
                seen = candidates[self._sees(goals[candidates], node)]
                best[seen] = length + away[seen]
        return best

    def turns_near(self, place: tuple[float, float], within_m: float) -> Points:
        """Return where ways past may turn, as far as that is from a place."""
        away_m = np.hypot(*(self._corners - self.plane.metres(*place)).T)
        return [(float(lon), float(lat)) for lon, lat in self.plane.degrees(self._corners[away_m <= within_m])]

    @cached_property
    def _corners(self) -> NDArray[np.float64]:
        """Corners that a shortest way may turn at, a little outside of the margins, (n, 2) metres."""
        grown = self.area.buffer(ASIDE_M, join_style=MITRE, mitre_limit=3.0)
        points = np.unique(shapely.get_coordinates(grown), axis=0)
        return points[~np.asarray(shapely.intersects_xy(self._prepared, *points.T), dtype=np.bool_)]

    @cached_property
    def _graph(self) -> NDArray[np.float64]:
        """Lengths between corners that see each other, else infinite, (n, n)."""
        nodes = self._corners
        table = np.full((len(nodes), len(nodes)), math.inf)
        first, second = np.triu_indices(len(nodes), 1)
        lines = shapely.linestrings(np.stack([nodes[first], nodes[second]], axis=1))
        free = ~np.asarray(shapely.intersects(self._prepared, lines), dtype=np.bool_)
        length = np.hypot(*(nodes[first] - nodes[second]).T)
        table[first[free], second[free]] = table[second[free], first[free]] = length[free]
        return table

    def _sees(self, places: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.bool_]:
        if not len(places):
            return np.zeros(0, dtype=np.bool_)
        lines = shapely.linestrings(np.stack([places, np.broadcast_to(other, places.shape)], axis=1))
        return ~np.asarray(shapely.intersects(self._prepared, lines), dtype=np.bool_)

    def _from(self, origin: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return Dijkstra's lengths from a place (node 0) to it and all corners, and each one's node before."""
        nodes, graph = self._corners, self._graph
        lengths = np.full(len(nodes) + 1, math.inf)
        before = np.zeros(len(nodes) + 1, dtype=np.int64)
        lengths[0] = 0.0
        first = np.where(self._sees(nodes, origin), np.hypot(*(nodes - origin).T), math.inf)
        heap = [(0.0, 0)]
        done = np.zeros(len(nodes) + 1, dtype=np.bool_)
        while heap:
            length, node = heapq.heappop(heap)
            if done[node]:
                continue
            done[node] = True
            onward = length + (first if node == 0 else graph[node - 1])
            for index in np.flatnonzero(onward < lengths[1:]).tolist():
                lengths[index + 1], before[index + 1] = onward[index], node
                heapq.heappush(heap, (float(onward[index]), index + 1))
        return lengths, before


def zones_of(
    keep_outs: Sequence[KeepOut], *, margin_m: float, plane: LocalPlane, most_points: int, longest_leg_m: float
) -> Zones:
    """Return keep-outs as zones.

    Parameters
    ----------
    keep_outs : sequence of KeepOut
        One or more.
    margin_m : float
        Least distance between a leg and a keep-out.
    plane : LocalPlane
        Round the middle of the mission.
    most_points : int
        Fence points that there is room for: polygons with more corners are simplified, outward.
    longest_leg_m : float
        A leg of this length may bulge out of the straight line on the map; the margin grows by as much.

    Raises
    ------
    AreaError
        When there are too many keep-outs for the autopilot's store of fence points.
    """
    whole_m = margin_m + bulge_m(longest_leg_m, plane.lat_deg)
    round_ones = [one for one in keep_outs if one.is_circle]
    shapes = _merged([one for one in keep_outs if not one.is_circle], plane)
    room = most_points - len(round_ones)
    if room < LEAST_CORNERS * len(shapes) or room < 0:
        raise AreaError(
            f"{len(keep_outs)} keep-outs are too many: the autopilot has room for {most_points} fence points "
            "beside the fence round the flight; draw some of them together"
        )
    fenced = _within(shapes, room)
    written = [_rounded(plane.degrees(shapely.get_coordinates(one.exterior)[:-1])) for one in fenced]
    areas = [_with_margin(shapely.Polygon(plane.metres(*np.array(one).T)), whole_m, plane) for one in written]
    circles = tuple(
        (round(one.lon_deg[0], 7), round(one.lat_deg[0], 7), round(one.radius_m + ROUNDING_M, 2)) for one in round_ones
    )
    for lon, lat, radius_m in circles:
        middle = widened(shapely.Point(0.0, 0.0), radius_m + whole_m)
        areas.append(_moved(middle, LocalPlane(lon, lat), plane))
    names = tuple(one.name for one in keep_outs)
    return Zones(plane, shapely.union_all(areas), tuple(written), circles, names)


def _merged(keep_outs: list[KeepOut], plane: LocalPlane) -> list[Polygon]:
    """Return polygons in metres, those that touch as one, grown by what rounding may take."""
    parts = [shapely.Polygon(plane.metres(one.lon_deg, one.lat_deg)) for one in keep_outs]
    grown = [part.buffer(ROUNDING_M, join_style=MITRE) for part in parts]
    whole = shapely.union_all(grown) if grown else shapely.Polygon()
    found = [part for part in shapely.get_parts(whole) if isinstance(part, shapely.Polygon) and not part.is_empty]
    return [shapely.Polygon(part.exterior) for part in found]


def _within(shapes: list[Polygon], room: int) -> list[Polygon]:
    """Return the polygons with at most so many corners in all: those with the most lose first."""
    fenced, most = shapes, max(map(corners, shapes), default=0)
    while sum(map(corners, fenced)) > room:
        most = max(LEAST_CORNERS, min(most - 1, int(most * 0.9)))
        fenced = [simplified_outward(one, most) for one in shapes]
    return fenced


def _with_margin(polygon: Polygon, margin_m: float, plane: LocalPlane) -> BaseGeometry:
    """Return a polygon grown by a margin that is measured where the polygon lies."""
    lon, lat = plane.degrees(shapely.get_coordinates(polygon.centroid)[0])
    own = LocalPlane(float(lon), float(lat))
    return _moved(widened(_moved(polygon, plane, own), margin_m * 1.002), own, plane)


def _moved(shape: BaseGeometry, start: LocalPlane, end: LocalPlane) -> BaseGeometry:
    """Return a shape in another plane's metres."""
    return shapely.transform(shape, lambda points: end.metres(*start.degrees(points).T))


def bulge_m(leg_m: float, lat_deg: float) -> float:
    """Return how far a leg of some length may bulge out of the straight line on the map, metres; 25 at most."""
    return min(leg_m**2 * math.tan(math.radians(abs(lat_deg))) / (8.0 * EARTH_M), MOST_BULGE_M)


def _rounded(points: NDArray[np.float64]) -> Points:
    return [(round(float(lon), 7), round(float(lat), 7)) for lon, lat in points]
