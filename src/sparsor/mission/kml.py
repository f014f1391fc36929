"""A plan as KML, for Google Earth and anybody's map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import fastkml
import numpy as np
import pygeoif
from fastkml import geometry
from fastkml.enums import AltitudeMode

from sparsor.geodesy.plane import LocalPlane
from sparsor.mission.items import FRAME_GLOBAL
from sparsor.mission.plan import Fence

if TYPE_CHECKING:
    from sparsor.mission.items import MissionItem
    from sparsor.mission.plan import Circle, MissionPlan

DECIMALS = 9
# Alpha, blue, green, red: orange route, red fence.
ROUTE_COLOUR = "ff00a5ff"
FENCE_COLOUR = "ff2020e0"


def kml_bytes(plan: MissionPlan, name: str) -> bytes:
    """Return a plan as KML: route, stops in order, home, fence.

    Altitudes are above mean sea level where home's is known; else above ground, which the document says.
    """
    document = fastkml.Document(
        name=name,
        description=_description(plan),
        styles=[_style("route", ROUTE_COLOUR), _style("fence", FENCE_COLOUR)],
        features=[
            _route(plan),
            *(_stop(plan, order, stop) for order, stop in enumerate(plan.stops, start=1)),
            _placemark("Home", geometry.Point(geometry=_home_point(plan), altitude_mode=_mode(plan))),
            *(_fence(fence) for fence in plan.fences),
            *(_fence(_ring(circle)) for circle in plan.circles),
        ],
    )
    text = fastkml.KML(features=[document]).to_string(prettyprint=True, precision=DECIMALS)
    return ('<?xml version="1.0" encoding="UTF-8"?>\n' + text).encode("utf-8")


def _description(plan: MissionPlan) -> str:
    if plan.home.altitude_known:
        return "Altitudes are above mean sea level."
    return (
        "The altitude of home above sea level is not known: altitudes are the flight's heights above home, "
        "shown above the ground."
    )


def _mode(plan: MissionPlan) -> AltitudeMode:
    return AltitudeMode.absolute if plan.home.altitude_known else AltitudeMode.relative_to_ground


def _position(plan: MissionPlan, item: MissionItem) -> tuple[float, float, float]:
    known = plan.home.altitude_known
    home_m = plan.home.alt_amsl_m if known else 0.0
    above_sea = item.frame == FRAME_GLOBAL and known
    return item.lon_deg, item.lat_deg, item.altitude_m + (0.0 if above_sea else home_m)


def _home_point(plan: MissionPlan) -> pygeoif.Point:
    home = plan.home
    return pygeoif.Point(home.lon_deg, home.lat_deg, home.alt_amsl_m if home.altitude_known else 0.0)


def _route(plan: MissionPlan) -> fastkml.Placemark:
    flown = [_position(plan, item) for item in plan.items if item.has_position]
    line = geometry.LineString(geometry=pygeoif.LineString(flown), altitude_mode=_mode(plan), tessellate=True)
    return _placemark("Route", line, style="route")


def _stop(plan: MissionPlan, order: int, stop: MissionItem) -> fastkml.Placemark:
    point = geometry.Point(geometry=pygeoif.Point(*_position(plan, stop)), altitude_mode=_mode(plan))
    return _placemark(str(order), point, description=f"Stop {order}, hold {stop.hold_s:g} s")


def _fence(fence: Fence) -> fastkml.Placemark:
    corners = list(zip(fence.lon_deg, fence.lat_deg, strict=True))
    ring = pygeoif.Polygon([*corners, corners[0]])
    polygon = geometry.Polygon(geometry=ring, altitude_mode=AltitudeMode.clamp_to_ground, tessellate=True)
    return _placemark("Fence" if fence.inclusion else "Keep out", polygon, style="fence")


def _ring(circle: Circle) -> Fence:
    """Return a circle as a polygon around it: KML has none."""
    angle = np.radians(np.arange(0, 360, 10))
    plane, radius_m = LocalPlane(circle.lon_deg, circle.lat_deg), circle.radius_m / np.cos(np.radians(5))
    lon, lat = plane.degrees(np.column_stack([np.cos(angle), np.sin(angle)]) * radius_m).T
    return Fence(tuple(lon.tolist()), tuple(lat.tolist()), circle.inclusion)


def _placemark(
    name: str,
    shape: geometry.Point | geometry.LineString | geometry.Polygon,
    *,
    style: str | None = None,
    description: str | None = None,
) -> fastkml.Placemark:
    url = fastkml.StyleUrl(url=f"#{style}") if style else None
    return fastkml.Placemark(name=name, description=description, style_url=url, kml_geometry=shape)


def _style(name: str, colour: str) -> fastkml.Style:
    outline = fastkml.LineStyle(color=colour, width=3)
    return fastkml.Style(id=name, styles=[outline, fastkml.PolyStyle(fill=False, outline=True)])
