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
from sparsor.journeys.groundwork import mission_ground
from sparsor.journeys.keepingout import barred_legs, mission_zones
from sparsor.journeys.legtimes import home_seconds, leg_seconds_between
from sparsor.journeys.modelling import PriorChoice, choose_prior
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
    from numpy.typing import NDArray

    from sparsor.core.workers import Workers
    from sparsor.geodesy.zones import Zones
    from sparsor.mission.following import Ground
    from sparsor.mission.specification import MissionSpecification


@dataclass(frozen=True)
class Place:
    """Where a mission is flown: the grid, the area it was asked for, the cells inside, what is kept out of."""

    grid: Grid
    area: Area | None
    allowed: NDArray[np.bool_]
    full_coverage_m: float
    zones: Zones | None = None


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
        home = None
        if spec.flight.home is not None:
            home = home_seconds(self.place, spec.flight.home, self.vehicle, self.speed_m_s, self.wind)
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
    autopilot, sensor = autopilot_named(spec.flight.autopilot), _sensor(spec)
    check_triggers(spec.flight.triggers, autopilot)
    box, area = _where(spec)
    ground = mission_ground(spec, box, vehicle)
    prior = choose_prior(spec.prior, box, paper=spec.search.paper, workers=workers, progress=progress)
    grid = Grid(box, prior.model.shape)
    place = _place(grid, area, mission_zones(spec, grid, vehicle, autopilot))
    speed = vehicle.cruise_m_s if spec.flight.speed_m_s is None else spec.flight.speed_m_s
    wind = spec.flight.steady_wind
    check_wind(vehicle, wind, speed)
    legs = _legs(place, vehicle, speed, wind)
    return Prepared(place, prior, legs, vehicle, autopilot, sensor, speed, wind, ground)


def _sensor(spec: MissionSpecification) -> SensorProfile | None:
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


def _place(grid: Grid, area: Area | None, zones: Zones | None) -> Place:
    allowed = np.ones(grid.size, dtype=np.bool_) if area is None else cells_inside(grid, area)
    if zones is not None:
        allowed = allowed & ~zones.holds(*grid.centres_deg())
    if int(allowed.sum()) < 2:
        kept = " outside of what is kept out of" if zones is not None else ""
        raise MissionError(f"the area holds the centre of one cell at most{kept}; draw a larger one")
    return Place(grid, area, allowed, grid.full_coverage_m(allowed), zones)


def _legs(place: Place, vehicle: Vehicle, speed_m_s: float, wind: SteadyWind) -> LegTable:
    length_m = place.grid.lengths_m()
    cell_unit_m = place.full_coverage_m / (int(place.allowed.sum()) - 1)
    seconds = leg_seconds_between(place.grid, length_m, vehicle, speed_m_s, wind)
    table = LegTable(place.grid.shape, length_m, seconds, cell_unit_m, place.allowed)
    return table.kept_inside(None if place.zones is None else barred_legs(place.zones, place.grid, place.allowed))
