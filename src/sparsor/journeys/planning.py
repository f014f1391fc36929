"""From a box on the map to a mission folder."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.files import write_files
from sparsor.core.progress import Progress, silent
from sparsor.design import Budget, LegTable, Problem, fixed_sparsity, parse_budget, search, searched_sparsity
from sparsor.design.expectation import expected_errors
from sparsor.design.sparsity import check_sparsity
from sparsor.design.tuning import comparable_weights, pilot
from sparsor.errors import MissionError
from sparsor.geodesy import BoundingBox, Grid
from sparsor.geodesy.areas import Area, cells_inside, read_area
from sparsor.geodesy.lengths import distance_m
from sparsor.journeys.modelling import PriorChoice, choose_prior
from sparsor.mission import FORMATS, Home, MissionPlan, build_mission, export_bytes, plan_bytes
from sparsor.mission.sidecar import Sidecar, content_hash, sidecar_npz
from sparsor.mission.specification import MissionSpecification, read_specification, specification_toml
from sparsor.vehicle import (
    Autopilot,
    Vehicle,
    autopilot_named,
    flight_seconds,
    load_vehicle,
    stop_seconds,
    usable_seconds,
)

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from sparsor.design import Candidate, Weights
    from sparsor.design.monte_carlo import Sparsity

SPECIFICATION_FILE = "mission.toml"
PREVIEW_FILE = "preview.png"
_HARDLY_BETTER = 0.9
_FAR_HOME = 3.0  # diagonals of the box


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
    candidate : Candidate
        The winner of the search.
    weights : Weights
        Of the cost it won by.
    plan : MissionPlan
    path_length_m : float
        Of the open path over the stops.
    flight_time_s : float
        From take-off to landing.
    expected_relative_error : float
        Mean of ``|s - s_hat| / |s - mean(s)|`` over the validation maps, decoded from the sums of Phi.
    expected_relative_error_cells : float
        The same, decoded from the single cells.
    warnings : tuple of str
    """

    specification: MissionSpecification
    place: Place
    prior: PriorChoice
    vehicle: Vehicle
    candidate: Candidate
    weights: Weights
    plan: MissionPlan
    path_length_m: float
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
    box, area = _where(spec)
    prior = choose_prior(spec.prior, box, paper=spec.search.paper, progress=progress)
    place = _place(Grid(box, prior.model.shape), area)
    legs = _legs(place, _speed(spec, vehicle))
    problem = _problem(spec, prior, legs, _budget(spec, vehicle, autopilot, place))
    sparsity = _sparsity(spec, problem)
    weights = _weights(spec, problem, sparsity)
    candidate = search(
        problem,
        sparsity,
        weights,
        seed=spec.search.seed,
        iterations=spec.search.iterations,
        seconds=spec.search.time_s,
        workers=workers or os.cpu_count() or 1,
        progress=progress,
    )
    return _assemble(spec, place, prior, vehicle, autopilot, problem, weights, candidate)


def write_mission(mission: PlannedMission, folder: Path, *, preview: bool = True) -> dict[str, Path]:
    """Write a mission's folder, all of its files or none; return what is where.

    Plans, sidecar and exports of the mission that was there before and that this one does not make are removed,
    so that no old route lies beside the new one.

    Raises
    ------
    OutputError
        When the folder cannot be written.
    """
    name = mission.specification.name
    contents = {SPECIFICATION_FILE: specification_toml(mission.specification, folder)}
    contents[f"{name}.plan"] = plan_bytes(mission.plan)
    for export in mission.specification.output.export:
        contents[f"{name}.{export}"] = export_bytes(mission.plan, name, export)
    hashes = {file: content_hash(content) for file, content in contents.items() if file.endswith(".plan")}
    contents[f"{name}.npz"] = sidecar_npz(_sidecar(mission, hashes))
    if preview:
        from sparsor.journeys.preview import preview_png

        contents[PREVIEW_FILE] = preview_png(mission)
    stale = _files_before(folder, name) - contents.keys()
    write_files(folder, contents)
    for file in stale:
        (folder / file).unlink(missing_ok=True)
    return {file: folder / file for file in contents}


def check_folder(spec: MissionSpecification, folder: Path, *, force: bool) -> None:
    """Refuse to write over another mission: a folder is free when it is empty or asks for the same.

    Raises
    ------
    MissionError
    """
    for path in (folder, *folder.parents):
        if path.is_file():
            raise MissionError(f"'{path}' is a file; give a folder with -o")
    if force or not folder.exists() or not any(folder.iterdir()):
        return
    if (folder / SPECIFICATION_FILE).is_file():
        try:
            same = read_specification(folder / SPECIFICATION_FILE) == spec
        except MissionError:
            same = False
        if same:
            return
    raise MissionError(
        f"'{folder}' holds something else already: choose another --name or -o, or write over it with --force"
    )


def _files_before(folder: Path, name: str) -> set[str]:
    """Return the names of what an earlier mission in a folder consists of, beside specification and picture."""
    names = {name}
    with suppress(MissionError):
        names.add(read_specification(folder / SPECIFICATION_FILE).name)
    return {f"{name}.{suffix}" for name in names for suffix in ("plan", "npz", *FORMATS)}


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
    return LegTable(place.grid.shape, length_m, length_m / speed_m_s, cell_unit_m, place.allowed)


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
    autopilot: Autopilot,
    problem: Problem,
    weights: Weights,
    candidate: Candidate,
) -> PlannedMission:
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
        hold_s=flight.hold_s,
        fence_margin_m=flight.fence_margin_m,
    )
    sums, cells = expected_errors(problem, candidate, prior.model.mean)
    path_m = problem.legs.path_length(stops)
    transit = distance_m(plan.home.lon_deg, plan.home.lat_deg, lon[[0, -1]], lat[[0, -1]]).sum()
    seconds = flight_seconds(
        vehicle,
        path_length_m=path_m,
        transit_m=float(transit),
        stops=stops.size,
        hold_s=autopilot.written_hold_s(flight.hold_s),
        altitude_m=flight.altitude_m,
        speed_m_s=_speed(spec, vehicle),
    )
    mission = PlannedMission(
        specification=spec,
        place=place,
        prior=prior,
        vehicle=vehicle,
        candidate=candidate,
        weights=weights,
        plan=plan,
        path_length_m=path_m,
        flight_time_s=seconds,
        cells_flown_over=problem.legs.cells_under(stops).size,
        expected_relative_error=sums * prior.widening,
        expected_relative_error_cells=cells * prior.widening,
        warnings=(),
    )
    said = (
        *_what_would_fly(mission),
        *_what_would_help(mission),
        *_far_home(mission),
        *plan.warnings,
        *prior.warnings,
    )
    return replace(mission, warnings=said)


def _home(spec: MissionSpecification, first_lon: float, first_lat: float) -> Home:
    lon, lat = spec.flight.home or (first_lon, first_lat)
    altitude = spec.flight.home_altitude_m
    return Home(lon, lat, altitude or 0.0, altitude_known=altitude is not None)


def _what_would_fly(mission: PlannedMission) -> tuple[str, ...]:
    """Return the sentence that says what would make the mission flyable; none when it is."""
    if mission.flyable:
        return ()
    shrink = mission.usable_s / mission.flight_time_s
    box = mission.place.grid.box
    sentence = (
        f"A planning study, not a flight: it takes {mission.flight_time_s / 60:.0f} min in the air, the "
        f"{mission.vehicle.name} has {mission.usable_s / 60:.0f} min less its reserve. A box of about "
        f"{shrink * box.east_m / 1000:.2g} x {shrink * box.north_m / 1000:.2g} km would fit, or a budget of "
        f"{mission.usable_s / 60:.0f}min where a route that short exists, or a vehicle of longer endurance "
        "(--vehicle FILE.toml)."
    )
    return (sentence,)


def _what_would_help(mission: PlannedMission) -> tuple[str, ...]:
    """Return the sentence for a plan whose map would hardly be better than its mean; none for others."""
    if mission.expected_relative_error < _HARDLY_BETTER:
        return ()
    sentence = (
        f"The expected error, {mission.expected_relative_error:.2f} of the map's contrast, is hardly better than "
        "knowing the map's mean (1): allow a larger --budget, or learn the prior from more or larger fields."
    )
    return (sentence,)


def _far_home(mission: PlannedMission) -> tuple[str, ...]:
    """Return the sentence for a home that lies so far away that it may be a slip; none for others."""
    box, home = mission.place.grid.box, mission.plan.home
    away_m = float(distance_m(home.lon_deg, home.lat_deg, box.centre_lon_deg, box.centre_lat_deg))
    if away_m < _FAR_HOME * np.hypot(box.east_m, box.north_m):
        return ()
    return (
        f"Home, {home.lon_deg:g} {home.lat_deg:g}, lies {away_m / 1000:.0f} km from the middle of the box: are "
        "longitude and latitude swapped? The order is longitude, latitude.",
    )


def _sidecar(mission: PlannedMission, hashes: dict[str, str]) -> Sidecar:
    plan, candidate, flight = mission.plan, mission.candidate, mission.specification.flight
    return Sidecar(
        name=mission.specification.name,
        grid=mission.place.grid,
        allowed=mission.place.allowed,
        model=mission.prior.model,
        phi=candidate.phi,
        stops=candidate.stops,
        altitude_m=flight.altitude_m,
        hold_s=flight.hold_s,
        home=(plan.home.lon_deg, plan.home.lat_deg, plan.home.alt_amsl_m),
        home_altitude_known=plan.home.altitude_known,
        lasso_weight=mission.specification.search.lasso or mission.prior.model.lasso_weight,
        expected={
            "relative_error": mission.expected_relative_error,
            "relative_error_cells": mission.expected_relative_error_cells,
            "cost": candidate.cost,
            "squared_error": candidate.error,
            "path_length_cells": candidate.length_cells,
            "incoherence": candidate.incoherence,
        },
        plans=hashes,
    )
