"""Other files for the same plan: .waypoints, KML, GeoJSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.errors import MissionError
from sparsor.mission.geojson import geojson_bytes
from sparsor.mission.kml import kml_bytes
from sparsor.mission.waypoints import waypoints_bytes

if TYPE_CHECKING:
    from collections.abc import Callable

    from sparsor.mission.plan import MissionPlan

# What --export takes; each name is the suffix of its file too.
FORMATS: dict[str, Callable[[MissionPlan, str], bytes]] = {
    "waypoints": waypoints_bytes,
    "kml": kml_bytes,
    "geojson": geojson_bytes,
}


def export_bytes(plan: MissionPlan, name: str, export_format: str) -> bytes:
    """Return a plan in another format, the same bytes for the same plan.

    Parameters
    ----------
    plan : MissionPlan
    name : str
        Of the mission, for formats that carry one.
    export_format : str
        A key of `FORMATS`.

    Raises
    ------
    MissionError
        When the format is unknown.
    """
    if export_format not in FORMATS:
        raise MissionError(f"unknown export '{export_format}'; known are {', '.join(FORMATS)}")
    return FORMATS[export_format](plan, name)
