"""A mission's ground: read, as what its heights are kept above, and what has to be said of it."""

from __future__ import annotations

import math
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
    from sparsor.geodesy.zones import Zones
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
    homes_m : tuple of float
        Height of the ground at each home that is flown from.
    lowest_m, highest_m : float
        Of what is flown along legs, above the home of each flight.
    least_m, most_m : float
        Least height above the highest ground near, greatest above the ground below.
    way_home_m : float
        How far above a flight's home the ground rises at most on the straight ways there.
    return_m : float
        Above home, at which the straight way home of every flight is free.
    passed : int
        Waypoints that are there for the heights only.
    """

    file: str
    pixel_m: tuple[float, float]
    homes_m: tuple[float, ...]
    lowest_m: float
    highest_m: float
    least_m: float
    most_m: float
    way_home_m: float
    return_m: float
    passed: int


def mission_ground(
    spec: MissionSpecification, box: BoundingBox, vehicle: Vehicle, zones: Zones | None = None
) -> Ground | None:
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
    passed = () if zones is None else _turns(zones, box, flight.given_homes)
    for place in (*flight.given_homes, *passed):
        lon, lat = [*lon, place[0]], [*lat, place[1]]
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


def _turns(zones: Zones, box: BoundingBox, homes: tuple[tuple[float, float], ...]) -> Iterator[tuple[float, float]]:
    """Yield the places at which the ways from and to home may turn past keep-outs, some of them outside of the box."""
    lon, lat = [box.west_deg, box.west_deg, box.east_deg, box.east_deg], [box.south_deg, box.north_deg] * 2
    across_m = math.hypot(box.east_m, box.north_m)
    for home in homes or ((box.centre_lon_deg, box.centre_lat_deg),):
        ways_m = zones.lengths_m(home, lon, lat)
        longest_m = float(ways_m[np.isfinite(ways_m)].max(initial=0.0))
        yield from zones.turns_near(home, longest_m + across_m)


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
    home_m = ground.home_m(plan.home.place)
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
        for fault in faults_over(plan, ground.terrain, ground.least_m, vehicle, ground.home_m(plan.home.place))
        if fault.fails
    ]
    if found:
        raise MissionError(f"the plan fails its checks against the ground and is not written: {' '.join(found)}")


def ground_facts(plans: tuple[MissionPlan, ...], ground: Ground, vehicle: Vehicle) -> GroundFacts:
    """Return what plans fly over."""
    terrain = ground.terrain
    homes = [plan.home.place for plan in plans]
    homes_m = [ground.home_m(home) for home in homes]
    legs = [
        (leg, home_m)
        for plan, home_m in zip(plans, homes_m, strict=True)
        for leg in legs_of(plan, ground, vehicle)
        if leg.kind == "level"
    ]
    flown = np.concatenate([leg.flown_m - home_m for leg, home_m in legs])
    over = np.concatenate([leg.flown_m - leg.ground_m for leg, _ in legs])
    return GroundFacts(
        file=terrain.path.name,
        pixel_m=terrain.pixel_m,
        homes_m=tuple(dict(zip(homes, homes_m, strict=True)).values()),
        lowest_m=float(flown.min()),
        highest_m=float(flown.max()),
        least_m=min(leg.least_m for leg, _ in legs),
        most_m=float(over.max()),
        way_home_m=max(
            highest_way_home_m(plan.items, home, terrain, home_m)
            for plan, home, home_m in zip(plans, homes, homes_m, strict=True)
        ),
        return_m=max(plan.rally_points[0].altitude_m for plan in plans),
        passed=sum(len(plan.passing) for plan in plans),
    )


def _hang_on_home(facts: GroundFacts) -> str:
    if len(facts.homes_m) == 1:
        return (
            f"All heights hang on the ground at home, {facts.homes_m[0]:.1f} m in the model: take off there, from the "
            "ground."
        )
    heights = ", ".join(f"{height_m:.1f}" for height_m in facts.homes_m)
    return (
        f"The heights of each flight hang on the ground at its own home, {heights} m in the model: take off from the "
        "home of the plan that is flown, from the ground, and from no other."
    )


def said_of_ground(
    facts: GroundFacts, plans: tuple[MissionPlan, ...], ground: Ground, vehicle: Vehicle, home_altitude_m: float | None
) -> tuple[str, ...]:
    """Return what has to be known of a flight over terrain, in sentences."""
    terrain = ground.terrain
    width, height = facts.pixel_m
    above = f"Its heights: {terrain.vertical}." if terrain.vertical else "What its heights are above it does not say."
    unit = "" if terrain.unit_said else " Nor does it say their unit: metres were taken."
    autopilot = plans[0].autopilot
    name = "px4" if autopilot is not None and autopilot.name == "px4" else "ardupilot"
    found = [
        f"The heights are kept above the ground of '{facts.file}', pixels of {width:.3g} x {height:.3g} m: "
        f"{facts.lowest_m:.0f} to {facts.highest_m:.0f} m above home, nowhere less than {facts.least_m:.1f} m above "
        f"that ground. Trees, buildings and wires are not in such a model, or may not be. {above}{unit}",
        _hang_on_home(facts),
        f"A failsafe return flies straight home at an altitude of the vehicle's own "
        f"({RETURN_ALTITUDES[name, vehicle.circles]}), whatever the ground: on the way home it rises to "
        f"{max(facts.way_home_m, 0):.0f} m above home. Set that altitude to {facts.return_m:g} m or more, as the "
        f"{'highest ' if len(plans) > 1 else ''}rally point has it.",
    ]
    given_m = home_altitude_m
    wrong = [one for one in facts.homes_m if given_m is not None and abs(given_m - one) > HOME_DIFFERS_M]
    if wrong:
        found.append(
            f"The ground at home is {wrong[0]:.0f} m high in the model, --home-altitude is {given_m:g} m. "
            "Is home where it should be, and are both above the same (sea level, ellipsoid)?"
        )
    if facts.most_m > vehicle.ceiling_m:
        found.append(
            f"The flight is up to {facts.most_m:.0f} m above the ground, beyond the ceiling of {vehicle.ceiling_m:g} m "
            "in the vehicle profile; find out what is allowed where you fly."
        )
    return tuple(found)
