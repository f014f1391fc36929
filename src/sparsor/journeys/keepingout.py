"""What a mission keeps out of, and the side of the coast that it keeps to: read, and as legs that may not be flown."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import MissionError
from sparsor.geodesy.keepouts import read_keep_outs
from sparsor.geodesy.land import PACKAGED_ACCURACY_M, land_of_file, packaged_land
from sparsor.geodesy.plane import LocalPlane
from sparsor.geodesy.shore import OTHER, Shore, reach_deg, shore_of
from sparsor.geodesy.zones import Zones, zones_of
from sparsor.mission import transits
from sparsor.mission.fence import MAX_CORNERS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.geodesy import Grid
    from sparsor.geodesy.barred import Barred
    from sparsor.journeys.planning import PlannedMission
    from sparsor.mission.specification import MissionSpecification
    from sparsor.vehicle import Autopilot, Vehicle


def mission_zones(spec: MissionSpecification, grid: Grid, vehicle: Vehicle, autopilot: Autopilot) -> Zones | None:
    """Return what a mission keeps out of, None where nothing was asked for.

    What circles gets two turn radii more margin: it comes to its next leg from beside it.

    Raises
    ------
    AreaError
        When a file cannot be read, or there are more keep-outs than the autopilot stores.
    MissionError
        When home lies in one of them or in its margin.
    """
    keep_outs = [one for path in spec.flight.keep_out for one in read_keep_outs(path)]
    if not keep_outs:
        return None
    box = grid.box
    zones = zones_of(
        keep_outs,
        margin_m=spec.flight.keep_out_margin_m + (2.0 * vehicle.turn_radius_m if vehicle.circles else 0.0),
        plane=LocalPlane(box.centre_lon_deg, box.centre_lat_deg),
        most_points=autopilot.on_board(vehicle).max_fence_points - MAX_CORNERS,
        longest_leg_m=float(np.hypot(box.east_m, box.north_m)),
    )
    for home in spec.flight.given_homes:
        if bool(zones.holds(*home)):
            raise MissionError(
                f"home, {home[0]:g} {home[1]:g}, lies in a keep-out ({', '.join(zones.names)}) or within its margin of "
                f"{spec.flight.keep_out_margin_m:g} m: take off elsewhere (--home LON LAT)"
            )
    return zones


def mission_shore(spec: MissionSpecification, grid: Grid) -> Shore | None:
    """Return the coast as the mission keeps to one side of it, None where it does not.

    Raises
    ------
    MissionError
        When the cells are finer than the coastline.
    AreaError
        When there is no coastline of the box, or its file cannot be read.
    """
    asked = spec.coast
    if asked is None or asked.side is None:
        return None
    box, own = grid.box, asked.file
    margin_m = PACKAGED_ACCURACY_M if asked.accuracy_m is None else asked.accuracy_m
    rows, columns = grid.shape
    cell_m = min(box.east_m / columns, box.north_m / rows)
    if cell_m < margin_m:
        better = "a better one (--coastline FILE --coastline-accuracy M)" if own is None else "a better one"
        raise MissionError(
            f"--{asked.side}-only: the cells are {cell_m:.0f} m wide, finer than the coastline, which is good to "
            f"{margin_m:g} m: give {better}, or a box of {_up_km(margin_m * columns)} x {_up_km(margin_m * rows)} km"
        )
    reach = reach_deg(box, margin_m)
    land = packaged_land(box, reach) if own is None else land_of_file(own, box, reach)
    plane = LocalPlane(box.centre_lon_deg, box.centre_lat_deg)
    return shore_of(land, asked.side, box=box, plane=plane, margin_m=margin_m)


def said_of_shore(mission: PlannedMission) -> tuple[str, ...]:
    """Return what has to be said about a mission that keeps to one side of the coast."""
    place, spec = mission.place, mission.specification
    shore, coast = place.shore, spec.coast
    if shore is None or coast is None:
        return ()
    other = OTHER[shore.side]
    good_to = f"{shore.margin_m:g} m"
    if coast.file is None:
        good_to += " (90 % of it, by the specification of its source, the World Vector Shoreline)"
    elif coast.accuracy_m is None:
        good_to += ", as is assumed since nothing was said (--coastline-accuracy)"
    near = int((place.inside & shore.holds(*place.grid.centres_deg())).sum())
    said = [
        f"The coastline ({shore.source}) is good to {good_to}: no stop and no leg between stops comes nearer to the "
        f"{other}; {near} cells of {shore.side} that lie nearer are estimated from around. It is not written as a "
        "fence: no autopilot knows of it."
    ]
    if shore.land.is_empty:
        said.append(f"The coastline ({shore.source}) has no land in or near the box: is it of another place?")
    if any(shore.crosses_other_side(way) for plan in mission.plans for way in transits(plan)):
        cannot = (shore.side, mission.vehicle.kind) in (("sea", "boat"), ("land", "rover"))
        said.append(
            f"The way from or to home passes over the {other}"
            + (f", which a {mission.vehicle.kind} cannot: give --home elsewhere." if cannot else ".")
        )
    if shore.side == "sea" and not spec.flight.given_homes and mission.vehicle.kind != "boat":
        said.append("Home is the first stop, which lies at sea: give --home LON LAT.")
    return tuple(said)


def _up_km(metres: float) -> str:
    return f"{math.ceil(metres / 100) / 10:g}"


def barred_legs(grounds: Sequence[Barred], grid: Grid, allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which legs between cells cross ground that may not be flown over, (N, N)."""
    lon, lat = grid.centres_deg()
    barred = np.zeros((grid.size, grid.size), dtype=np.bool_)
    cells = np.flatnonzero(allowed)
    for place, cell in enumerate(cells.tolist()):
        others = cells[place + 1 :]
        if others.size:
            ends = np.full(others.shape, lon[cell]), np.full(others.shape, lat[cell])
            barred[cell, others] = np.any(
                [ground.crossed(*ends, lon[others], lat[others]) for ground in grounds], axis=0
            )
    return barred | barred.T
