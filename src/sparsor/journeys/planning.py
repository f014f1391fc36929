"""From what was asked for to a planned mission."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.core.workers import Workers, workers_of
from sparsor.design import Weights, parse_budget
from sparsor.design.expectation import expected_errors
from sparsor.errors import MissionError
from sparsor.geodesy.lengths import path_length_m
from sparsor.journeys.advice import advice, said_of
from sparsor.journeys.algorithm1 import search_algorithm_1
from sparsor.journeys.fleet import FAILSAFE, cut_for_vehicles
from sparsor.journeys.flights import whole_flight
from sparsor.journeys.flownerror import Expected, flown_by_algorithm_1, flown_candidate, flown_refined
from sparsor.journeys.groundwork import GroundFacts, check_over, ground_facts, said_of_ground
from sparsor.journeys.keepingout import said_of_shore
from sparsor.journeys.preparing import Place, Prepared, prepare
from sparsor.journeys.refining import search_refined
from sparsor.journeys.resuming import flown_before
from sparsor.journeys.sorties import Sorties, cut_into_sorties
from sparsor.mission import MissionPlan, check_faults, transits
from sparsor.vehicle import SensorProfile, SteadyWind, Vehicle, usable_seconds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.design import Candidate
    from sparsor.journeys.flights import Flights
    from sparsor.journeys.modelling import PriorChoice
    from sparsor.journeys.refining import Known
    from sparsor.journeys.resuming import Before
    from sparsor.mission.following import Ground
    from sparsor.mission.specification import MissionSpecification

_STRAIGHT = (
    "A failsafe return flies straight home or to the rally point, through what is kept out of if that lies between: "
    "the exclusion fences do not lead it past."
)
_INTERRUPTED = "The search was interrupted: the route is the best that it had found by then."


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
        None when nothing was said of it and the planner does without.
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
    used_s : float
        Of the vehicle's endurance: the same where every phase takes the power of cruising.
    expected_relative_error : float
        Mean of ``|s - s_hat| / |s - mean(s)|`` over the validation maps, decoded from the sums of Phi; of the refined
        search by the best linear decoder from every cell flown over.
    expected_relative_error_cells : float
        The same, decoded from the single cells.
    warnings : tuple of str
    sorties : Sorties or None
        The flights that the route is cut into, where one is not enough; lengths and times above are of the uncut route,
        the errors and the cells flown over of what the sorties fly.
    before : Before or None
        What was flown of the mission that this one resumes; the errors above are of all flights together.
    flown : Candidate or None
        What the sorties fly: all their stops, one flight after the other, and the Phi that they measure.
    ground : Ground or None
        That heights are kept above.
    ground_facts : GroundFacts or None
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
    used_s: float
    cells_flown_over: int
    expected_relative_error: float
    expected_relative_error_cells: float
    warnings: tuple[str, ...]
    sorties: Sorties | None = None
    before: Before | None = None
    flown: Candidate | None = None
    ground: Ground | None = None
    ground_facts: GroundFacts | None = None

    @property
    def measured(self) -> Candidate:
        """What is flown: the route as it was found, or the sorties over it."""
        return self.candidate if self.flown is None else self.flown

    @property
    def usable_s(self) -> float:
        """Endurance less the reserve, seconds."""
        return usable_seconds(self.vehicle)

    @property
    def flyable(self) -> bool:
        """Whether the flight, or each of its sorties, fits into the vehicle's endurance less its reserve."""
        return self.used_s <= self.usable_s or self.sorties is not None

    @property
    def refined(self) -> bool:
        """Whether the refined search planned it."""
        return self.specification.search.planner == "refined"

    @property
    def plans(self) -> tuple[MissionPlan, ...]:
        """What is written: the plan, or those of its sorties."""
        return (self.plan,) if self.sorties is None else self.sorties.plans

    @property
    def plan_files(self) -> tuple[str, ...]:
        """The plans' file names: NAME.plan, or NAME-1.plan ... of sorties."""
        name = self.specification.name
        if len(self.plans) == 1:
            return (f"{name}.plan",)
        return tuple(f"{name}-{number}.plan" for number in range(1, len(self.plans) + 1))

    @property
    def coverage_fraction(self) -> float:
        """Path length over that of full coverage."""
        return self.path_length_m / self.place.full_coverage_m


def plan_mission(
    spec: MissionSpecification,
    *,
    before: Before | None = None,
    workers: Workers | int | None = None,
    progress: Progress = silent,
) -> PlannedMission:
    """Plan a mission; nothing is written.

    Parameters
    ----------
    spec : MissionSpecification
    before : Before, optional
        What was flown of the mission that it resumes, where that was read already.
    workers : Workers or int, optional
        Who searches and learns, see `sparsor.core.schedulers.workers_at`; a number is one of threads, one a core by
        default. The answer is the same for any.
    progress : Progress

    Raises
    ------
    InputError
        When something asked for is wrong, or no route meets the budget.
    """
    hands = workers_of(workers)
    prepared = prepare(spec, workers=hands, progress=progress)
    if spec.resume is not None and before is None:
        before = flown_before(spec.resume, prepared.sensor, progress=progress)
    return plan_prepared(spec, prepared, before=before, workers=hands, progress=progress)


def plan_prepared(
    spec: MissionSpecification,
    prepared: Prepared,
    *,
    begin: Sequence[NDArray[np.int64]] = (),
    before: Before | None = None,
    workers: Workers | int = 1,
    progress: Progress = silent,
) -> PlannedMission:
    """Plan a mission with what was prepared for it, or for it with another budget.

    Parameters
    ----------
    spec : MissionSpecification
    prepared : Prepared
    begin : sequence of arrays of int64
        Routes that the refined search may begin from.
    before : Before, optional
        What was flown of the mission that it resumes.
    workers : Workers or int
    progress : Progress

    Raises
    ------
    InputError
        When no route meets the budget.
    """
    problem = prepared.problem(spec)
    if spec.search.planner == "refined":
        known = None if before is None else _from_home(before.known, spec, prepared)
        begin = begin if before is None else (*begin, before.covered.left)

        def made(known: Known | None) -> PlannedMission:
            found = search_refined(
                prepared, problem, spec, begin=begin, known=known, workers=workers, progress=progress
            )
            said = (*((_INTERRUPTED,) if found.interrupted else ()), *(() if before is None else before.warnings))
            after = flown_refined(prepared, problem, spec, known)
            errors = (found.error, found.error)
            planned = _assemble(spec, prepared, found.candidate, Weights(), errors, after, said)
            return replace(planned, before=before)

        mission = made(known)
        if known is None or known.home is None or mission.flyable:
            return mission
        # Ways that are measured are longer ones than the battery may allow.
        shorter = made(replace(known, home=None))
        return shorter if shorter.flyable else mission
    candidate, weights = search_algorithm_1(problem, spec, workers=workers, progress=progress)
    mean = prepared.prior.model.mean
    expected = expected_errors(problem, candidate, mean)
    return _assemble(spec, prepared, candidate, weights, expected, flown_by_algorithm_1(problem, mean), ())


def _assemble(
    spec: MissionSpecification,
    prepared: Prepared,
    candidate: Candidate,
    weights: Weights,
    expected: tuple[float, float],
    after: Expected,
    warnings: tuple[str, ...],
) -> PlannedMission:
    place, prior, legs, vehicle = prepared.place, prepared.prior, prepared.legs, prepared.vehicle
    flights, plan = whole_flight(spec, prepared, candidate)
    candidate = flights.candidate
    path_m = legs.path_length(candidate.stops)
    transit = sum(path_length_m(*np.transpose(way)) for way in transits(plan))
    time = flights.time(plan)
    mission = PlannedMission(
        specification=spec,
        place=place,
        prior=prior,
        vehicle=vehicle,
        sensor=prepared.sensor,
        candidate=candidate,
        weights=weights,
        plan=plan,
        path_length_m=path_m,
        flown_length_m=path_m + float(transit),
        flight_time_s=time.seconds,
        used_s=time.used_s,
        cells_flown_over=legs.cells_under(candidate.stops).size,
        expected_relative_error=expected[0] * prior.widening,
        expected_relative_error_cells=expected[1] * prior.widening,
        warnings=(),
    )
    beyond: tuple[str, ...] = ()
    if spec.flight.vehicles > 1 or (spec.flight.sorties and not mission.flyable):

        def error(orders: Sequence[NDArray[np.int64]]) -> float:
            return after(candidate, [flights.tour(order) for order in orders])[0]

        cut_by = cut_for_vehicles if spec.flight.vehicles > 1 else cut_into_sorties
        cut = cut_by(flights, error if mission.refined else None)
        if isinstance(cut, str):
            beyond = (cut,)
        else:
            whole, mission = mission, _flown(mission, flights, cut, after)
            warnings = (
                *warnings,
                said_of(mission, whole),
                *([FAILSAFE] if cut.apart_m is not None and vehicle.flies else []),
            )
    _check(mission, prepared.wind)
    if prepared.ground is not None:
        check_over(mission.plans, prepared.ground, vehicle)
        facts = ground_facts(mission.plans, prepared.ground, vehicle)
        mission = replace(mission, ground=prepared.ground, ground_facts=facts)
        over = said_of_ground(facts, mission.plans, prepared.ground, vehicle, spec.flight.home_altitude_m)
        warnings = (*warnings, *over, *_beyond_budget(mission))
    said = (*warnings, *advice(mission), *beyond, *said_of_shore(mission), *_of_the_plans(mission), *prior.warnings)
    return replace(mission, warnings=said if place.zones is None else (*said, _STRAIGHT))


def _from_home(known: Known, spec: MissionSpecification, prepared: Prepared) -> Known:
    """Return what is known with the cell of home, over which the sensor comes to what it knows."""
    if len(spec.flight.given_homes) != 1:
        return known
    cell = int(prepared.place.grid.cell_at(*spec.flight.given_homes[0]))
    return replace(known, home=cell) if cell >= 0 else known


def _flown(mission: PlannedMission, flights: Flights, cut: Sorties, after: Expected) -> PlannedMission:
    """Return the mission with its sorties, and the errors to expect of what they fly."""
    tours = [flights.tour(order) for order in cut.orders]
    flown = flown_candidate(mission.candidate, cut.orders, tours, flights.prepared.legs, refined=mission.refined)
    error, error_cells = after(flown, tours)
    widening = mission.prior.widening
    return replace(
        mission,
        sorties=cut,
        flown=flown,
        cells_flown_over=np.unique(np.concatenate([flights.prepared.legs.cells_under(tour) for tour in tours])).size,
        expected_relative_error=error * widening,
        expected_relative_error_cells=error_cells * widening,
    )


def _of_the_plans(mission: PlannedMission) -> tuple[str, ...]:
    """Return what the plans themselves warn of, once; with the plan's name where it is not said of all of them."""
    plans = mission.plans
    return tuple(
        dict.fromkeys(
            warning if all(warning in one.warnings for one in plans) else f"{file}: {warning}"
            for file, plan in zip(mission.plan_files, plans, strict=True)
            for warning in plan.warnings
        )
    )


def _check(mission: PlannedMission, wind: SteadyWind) -> None:
    """Refuse a flyable plan that `sparsor check` would fail."""
    found = [fault for plan in mission.plans for fault in check_faults(plan, mission.vehicle, wind)]
    faults = [fault.sentence for fault in found if fault.fails]
    if mission.flyable and faults:
        raise MissionError(f"the plan fails its checks and is not written: {' '.join(faults)}")


def _beyond_budget(mission: PlannedMission) -> tuple[str, ...]:
    """Say it where the climbs over terrain, which the search does not know, take more than a budget of time."""
    asked = mission.specification.search.budget
    budget = None if asked is None else parse_budget(asked)
    if budget is None or budget.measure != "time" or mission.flight_time_s <= budget.value:
        return ()
    return (
        "Climbing and sinking over the ground take longer than the search counted: "
        f"{mission.flight_time_s / 60:.1f} min, beyond {budget.value / 60:g} min: give a smaller --budget.",
    )
