"""Reading .plan files: ours and QGroundControl's, with a sentence for whatever is wrong with them.

A fault that makes the plan unreadable is a MissionError that names the place; what can be read but will
disappoint somebody (MAVSDK's importer is stricter than QGroundControl) becomes a warning of the plan.
"""

from __future__ import annotations

from pathlib import Path

from sparsor.errors import MissionError
from sparsor.mission import jsonfile
from sparsor.mission.items import MissionItem
from sparsor.mission.plan import Circle, ComplexItem, Fence, Home, MissionPlan, RallyPoint

Json = dict[str, object]
# Speeds of an unmodified QGroundControl, for plans that leave them out.
DEFAULT_CRUISE_M_S = 15.0
DEFAULT_HOVER_M_S = 5.0
GENERIC_VEHICLE = 0  # MAV_TYPE_GENERIC


def read_plan(path: str | Path) -> MissionPlan:
    """Read a .plan file.

    Raises
    ------
    MissionError
        When the file cannot be read or is not a plan; names the file and the place in it.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise MissionError(f"cannot read the plan '{path}': {error.strerror or error}") from error
    return parse_plan(content, str(path))


def parse_plan(content: bytes, source: str) -> MissionPlan:
    """Read the contents of a .plan file; `source` names it in the errors.

    Raises
    ------
    MissionError
        When the content is not a plan.
    """
    try:
        return _plan(jsonfile.parse(content))
    except MissionError as error:
        raise MissionError(f"'{source}' is not a usable plan: {error}") from error


def _plan(document: Json) -> MissionPlan:
    if document.get("fileType") != "Plan":
        raise MissionError(f'fileType is {document.get("fileType")!r}; a plan has "Plan"')
    warnings: list[str] = []
    _check_version(document, "version", 1, warnings)
    mission = jsonfile.mapping(document, "mission")
    _check_version(mission, "mission.version", 2, warnings)
    items, complex_items = _items(mission)
    fences, circles = _fences(document, warnings)
    return MissionPlan(
        items=items,
        home=_home(mission),
        fences=fences,
        circles=circles,
        rally_points=_rally_points(document, warnings),
        firmware_type=jsonfile.whole(mission, "mission.firmwareType"),
        vehicle_type=jsonfile.whole(mission, "mission.vehicleType", GENERIC_VEHICLE),
        cruise_m_s=jsonfile.number(mission.get("cruiseSpeed", DEFAULT_CRUISE_M_S), "mission.cruiseSpeed"),
        hover_m_s=jsonfile.number(mission.get("hoverSpeed", DEFAULT_HOVER_M_S), "mission.hoverSpeed"),
        complex_items=complex_items,
        warnings=tuple(warnings),
    )


def _check_version(holder: Json, where: str, expected: int, warnings: list[str]) -> None:
    value = holder.get(where.rsplit(".", maxsplit=1)[-1])
    if isinstance(value, bool) or not isinstance(value, int | float) or value != expected:
        raise MissionError(f"{where} is {value!r}; this program reads version {expected}")
    if isinstance(value, float):
        warnings.append(f"{where} is written {value!r}: MAVSDK's importer takes only the whole number {expected}.")


def _home(mission: Json) -> Home:
    where = "mission.plannedHomePosition"
    values = jsonfile.numbers(mission.get("plannedHomePosition"), where, 3)
    return Home(values[1], values[0], values[2], altitude_known=values[2] != 0)


def _items(mission: Json) -> tuple[tuple[MissionItem, ...], tuple[ComplexItem, ...]]:
    items: list[MissionItem] = []
    patterns: list[ComplexItem] = []
    for position, entry in enumerate(jsonfile.sequence(mission.get("items"), "mission.items"), start=1):
        where = f"mission item {position}"
        holder = jsonfile.as_mapping(entry, where)
        kind = holder.get("type")
        if kind == "SimpleItem":
            items.append(_simple_item(holder, where))
        elif kind == "ComplexItem":
            inside = _complex_items(holder, where)
            patterns.append(ComplexItem(jsonfile.text(holder, "complexItemType", where), len(inside)))
            items.extend(inside)
        else:
            raise MissionError(f"{where} has the type {kind!r}; known are SimpleItem and ComplexItem")
    return tuple(items), tuple(patterns)


def _simple_item(holder: Json, where: str) -> MissionItem:
    params = jsonfile.numbers(holder.get("params"), f"{where}, params", 7, null_allowed=True)
    autocontinue = holder.get("autoContinue")
    if not isinstance(autocontinue, bool):
        raise MissionError(f"{where}: autoContinue is {autocontinue!r}; it has to be true or false")
    command = jsonfile.whole(holder, f"{where}.command")
    frame = jsonfile.whole(holder, f"{where}.frame")
    try:
        return MissionItem(command, frame, tuple(params), autocontinue)
    except MissionError as error:
        raise MissionError(f"{where}: {error}") from error


def _complex_items(holder: Json, where: str) -> list[MissionItem]:
    """Return the flight items that a survey or corridor carries with it; other patterns carry none."""
    transects = holder.get("TransectStyleComplexItem")
    if not isinstance(transects, dict) or "Items" not in transects:
        return []
    entries = jsonfile.sequence(transects["Items"], f"{where}, Items")
    return [
        _simple_item(jsonfile.as_mapping(entry, f"{where}, its item {number}"), f"{where}, its item {number}")
        for number, entry in enumerate(entries, start=1)
    ]


def _fences(document: Json, warnings: list[str]) -> tuple[tuple[Fence, ...], tuple[Circle, ...]]:
    holder = _section(document, "geoFence", warnings)
    if holder is None:
        return (), ()
    polygons = jsonfile.sequence(holder.get("polygons", []), "geoFence.polygons")
    circles = jsonfile.sequence(holder.get("circles", []), "geoFence.circles")
    return (
        tuple(_polygon(entry, f"fence polygon {number}") for number, entry in enumerate(polygons, start=1)),
        tuple(_circle(entry, f"fence circle {number}") for number, entry in enumerate(circles, start=1)),
    )


def _polygon(entry: object, where: str) -> Fence:
    holder = jsonfile.as_mapping(entry, where)
    corners = [
        jsonfile.numbers(corner, f"{where}, corner {number}", 2)
        for number, corner in enumerate(jsonfile.sequence(holder.get("polygon"), where), start=1)
    ]
    inclusion = holder.get("inclusion", True)  # as MAVSDK's importer takes a missing one
    return Fence(tuple(point[1] for point in corners), tuple(point[0] for point in corners), bool(inclusion))


def _circle(entry: object, where: str) -> Circle:
    holder = jsonfile.as_mapping(entry, where)
    circle = jsonfile.as_mapping(holder.get("circle"), where)
    lat, lon = jsonfile.numbers(circle.get("center"), f"{where}, center", 2)
    radius = jsonfile.number(circle.get("radius"), f"{where}, radius")
    return Circle(lon, lat, radius, bool(holder.get("inclusion", False)))


def _rally_points(document: Json, warnings: list[str]) -> tuple[RallyPoint, ...]:
    holder = _section(document, "rallyPoints", warnings)
    if holder is None:
        return ()
    points = jsonfile.sequence(holder.get("points", []), "rallyPoints.points")
    values = [jsonfile.numbers(point, f"rally point {number}", 3) for number, point in enumerate(points, start=1)]
    return tuple(RallyPoint(lon, lat, altitude) for lat, lon, altitude in values)


def _section(document: Json, name: str, warnings: list[str]) -> Json | None:
    """Return a section, or None where every reader would ignore it."""
    if name not in document:
        warnings.append(f"{name} is missing: MAVSDK's importer refuses such a plan.")
        return None
    holder = jsonfile.mapping(document, name)
    if holder.get("version") != 2:
        warnings.append(f"{name} has version {holder.get('version')!r} and is ignored; only version 2 is read.")
        return None
    return holder
