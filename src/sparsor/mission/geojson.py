"""A plan as GeoJSON (RFC 7946), for GIS programs and web maps.

Positions have no third number: there it would be a height above the ellipsoid, which nobody here knows. Lines
and polygons across the antimeridian are cut there, as section 3.1.9 of the RFC asks.
"""

from __future__ import annotations

import json
import math
from itertools import pairwise
from typing import TYPE_CHECKING

from shapely import Polygon, box, get_parts, intersection, orient_polygons
from shapely.affinity import translate

from sparsor.mission.items import FRAME_RELATIVE
from sparsor.mission.writer import number

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sparsor.mission.items import MissionItem
    from sparsor.mission.plan import Fence, MissionPlan

Json = dict[str, object]


def geojson_bytes(plan: MissionPlan, name: str) -> bytes:
    """Return a plan as a FeatureCollection: route, stops with their order, home, fences, rally points."""
    features = [
        _route(plan),
        *(_stop(order, stop) for order, stop in enumerate(plan.stops, start=1)),
        _point("home", plan.home.lon_deg, plan.home.lat_deg, {"altitude_amsl_m": _home_altitude(plan)}),
        *(_fence(fence) for fence in plan.fences),
        *(
            _point("fence", one.lon_deg, one.lat_deg, {"inclusion": one.inclusion, "radius_m": number(one.radius_m)})
            for one in plan.circles
        ),
        *(
            _point("rally", point.lon_deg, point.lat_deg, {"altitude_above_home_m": number(point.altitude_m)})
            for point in plan.rally_points
        ),
    ]
    collection = {"type": "FeatureCollection", "name": name, "features": features}
    return (json.dumps(collection, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode("utf-8")


def _home_altitude(plan: MissionPlan) -> float | None:
    return number(plan.home.alt_amsl_m) if plan.home.altitude_known else None


def _stop(order: int, stop: MissionItem) -> Json:
    altitude = "altitude_above_home_m" if stop.frame == FRAME_RELATIVE else f"altitude_frame_{stop.frame}_m"
    properties: Json = {"order": order, "hold_s": number(stop.hold_s), altitude: number(stop.altitude_m)}
    return _point("stop", stop.lon_deg, stop.lat_deg, properties)


def _point(kind: str, lon_deg: float, lat_deg: float, properties: Json) -> Json:
    return _feature(kind, {"type": "Point", "coordinates": [number(lon_deg), number(lat_deg)]}, properties)


def _route(plan: MissionPlan) -> Json:
    flown = [item for item in plan.items if item.has_position]
    lines = _cut_line([(item.lon_deg, item.lat_deg) for item in flown])
    shape: Json = {"type": "MultiLineString", "coordinates": [_pairs(line) for line in lines]}
    if len(lines) == 1:
        shape = {"type": "LineString", "coordinates": _pairs(lines[0])}
    return _feature("route", shape, {})


def _fence(fence: Fence) -> Json:
    parts = _cut_polygon(fence)
    rings = [[_pairs(part.exterior.coords)] for part in parts]
    shape: Json = {"type": "MultiPolygon", "coordinates": rings}
    if len(rings) == 1:
        shape = {"type": "Polygon", "coordinates": rings[0]}
    return _feature("fence", shape, {"inclusion": fence.inclusion})


def _cut_line(points: list[tuple[float, float]]) -> list[list[tuple[float, float]]]:
    """Cut a line into parts where a leg crosses the antimeridian (the short way round)."""
    parts = [points[:1]]
    for (lon0, lat0), (lon1, lat1) in pairwise(points):
        if abs(lon1 - lon0) > 180:
            edge = math.copysign(180.0, lon0)
            span = lon1 + 2 * edge - lon0
            share = (edge - lon0) / span if span else 0.0  # from -180 to 180: the same place
            crossing = lat0 + share * (lat1 - lat0)
            parts[-1].append((edge, crossing))
            parts.append([(-edge, crossing)])
        parts[-1].append((lon1, lat1))
    return parts


def _cut_polygon(fence: Fence) -> list[Polygon]:
    """Cut a fence at the antimeridian and bring each part into -180..180, counter-clockwise."""
    start = fence.lon_deg[0]
    lon = [start + (value - start + 180.0) % 360.0 - 180.0 for value in fence.lon_deg]
    whole = Polygon(list(zip(lon, fence.lat_deg, strict=True)))
    if min(lon) >= -180 and max(lon) <= 180:
        return [orient_polygons(Polygon(list(zip(fence.lon_deg, fence.lat_deg, strict=True))))]
    parts: list[Polygon] = []
    for turn in (-360.0, 0.0, 360.0):
        inside = intersection(whole, box(turn - 180.0, -90.0, turn + 180.0, 90.0))
        shifted = [translate(part, xoff=-turn) for part in get_parts(inside)]
        parts += [orient_polygons(part) for part in shifted if isinstance(part, Polygon) and part.area > 0]
    return parts


def _pairs(coordinates: Iterable[tuple[float, ...]]) -> list[list[float]]:
    return [[number(point[0]), number(point[1])] for point in coordinates]


def _feature(kind: str, shape: object, properties: Json) -> Json:
    return {"type": "Feature", "geometry": shape, "properties": {"kind": kind, **properties}}
