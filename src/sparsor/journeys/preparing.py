"""What a mission is planned with: where it is, what maps look like there, what flies and what measures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.design import Budget, LegTable, Problem, parse_budget
from sparsor.design.sparsity import check_sparsity
from sparsor.errors import MissionError
from sparsor.geodesy import BoundingBox, Grid
from sparsor.geodesy.areas import Area, cells_inside, read_area
from sparsor.geodesy.shore import OTHER
from sparsor.journeys.flown import folder_sidecar
from sparsor.journeys.groundwork import mission_ground
from sparsor.journeys.keepingout import barred_legs, mission_shore, mission_zones
from sparsor.journeys.legtimes import home_seconds, leg_seconds_between
from sparsor.journeys.modelling import PriorChoice, choose_prior, size_difference
from sparsor.mission.specification import PAPER_ROWS
from sparsor.mission.triggers import check_triggers
from sparsor.vehicle import (
    CALM,
    Autopilot,
    SensorProfile,
    SteadyWind,
    Vehicle,
    autopilot_named,
    check_wind,
    flight_seconds,
    load_sensor,
    load_vehicle,
    stop_seconds,
)

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from sparsor.core.workers import Workers
    from sparsor.geodesy.shore import Shore
    from sparsor.geodesy.zones import Zones
    from sparsor.mission.following import Ground
    from sparsor.mission.specification import MissionSpecification


@dataclass(frozen=True)
class Place:
    """Where a mission is flown.

    Parameters
    ----------
    grid : Grid
    area : Area or None
        That was asked for, where it is not the whole box.
    inside : array of bool (N,)
        Cells of the area: the map and its error are over these.
    allowed : array of bool (N,)
        Those of them that may be flown: the others, in a keep-out, are estimated from around it.
    full_coverage_m : float
        Over the cells that may be flown.
    zones : Zones or None
        What is kept out of.
    shore : Shore or None
        Land or sea, where one of them alone was asked for: cells on the other side are not in the map, as those outside
        of an area; those on this side within the coastline's accuracy are in it, and are not flown to.
    """

    grid: Grid
    area: Area | None
    inside: NDArray[np.bool_]
    allowed: NDArray[np.bool_]
    full_coverage_m: float
    zones: Zones | None = None
    shore: Shore | None = None


@dataclass(frozen=True)
class Prepared:
    """What the search for a route, and all that comes after it, is given.

    Parameters
    ----------
    place : Place
    prior : PriorChoice
    legs : LegTable
        Metres, and seconds at the mission's speed in its wind.
    vehicle : Vehicle
    autopilot : Autopilot
    sensor : SensorProfile or None
        None when nothing was said of it and the planner does without.
    speed_m_s : float
        Along legs.
    wind : SteadyWind
    ground : Ground or None
        That heights are kept above.
    """

    place: Place
    prior: PriorChoice
    legs: LegTable
    vehicle: Vehicle
    autopilot: Autopilot
    sensor: SensorProfile | None
    speed_m_s: float
    wind: SteadyWind = CALM
    ground: Ground | None = None

    def hold(self, spec: MissionSpecification) -> tuple[float, float]:
        """Return one hold at a stop, as it is written, and the braking that goes with it, both seconds."""
        hold_s = self.autopilot.written_hold_s(spec.flight.hold_s)
        return hold_s, stop_seconds(self.vehicle, hold_s, self.speed_m_s) - hold_s

    def budget(self, spec: MissionSpecification) -> Budget | None:
        """Return the mission's budget in the terms of its legs."""
        if spec.search.budget is None:
            return None
        asked = parse_budget(spec.search.budget)
        if asked.measure == "fraction":
            return Budget(asked.value * self.place.full_coverage_m, "distance")
        if asked.measure == "distance":
            return Budget(asked.value, "distance")
        # The home that is nearest on the whole: the flight's is the one that takes least of all, so no more than it.
        ways = [
            home_seconds(self.place, home, self.vehicle, self.speed_m_s, self.wind) for home in spec.flight.given_homes
        ]
        home = min(ways, key=lambda way: float(way[self.place.allowed].mean()), default=None)
        fixed = flight_seconds(
            self.vehicle,
            path_length_m=0.0,
            transit_m=0.0,
            stops=0,
            hold_s=0.0,
            altitude_m=spec.flight.altitude_m,
            speed_m_s=self.speed_m_s - (self.wind.speed_m_s if self.vehicle.circles else 0.0),
        )
        return Budget(asked.value, "time", sum(self.hold(spec)), fixed, home)

    def problem(self, spec: MissionSpecification) -> Problem:
        """Return the mission's problem as Algorithm 1 sees it."""
        model, asked = self.prior.model, spec.search
        rows = asked.rows or PAPER_ROWS
        check_sparsity(asked.probability, asked.theta, rows)
        return Problem(
            psi=model.dictionary,
            maps=model.validation - model.mean,
            lasso_weight=model.lasso_weight if asked.lasso is None else asked.lasso,
            legs=self.legs,
            rows=rows,
            budget=self.budget(spec),
            unit_rows=not asked.paper,
            improve=not asked.paper,
            mapped=self.place.inside,
        )


def prepare(spec: MissionSpecification, *, workers: Workers | int = 1, progress: Progress = silent) -> Prepared:
    """Return what a mission is planned with.

    Parameters
    ----------
    spec : MissionSpecification
    workers : Workers or int
        Who learns, where something has to be learned.
    progress : Progress

    Raises
    ------
    InputError
        When something asked for is wrong.
    """
    vehicle = load_vehicle(spec.flight.vehicle)
    autopilot, sensor = autopilot_named(spec.flight.autopilot), sensor_of(spec)
    check_triggers(spec.flight.triggers, autopilot)
    box, area = _where(spec)
    if spec.resume is None:
        prior = choose_prior(spec.prior, box, paper=spec.search.paper, workers=workers, progress=progress)
    else:
        prior = _prior_flown(spec, box, spec.resume.mission)
    grid = Grid(box, prior.model.shape)
    zones = mission_zones(spec, grid, vehicle, autopilot)
    ground = mission_ground(spec, box, vehicle, zones)
    place = _place(grid, area, zones, mission_shore(spec, grid))
    speed = vehicle.cruise_m_s if spec.flight.speed_m_s is None else spec.flight.speed_m_s
    wind = spec.flight.steady_wind
    check_wind(vehicle, wind, speed)
    legs = _legs(place, vehicle, speed, wind)
    return Prepared(place, prior, legs, vehicle, autopilot, sensor, speed, wind, ground)


def _prior_flown(spec: MissionSpecification, box: BoundingBox, folder: Path) -> PriorChoice:
    """Return the model that the mission that is resumed was planned with: its sidecar holds it."""
    path, sidecar = folder_sidecar(folder)
    if sidecar.grid.box != box:
        sides = " ".join(f"{side:g}" for side in sidecar.grid.box.as_tuple())
        raise MissionError(
            f"the area is not that of the mission that is resumed: '{path}' was planned over {sides}; leave the area "
            "as it was, or plan a mission of its own"
        )
    widening, _ = size_difference(sidecar.model, box)
    return PriorChoice(sidecar.model, None, (spec.prior.field, spec.prior.model) == (None, None), widening, ())


def sensor_of(spec: MissionSpecification) -> SensorProfile | None:
    """Return the sensor; the refined search plans for the packaged one where nothing is said, Algorithm 1 for none."""
    if spec.sensor is None:
        return load_sensor() if spec.search.planner == "refined" else None
    if spec.sensor.profile is not None:
        return load_sensor(spec.sensor.profile)
    return load_sensor().model_copy(update={"t90_s": spec.sensor.t90_s})


def _where(spec: MissionSpecification) -> tuple[BoundingBox, Area | None]:
    if spec.area.bbox is not None:
        return BoundingBox(*spec.area.bbox), None
    assert spec.area.file is not None
    area = read_area(spec.area.file)
    return area.box, None if area.is_box else area


def _place(grid: Grid, area: Area | None, zones: Zones | None, shore: Shore | None) -> Place:
    centres = grid.centres_deg()
    inside = np.ones(grid.size, dtype=np.bool_) if area is None else cells_inside(grid, area)
    if shore is not None:
        inside = inside & shore.asked_for(*centres)
    allowed = inside if zones is None else inside & ~zones.holds(*centres)
    if shore is not None:
        allowed = allowed & ~shore.holds(*centres)
    if int(allowed.sum()) < 2:
        kept = "" if shore is None else f" of {shore.side} {shore.margin_m:g} m or more from the {OTHER[shore.side]}"
        kept += " outside of what is kept out of" if zones is not None else ""
        raise MissionError(f"the area holds the centre of one cell at most{kept}; draw a larger one")
    return Place(grid, area, inside, allowed, grid.full_coverage_m(allowed), zones, shore)


def _legs(place: Place, vehicle: Vehicle, speed_m_s: float, wind: SteadyWind) -> LegTable:
    length_m = place.grid.lengths_m()
    cell_unit_m = place.full_coverage_m / (int(place.allowed.sum()) - 1)
    seconds = leg_seconds_between(place.grid, length_m, vehicle, speed_m_s, wind)
    table = LegTable(place.grid.shape, length_m, seconds, cell_unit_m, place.allowed)
    grounds = [ground for ground in (place.zones, place.shore) if ground is not None]
    return table.kept_inside(barred_legs(grounds, place.grid, place.allowed) if grounds else None)
