"""A mission's keep-outs: read, as zones, and as legs that may not be flown."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import MissionError
from sparsor.geodesy.keepouts import read_keep_outs
from sparsor.geodesy.plane import LocalPlane
from sparsor.geodesy.zones import Zones, zones_of
from sparsor.mission.fence import MAX_CORNERS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.geodesy import Grid
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


def barred_legs(zones: Zones, grid: Grid, allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which legs between cells cross a keep-out or its margin, (N, N)."""
    lon, lat = grid.centres_deg()
    barred = np.zeros((grid.size, grid.size), dtype=np.bool_)
    cells = np.flatnonzero(allowed)
    for place, cell in enumerate(cells.tolist()):
        others = cells[place + 1 :]
        if others.size:
            ends = np.full(others.shape, lon[cell]), np.full(others.shape, lat[cell])
            barred[cell, others] = zones.crossed(*ends, lon[others], lat[others])
    return barred | barred.T
