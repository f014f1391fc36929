"""A mission's ground: read, as what its heights are kept above, and what has to be said of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import MissionError
from sparsor.geodesy.terrain import Terrain, read_terrain
from sparsor.mission.clearance import highest_way_home_m, legs_over, terrain_faults
from sparsor.mission.following import REACH_TURNS, Ground, usual_tolerance_m
from sparsor.vehicle import approach_m, climb_out_m

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from sparsor.geodesy import BoundingBox
    from sparsor.mission import Fault, MissionPlan
    from sparsor.mission.clearance import Leg
    from sparsor.mission.specification import MissionSpecification
    from sparsor.vehicle import Vehicle

MARGIN_M = 500.0
HIGHER_CLIMBS = 3.0  # a climb out over rising ground is longer than over level ground
HOME_DIFFERS_M = 20.0
RETURN_ALTITUDES = {
    ("ardupilot", False): "RTL_ALT",
    ("ardupilot", True): "RTL_ALTITUDE (ALT_HOLD_RTL in older versions)",
    ("px4", False): "RTL_RETURN_ALT",
    ("px4", True): "RTL_RETURN_ALT",
}


@dataclass(frozen=True)
class GroundFacts:
    """A flight over the ground, metres.

    Parameters
    ----------
    file : str
        Of the elevation model.
    pixel_m : tuple of float
        Width and height.
    home_m : float
        Height of the ground at home.
    lowest_m, highest_m : float
        Of what is flown along legs, above home.
    least_m, most_m : float
        Least height above the highest ground near, greatest above the ground below.
    way_home_m : float
        How far above home the ground rises at most on the straight ways home.
    passed : int
        Waypoints that are there for the heights only.
    """

    file: str
    pixel_m: tuple[float, float]
    home_m: float
    lowest_m: float
    highest_m: float
    least_m: float
    most_m: float
    way_home_m: float
    passed: int


def mission_ground(spec: MissionSpecification, box: BoundingBox, vehicle: Vehicle) -> Ground | None:
    """Return the ground that a mission follows, None where none was asked for.

    Raises
    ------
    TerrainError
        When the elevation model cannot be used.
    MissionError
        When the vehicle does not fly.
    """
    flight = spec.flight
    if flight.terrain is None:
        return None
    if not vehicle.flies:
        raise MissionError(f"a {vehicle.kind} stays on the ground: leave --terrain out")
    lon, lat = [box.west_deg, box.east_deg], [box.south_deg, box.north_deg]
    if flight.home is not None:
        lon, lat = [*lon, flight.home[0]], [*lat, flight.home[1]]
    margin_m = MARGIN_M
    if vehicle.circles:
        margin_m += 2 * REACH_TURNS * vehicle.turn_radius_m + approach_m(vehicle, flight.altitude_m)
        margin_m += HIGHER_CLIMBS * climb_out_m(vehicle, flight.altitude_m)
    tolerance_m = flight.terrain_tolerance_m
    return Ground(
        read_terrain(flight.terrain, lon, lat, margin_m),
        flight.altitude_m,
        usual_tolerance_m(flight.altitude_m) if tolerance_m is None else tolerance_m,
    )


def terrain_under(path: Path, plan: MissionPlan, vehicle: Vehicle | None) -> Terrain:
    """Return the part of an elevation model that a plan lies over.

    Raises
    ------
    TerrainError
        When it cannot be used.
    """
    placed = [item for item in plan.items if item.has_position and item.params[4:6] != (0.0, 0.0)]
    lon = [plan.home.lon_deg, *(item.lon_deg for item in placed)]
    lat = [plan.home.lat_deg, *(item.lat_deg for item in placed)]
    return read_terrain(path, lon, lat, MARGIN_M + reach_m(vehicle))


def reach_m(vehicle: Vehicle | None) -> float:
    """Return how far beside its legs a vehicle may come."""
    return REACH_TURNS * vehicle.turn_radius_m if vehicle is not None and vehicle.circles else 0.0


def faults_over(
    plan: MissionPlan, terrain: Terrain, least_m: float, vehicle: Vehicle | None, home_m: float
) -> Iterator[Fault]:
    """Yield what is wrong between a plan and the ground; without a vehicle nothing is known of its ceiling."""
    ceiling_m = float("inf") if vehicle is None else vehicle.ceiling_m
    return terrain_faults(plan, terrain, least_m, home_m=home_m, reach_m=reach_m(vehicle), ceiling_m=ceiling_m)


def legs_of(plan: MissionPlan, ground: Ground, vehicle: Vehicle) -> list[Leg]:
    """Return the legs of a plan over the ground that it follows."""
    home_m = ground.home_m((plan.home.lon_deg, plan.home.lat_deg))
    return list(legs_over(plan, ground.terrain, home_m, reach_m(vehicle)))


def check_over(plans: tuple[MissionPlan, ...], ground: Ground, vehicle: Vehicle) -> None:
    """Refuse plans that come too near to the ground.

    Raises
    ------
    MissionError
    """
    found = [
        fault.sentence
        for plan in plans
        for fault in faults_over(
            plan, ground.terrain, ground.least_m, vehicle, ground.home_m((plan.home.lon_deg, plan.home.lat_deg))
        )
        if fault.fails
    ]
    if found:
        raise MissionError(f"the plan fails its checks against the ground and is not written: {' '.join(found)}")


def ground_facts(plans: tuple[MissionPlan, ...], ground: Ground, vehicle: Vehicle) -> GroundFacts:
    """Return what plans fly over."""
    plan, terrain = plans[0], ground.terrain
    home = (plan.home.lon_deg, plan.home.lat_deg)
    home_m = ground.home_m(home)
    legs = [leg for one in plans for leg in legs_of(one, ground, vehicle) if leg.kind == "level"]
    flown = np.concatenate([leg.flown_m for leg in legs])
    over = np.concatenate([leg.flown_m - leg.ground_m for leg in legs])
    return GroundFacts(
        file=terrain.path.name,
        pixel_m=terrain.pixel_m,
        home_m=home_m,
        lowest_m=float(flown.min()) - home_m,
        highest_m=float(flown.max()) - home_m,
        least_m=min(leg.least_m for leg in legs),
        most_m=float(over.max()),
        way_home_m=max(highest_way_home_m(one.items, home, terrain, home_m) for one in plans),
        passed=sum(len(one.passing) for one in plans),
    )


def said_of_ground(
    facts: GroundFacts, plan: MissionPlan, ground: Ground, vehicle: Vehicle, home_altitude_m: float | None
) -> tuple[str, ...]:
    """Return what has to be known of a flight over terrain, in sentences."""
    terrain = ground.terrain
    width, height = facts.pixel_m
    above = f"Its heights: {terrain.vertical}." if terrain.vertical else "What its heights are above it does not say."
    unit = "" if terrain.unit_said else " Nor does it say their unit: metres were taken."
    name = "px4" if plan.autopilot is not None and plan.autopilot.name == "px4" else "ardupilot"
    found = [
        f"The heights are kept above the ground of '{facts.file}', pixels of {width:.3g} x {height:.3g} m: "
        f"{facts.lowest_m:.0f} to {facts.highest_m:.0f} m above home, nowhere less than {facts.least_m:.1f} m above "
        f"that ground. Trees, buildings and wires are not in such a model, or may not be. {above}{unit}",
        f"All heights hang on the ground at home, {facts.home_m:.1f} m in the model: take off there, from the ground.",
        f"A failsafe return flies straight home at an altitude of the vehicle's own "
        f"({RETURN_ALTITUDES[name, vehicle.circles]}), whatever the ground: on the way home it rises to "
        f"{max(facts.way_home_m, 0):.0f} m above home. Set that altitude to "
        f"{plan.rally_points[0].altitude_m:g} m or more, as the rally point has it.",
    ]
    if home_altitude_m is not None and abs(home_altitude_m - facts.home_m) > HOME_DIFFERS_M:
        found.append(
            f"The ground at home is {facts.home_m:.0f} m high in the model, --home-altitude is {home_altitude_m:g} m. "
            "Is home where it should be, and are both above the same (sea level, ellipsoid)?"
        )
    if facts.most_m > vehicle.ceiling_m:
        found.append(
            f"The flight is up to {facts.most_m:.0f} m above the ground, beyond the ceiling of {vehicle.ceiling_m:g} m "
            "in the vehicle profile; find out what is allowed where you fly."
        )
    return tuple(found)
