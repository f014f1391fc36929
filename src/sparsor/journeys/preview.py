"""The picture of a planned mission."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.mission import transits
from sparsor.plot import MissionPicture, mission_preview

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.journeys.planning import PlannedMission


def preview_png(mission: PlannedMission) -> bytes:
    """Return ``preview.png`` of a mission."""
    place, plan = mission.place, mission.plan
    stops = np.array([[stop.lon_deg, stop.lat_deg] for stop in plan.stops])
    home = np.array([plan.home.lon_deg, plan.home.lat_deg])
    fence = plan.fences[0]
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
            transits=_ways(mission),
            home=(float(home[0]), float(home[1])),
            fence=np.column_stack([fence.lon_deg, fence.lat_deg]),
            area=() if place.area is None else _rings(mission),
            outside=None if place.allowed.all() else ~place.allowed,
            caption=_caption(mission),
        )
    )


def _ways(mission: PlannedMission) -> tuple[NDArray[np.float64], ...]:
    """Return the ways from and to home; of sorties each whole flight."""
    if mission.sorties is None:
        return tuple(np.array(way) for way in transits(mission.plan))
    flights = []
    for plan in mission.plans:
        out, back = transits(plan)
        flights.append(np.array([*out, *((stop.lon_deg, stop.lat_deg) for stop in plan.stops[1:]), *back[1:]]))
    return tuple(flights)


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
    found = mission.candidate
    return (
        f"{found.stops.size} stops, {mission.path_length_m / 1000:.1f} km over the stops "
        f"({mission.coverage_fraction:.1%} of full coverage), "
        f"{mission.specification.flight.altitude_m:g} m above {'home' if mission.ground is None else 'the ground'}.",
        f"{mission.flight_time_s / 60:.0f} min in the air; {mission.vehicle.name}: {mission.usable_s / 60:.0f} min "
        f"less its reserve{'' if mission.flyable else ' - a planning study, not flyable'}.",
        f"Expected error {mission.expected_relative_error:.2f} of the map's contrast (|s - s'| / |s - mean(s)|).",
        "Nothing here says that the flight is legal or safe.",
    )
