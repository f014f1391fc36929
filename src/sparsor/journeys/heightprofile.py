"""The picture of a mission's heights over the ground that it follows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.journeys.groundwork import legs_of
from sparsor.plot import HeightProfile, height_profile_png

if TYPE_CHECKING:
    from sparsor.journeys.planning import PlannedMission


def terrain_png(mission: PlannedMission) -> bytes:
    """Return ``terrain.png`` of a mission over terrain; of sorties all, one after the other, each above its home."""
    ground = mission.ground
    assert ground is not None
    along, below, least, flown, ends = [], [], [], [], []
    before_m = 0.0
    for plan in mission.plans:
        home_m = ground.home_m(plan.home.place)
        stops = {(stop.lon_deg, stop.lat_deg) for stop in plan.stops}
        for leg in legs_of(plan, ground, mission.vehicle):
            if leg.kind != "level":
                continue
            along.append(before_m + leg.along_m)
            below.append(leg.ground_m - home_m)
            least.append(leg.highest_m + ground.least_m - home_m)
            flown.append(leg.flown_m - home_m)
            before_m += float(leg.along_m[-1])
            ends.append((before_m, leg.flown_m[-1] - home_m, leg.to in stops))
    points = np.array(ends, dtype=np.float64)
    is_stop = points[:, 2] > 0
    return height_profile_png(
        HeightProfile(
            title=mission.specification.name,
            along_km=np.concatenate(along) / 1000,
            ground_m=np.concatenate(below),
            least_m=np.concatenate(least),
            flown_m=np.concatenate(flown),
            stops_km=points[is_stop, 0] / 1000,
            stops_m=points[is_stop, 1],
            turns_km=points[~is_stop, 0] / 1000,
            turns_m=points[~is_stop, 1],
            height_m=ground.height_m,
        )
    )
