"""The picture of a planned mission."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.geodesy.plane import LocalPlane
from sparsor.mission import transits
from sparsor.plot import MissionPicture, mission_preview

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from sparsor.geodesy import BoundingBox
    from sparsor.geodesy.barred import Barred
    from sparsor.journeys.planning import PlannedMission
    from sparsor.journeys.preparing import Place
    from sparsor.mission import MissionPlan
    from sparsor.mission.specification import MissionSpecification

LONGEST_NAME = 18  # that the legend has room for


def preview_png(mission: PlannedMission) -> bytes:
    """Return ``preview.png`` of a mission."""
    place = mission.place
    stops = np.concatenate(list(map(_stops, mission.plans)))
    prior, label = _prior_map(mission)
    return mission_preview(
        MissionPicture(
            title=mission.specification.name,
            box_deg=place.grid.box.as_tuple(),
            east_m=place.grid.box.east_m,
            north_m=place.grid.box.north_m,
            shape=place.grid.shape,
            prior=prior.reshape(place.grid.shape),
            prior_label=label,
            prior_unit=mission.prior.model.unit,
            stops=stops,
            route=stops if mission.sorties is None else None,
            sorties=() if mission.sorties is None else tuple(map(_stops, mission.plans)),
            transits=_ways(mission),
            homes=tuple(dict.fromkeys(plan.home.place for plan in mission.plans)),
            fence=_fence(mission),
            area=() if place.area is None else _rings(mission),
            keep_outs=_keep_outs(place),
            margins=_margins(place),
            coast=None if place.shore is None else _in_box(place.shore, place.shore.land.boundary, place.grid.box),
            coast_label=f"coastline ({_whose(mission.specification)})",
            outside=None if place.inside.all() else ~place.inside,
            caption=_caption(mission),
        )
    )


def _keep_outs(place: Place) -> tuple[NDArray[np.float64], ...]:
    """Return the rings of the exclusion fences, circles as rings too."""
    if place.zones is None:
        return ()
    turn = np.linspace(0.0, 2 * np.pi, 73)
    around = np.column_stack([np.cos(turn), np.sin(turn)])
    circles = [LocalPlane(lon, lat).degrees(radius_m * around) for lon, lat, radius_m in place.zones.circles]
    return (*(np.array(ring) for ring in place.zones.polygons), *circles)


def _margins(place: Place) -> tuple[NDArray[np.float64], ...]:
    import shapely

    kept = () if place.zones is None else _degrees(place.zones, shapely.get_parts(place.zones.area.boundary))
    return kept if place.shore is None else (*kept, *_in_box(place.shore, place.shore.area.boundary, place.grid.box))


def _whose(spec: MissionSpecification) -> str:
    own = None if spec.coast is None else spec.coast.file
    return "GSHHG" if own is None else own.name[:LONGEST_NAME]


def _in_box(ground: Barred, lines: BaseGeometry, box: BoundingBox) -> tuple[NDArray[np.float64], ...]:
    """Return the parts in the box of lines on a ground's plane, in degrees: around it lies where they were cut off."""
    import shapely

    east, north = ground.plane.metres(box.east_deg, box.north_deg)
    return _degrees(ground, shapely.get_parts(shapely.clip_by_rect(lines, -east, -north, east, north)))


def _degrees(ground: Barred, lines: Iterable[BaseGeometry]) -> tuple[NDArray[np.float64], ...]:
    import shapely

    return tuple(ground.plane.degrees(shapely.get_coordinates(line)) for line in lines)


def _fence(mission: PlannedMission) -> NDArray[np.float64]:
    """Return the corners of the fence; of sorties those of a hull round theirs."""
    fences = [plan.fences[0] for plan in mission.plans]
    corners = np.concatenate([np.column_stack([fence.lon_deg, fence.lat_deg]) for fence in fences])
    if len(fences) == 1:
        return corners
    import shapely

    west_deg = corners[0, 0]
    corners[:, 0] = west_deg + (corners[:, 0] - west_deg + 180.0) % 360.0 - 180.0  # side by side at the antimeridian
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(corners)))[:-1]
    hull[:, 0] = (hull[:, 0] + 180.0) % 360.0 - 180.0
    return np.asarray(hull, dtype=np.float64)


def _stops(plan: MissionPlan) -> NDArray[np.float64]:
    return np.array([[stop.lon_deg, stop.lat_deg] for stop in plan.stops])


def _ways(mission: PlannedMission) -> tuple[NDArray[np.float64], ...]:
    """Return the ways from and to home, of each sortie."""
    return tuple(np.array(way) for plan in mission.plans for way in transits(plan))


def _prior_map(mission: PlannedMission) -> tuple[NDArray[np.float64], str]:
    """Return what the prior says of this very box, else the mean of its training maps."""
    model, grid = mission.prior.model, mission.place.grid
    if mission.prior.synthetic:
        from sparsor.prior.synthetic import covers, gulf_values

        if covers(grid.box.as_tuple()):
            return gulf_values(grid), "Built-in synthetic NO2 field"
    if mission.prior.field is not None:
        from sparsor.prior.resampling import sample_at

        values = sample_at(mission.prior.field, *grid.centres_deg())
        if np.isfinite(values).any():
            return values, "Training field"
    low, high = model.scale
    mean = model.mean if model.centred else model.validation.mean(axis=0)
    return low + (high - low) * mean, "Mean of the training maps"


def _rings(mission: PlannedMission) -> tuple[NDArray[np.float64], ...]:
    import shapely

    assert mission.place.area is not None
    boundary = shapely.get_parts(mission.place.area.polygon.boundary)
    return tuple(shapely.get_coordinates(ring) for ring in boundary)


def _caption(mission: PlannedMission) -> tuple[str, ...]:
    found = mission.measured
    return (
        f"{found.stops.size} stops, {mission.path_length_m / 1000:.1f} km over the stops "
        f"({mission.coverage_fraction:.1%} of full coverage), "
        f"{_heights(mission)} m above {'home' if mission.ground is None else 'the ground'}.",
        f"{_minutes(mission)} min in the air; {mission.vehicle.name}: {mission.usable_s / 60:.0f} min "
        f"less its reserve{'' if mission.flyable else ' - a planning study, not flyable'}.",
        f"Expected error {mission.expected_relative_error:.2f} of the map's contrast (|s - s'| / |s - mean(s)|).",
        "Nothing here says that the flight is legal or safe.",
    )


def _heights(mission: PlannedMission) -> str:
    at_once = () if mission.sorties is None else mission.sorties.heights_m
    return _listed(sorted({*at_once}) or [mission.specification.flight.altitude_m], "{:g}")


def _minutes(mission: PlannedMission) -> str:
    """Return the minutes of each flight, round by round."""
    if mission.sorties is None:
        return f"{mission.flight_time_s / 60:.0f}"
    rounds = mission.sorties.times_by_round
    return ", then ".join(_listed([time.seconds / 60 for time in times], "{:.0f}") for times in rounds)


def _listed(numbers: Sequence[float], form: str) -> str:
    *before, last = map(form.format, numbers)
    return f"{', '.join(before)} and {last}" if before else last
