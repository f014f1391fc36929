"""From what was asked for to a planned mission."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.design import (
    Budget,
    LegTable,
    Problem,
    Weights,
    fixed_sparsity,
    parse_budget,
    search,
    searched_sparsity,
)
from sparsor.design.expectation import expected_errors
from sparsor.design.sparsity import check_sparsity
from sparsor.design.tuning import comparable_weights, pilot
from sparsor.errors import MissionError
from sparsor.geodesy import BoundingBox, Grid
from sparsor.geodesy.areas import Area, cells_inside, read_area
from sparsor.geodesy.lengths import distance_m
from sparsor.journeys.advice import advice
from sparsor.journeys.modelling import PriorChoice, choose_prior
from sparsor.journeys.refining import refined_task, search_refined
from sparsor.mission import Home, MissionPlan, build_mission
from sparsor.vehicle import (
    Autopilot,
    SensorProfile,
    Vehicle,
    autopilot_named,
    flight_seconds,
    load_sensor,
    load_vehicle,
    stop_seconds,
    usable_seconds,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from sparsor.design import Candidate
    from sparsor.design.problem import Sparsity
    from sparsor.mission.specification import MissionSpecification


@dataclass(frozen=True)
class Place:
    """Where a mission is flown: the grid, the area it was asked for, the cells inside."""

    grid: Grid
    area: Area | None
    allowed: NDArray[np.bool_]
    full_coverage_m: float


@dataclass(frozen=True)
class PlannedMission:
    """A planned mission, before or after it was written.

    Parameters
    ----------
    specification : MissionSpecification
    place : Place
    prior : PriorChoice
    vehicle : Vehicle
    sensor : SensorProfile or None
        None when nothing was said of it.
    candidate : Candidate
        The winner of the search.
    weights : Weights
        Of the cost it won by.
    plan : MissionPlan
    path_length_m : float
        Of the open path over the stops.
    flown_length_m : float
        The same with the ways from and to home.
    flight_time_s : float
        From take-off to landing.
    expected_relative_error : float
        Mean of ``|s - s_hat| / |s - mean(s)|`` over the validation maps, decoded from the sums of Phi; of the refined
        search by the best linear decoder from every cell flown over.
    expected_relative_error_cells : float
        The same, decoded from the single cells.
    warnings : tuple of str
    """

    specification: MissionSpecification
    place: Place
    prior: PriorChoice
    vehicle: Vehicle
    sensor: SensorProfile | None
    candidate: Candidate
    weights: Weights
    plan: MissionPlan
    path_length_m: float
    flown_length_m: float
    flight_time_s: float
    cells_flown_over: int
    expected_relative_error: float
    expected_relative_error_cells: float
    warnings: tuple[str, ...]

    @property
    def usable_s(self) -> float:
        """Endurance less the reserve, seconds."""
        return usable_seconds(self.vehicle)

    @property
    def flyable(self) -> bool:
        """Whether the flight fits into the vehicle's endurance less its reserve."""
        return self.flight_time_s <= self.usable_s

    @property
    def coverage_fraction(self) -> float:
        """Path length over that of full coverage."""
        return self.path_length_m / self.place.full_coverage_m


def plan_mission(
    spec: MissionSpecification, *, workers: int | None = None, progress: Progress = silent
) -> PlannedMission:
    """Plan a mission; nothing is written.

    Parameters
    ----------
    spec : MissionSpecification
    workers : int, optional
        Threads of the search, one a core by default; the answer is the same for any number.
    progress : Progress

    Raises
    ------
    InputError
        When something asked for is wrong, or no route meets the budget.
    """
    vehicle, autopilot = load_vehicle(spec.flight.vehicle), autopilot_named(spec.flight.autopilot)
    sensor = _sensor(spec)
    box, area = _where(spec)
    prior = choose_prior(spec.prior, box, paper=spec.search.paper, progress=progress)
    place = _place(Grid(box, prior.model.shape), area)
    legs = _legs(place, _speed(spec, vehicle))
    problem = _problem(spec, prior, legs, _budget(spec, vehicle, autopilot, place))
    count = workers or os.cpu_count() or 1
    if spec.search.planner == "refined":
        weights = Weights()
        speed = _speed(spec, vehicle)
        hold_s = autopilot.written_hold_s(spec.flight.hold_s)
        braking_s = stop_seconds(vehicle, hold_s, speed) - hold_s
        task = refined_task(prior.model, problem, sensor or load_sensor(), hold_s=hold_s, braking_s=braking_s)
        candidate, error = search_refined(task, spec, prior.model, workers=count, progress=progress)
        expected = (error, error)
    else:
        sparsity = _sparsity(spec, problem)
        weights = _weights(spec, problem, sparsity)
        candidate = search(
            problem,
            sparsity,
            weights,
            seed=spec.search.seed,
            iterations=spec.search.iterations,
            seconds=spec.search.time_s,
            workers=count,
            progress=progress,
        )
        expected = expected_errors(problem, candidate, prior.model.mean)
    return _assemble(spec, place, prior, vehicle, sensor, autopilot, problem, weights, candidate, expected)


def _sensor(spec: MissionSpecification) -> SensorProfile | None:
    if spec.sensor is None:
        return None
    if spec.sensor.profile is not None:
        return load_sensor(spec.sensor.profile)
    return load_sensor().model_copy(update={"t90_s": spec.sensor.t90_s})


def _where(spec: MissionSpecification) -> tuple[BoundingBox, Area | None]:
    if spec.area.bbox is not None:
        return BoundingBox(*spec.area.bbox), None
    assert spec.area.file is not None
    area = read_area(spec.area.file)
    return area.box, None if area.is_box else area


def _place(grid: Grid, area: Area | None) -> Place:
    allowed = np.ones(grid.size, dtype=np.bool_) if area is None else cells_inside(grid, area)
    if int(allowed.sum()) < 2:
        raise MissionError("the area holds the centre of one cell only; draw a larger one")
    return Place(grid, area, allowed, grid.full_coverage_m(allowed))


def _speed(spec: MissionSpecification, vehicle: Vehicle) -> float:
    return vehicle.cruise_m_s if spec.flight.speed_m_s is None else spec.flight.speed_m_s


def _legs(place: Place, speed_m_s: float) -> LegTable:
    length_m = place.grid.lengths_m()
    cell_unit_m = place.full_coverage_m / (int(place.allowed.sum()) - 1)
    return LegTable(place.grid.shape, length_m, length_m / speed_m_s, cell_unit_m, place.allowed).kept_inside()


def _budget(spec: MissionSpecification, vehicle: Vehicle, autopilot: Autopilot, place: Place) -> Budget | None:
    if spec.search.budget is None:
        return None
    asked = parse_budget(spec.search.budget)
    if asked.measure == "fraction":
        return Budget(asked.value * place.full_coverage_m, "distance")
    if asked.measure == "distance":
        return Budget(asked.value, "distance")
    speed, hold_s = _speed(spec, vehicle), autopilot.written_hold_s(spec.flight.hold_s)
    home = None
    if spec.flight.home is not None:
        home = distance_m(*spec.flight.home, *place.grid.centres_deg()) / speed
    fixed = flight_seconds(
        vehicle,
        path_length_m=0.0,
        transit_m=0.0,
        stops=0,
        hold_s=hold_s,
        altitude_m=spec.flight.altitude_m,
        speed_m_s=speed,
    )
    return Budget(asked.value, "time", stop_seconds(vehicle, hold_s, speed), fixed, home)


def _problem(spec: MissionSpecification, prior: PriorChoice, legs: LegTable, budget: Budget | None) -> Problem:
    model, asked = prior.model, spec.search
    check_sparsity(asked.probability, asked.theta, asked.rows)
    return Problem(
        psi=model.dictionary,
        maps=model.validation - model.mean,
        lasso_weight=model.lasso_weight if asked.lasso is None else asked.lasso,
        legs=legs,
        rows=asked.rows,
        budget=budget,
        unit_rows=not asked.paper,
        improve=not asked.paper,
    )


def _sparsity(spec: MissionSpecification, problem: Problem) -> Sparsity:
    asked = spec.search
    if asked.probability is not None and asked.theta is not None:
        return fixed_sparsity(asked.probability, asked.theta)
    legs = problem.legs
    cells = int(legs.allowed.sum())
    stops = cells if problem.budget is None else problem.budget.stops_within(legs)
    return searched_sparsity(stops, cells, problem.rows, probability=asked.probability, theta=asked.theta)


def _weights(spec: MissionSpecification, problem: Problem, sparsity: Sparsity) -> Weights:
    """Within a budget the path and the incoherence cost nothing unless their weights are given."""
    asked = spec.search
    path, incoherence = asked.lambda_path, asked.lambda_incoh
    if problem.budget is not None:
        path, incoherence = path or 0.0, incoherence or 0.0
    if path is not None and incoherence is not None:
        return comparable_weights([], valid=asked.lambda_valid, path=path, incoherence=incoherence)
    drawn = pilot(problem, sparsity, seed=asked.seed)
    return comparable_weights(drawn, valid=asked.lambda_valid, path=path, incoherence=incoherence)


def _assemble(
    spec: MissionSpecification,
    place: Place,
    prior: PriorChoice,
    vehicle: Vehicle,
    sensor: SensorProfile | None,
    autopilot: Autopilot,
    problem: Problem,
    weights: Weights,
    candidate: Candidate,
    expected: tuple[float, float],
) -> PlannedMission:
    candidate = _nearer_end_first(spec, place, candidate)
    flight, stops = spec.flight, candidate.stops
    lon, lat = place.grid.centres_deg(stops)
    plan = build_mission(
        lon,
        lat,
        vehicle=vehicle,
        autopilot=autopilot,
        altitude_m=flight.altitude_m,
        home=_home(spec, float(lon[0]), float(lat[0])),
        speed_m_s=flight.speed_m_s,
        hold_s=_holds_s(flight.hold_s, candidate, autopilot),
        fence_margin_m=flight.fence_margin_m,
    )
    path_m = problem.legs.path_length(stops)
    transit = distance_m(plan.home.lon_deg, plan.home.lat_deg, lon[[0, -1]], lat[[0, -1]]).sum()
    seconds = flight_seconds(
        vehicle,
        path_length_m=path_m,
        transit_m=float(transit),
        stops=stops.size,
        hold_s=[stop.hold_s for stop in plan.stops],
        altitude_m=flight.altitude_m,
        speed_m_s=_speed(spec, vehicle),
    )
    mission = PlannedMission(
        specification=spec,
        place=place,
        prior=prior,
        vehicle=vehicle,
        sensor=sensor,
        candidate=candidate,
        weights=weights,
        plan=plan,
        path_length_m=path_m,
        flown_length_m=path_m + float(transit),
        flight_time_s=seconds,
        cells_flown_over=problem.legs.cells_under(stops).size,
        expected_relative_error=expected[0] * prior.widening,
        expected_relative_error_cells=expected[1] * prior.widening,
        warnings=(),
    )
    return replace(mission, warnings=(*advice(mission), *plan.warnings, *prior.warnings))


def _nearer_end_first(spec: MissionSpecification, place: Place, candidate: Candidate) -> Candidate:
    """Return the candidate with its path turned so that it begins at the end nearer home."""
    if spec.flight.home is None:
        return candidate
    first_m, last_m = distance_m(*spec.flight.home, *place.grid.centres_deg(candidate.stops[[0, -1]]))
    if last_m >= first_m:
        return candidate
    dwells = None if candidate.dwells is None else candidate.dwells[::-1].copy()
    return replace(candidate, stops=candidate.stops[::-1].copy(), dwells=dwells)


def _holds_s(hold_s: float, candidate: Candidate, autopilot: Autopilot) -> ArrayLike:
    """Return the hold at all stops, or at each, seconds."""
    return hold_s if candidate.dwells is None else autopilot.written_hold_s(hold_s) * candidate.dwells


def _home(spec: MissionSpecification, first_lon: float, first_lat: float) -> Home:
    lon, lat = spec.flight.home or (first_lon, first_lat)
    altitude = spec.flight.home_altitude_m
    return Home(lon, lat, altitude or 0.0, altitude_known=altitude is not None)
