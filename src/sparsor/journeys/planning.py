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
from sparsor.geodesy.lengths import distance_m, path_length_m
from sparsor.journeys.advice import advice
from sparsor.journeys.algorithm1 import search_algorithm_1
from sparsor.journeys.groundwork import GroundFacts, check_over, ground_facts, said_of_ground
from sparsor.journeys.preparing import Place, Prepared, prepare
from sparsor.journeys.refining import search_refined
from sparsor.journeys.sorties import Sorties, cut_into_sorties
from sparsor.mission import Home, MissionPlan, build_mission, check_faults, time_plan, transits
from sparsor.vehicle import Autopilot, SensorProfile, SteadyWind, Vehicle, usable_seconds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from sparsor.design import Candidate
    from sparsor.journeys.modelling import PriorChoice
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
        The flights that the route is cut into, where one is not enough and they were asked for; length, times and
        errors above are of the uncut route.
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
    ground: Ground | None = None
    ground_facts: GroundFacts | None = None

    @property
    def usable_s(self) -> float:
        """Endurance less the reserve, seconds."""
        return usable_seconds(self.vehicle)

    @property
    def flyable(self) -> bool:
        """Whether the flight, or each of its sorties, fits into the vehicle's endurance less its reserve."""
        return self.used_s <= self.usable_s or self.sorties is not None

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
    spec: MissionSpecification, *, workers: Workers | int | None = None, progress: Progress = silent
) -> PlannedMission:
    """Plan a mission; nothing is written.

    Parameters
    ----------
    spec : MissionSpecification
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
    return plan_prepared(spec, prepared, workers=hands, progress=progress)


def plan_prepared(
    spec: MissionSpecification,
    prepared: Prepared,
    *,
    begin: Sequence[NDArray[np.int64]] = (),
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
    workers : Workers or int
    progress : Progress

    Raises
    ------
    InputError
        When no route meets the budget.
    """
    problem = prepared.problem(spec)
    if spec.search.planner == "refined":
        found = search_refined(prepared, problem, spec, begin=begin, workers=workers, progress=progress)
        warnings = (_INTERRUPTED,) if found.interrupted else ()
        return _assemble(spec, prepared, found.candidate, Weights(), (found.error, found.error), warnings)
    candidate, weights = search_algorithm_1(problem, spec, workers=workers, progress=progress)
    expected = expected_errors(problem, candidate, prepared.prior.model.mean)
    return _assemble(spec, prepared, candidate, weights, expected, ())


def _assemble(
    spec: MissionSpecification,
    prepared: Prepared,
    candidate: Candidate,
    weights: Weights,
    expected: tuple[float, float],
    warnings: tuple[str, ...],
) -> PlannedMission:
    place, prior, legs, vehicle = prepared.place, prepared.prior, prepared.legs, prepared.vehicle
    candidate = _nearer_end_first(spec, place, candidate)
    flight, stops = spec.flight, candidate.stops
    lon, lat = place.grid.centres_deg(stops)
    holds_s = np.broadcast_to(_holds_s(flight.hold_s, candidate, prepared.autopilot), stops.shape)
    ground = prepared.ground
    home = _home(spec, float(lon[0]), float(lat[0]), ground)

    def build(order: NDArray[np.int64]) -> MissionPlan:
        return build_mission(
            lon[order],
            lat[order],
            vehicle=vehicle,
            autopilot=prepared.autopilot,
            altitude_m=flight.altitude_m,
            home=home,
            speed_m_s=flight.speed_m_s,
            hold_s=holds_s[order],
            fence_margin_m=flight.fence_margin_m,
            wind=prepared.wind,
            zones=place.zones,
            ground=ground,
            triggers=flight.triggers,
        )

    plan = build(np.arange(stops.size))
    path_m = legs.path_length(stops)
    transit = sum(path_length_m(*np.transpose(way)) for way in transits(plan))
    time = time_plan(plan, vehicle, prepared.wind)
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
        cells_flown_over=legs.cells_under(stops).size,
        expected_relative_error=expected[0] * prior.widening,
        expected_relative_error_cells=expected[1] * prior.widening,
        warnings=(),
    )
    if flight.sorties and not mission.flyable:
        cut = cut_into_sorties(prepared, stops, np.asarray(holds_s, dtype=np.float64), build, spec.search.seed)
        if isinstance(cut, str):
            warnings = (*warnings, cut)
        else:
            mission = replace(mission, sorties=cut)
            warnings = (*warnings, _said_of(cut, mission))
    _check(mission, prepared.wind)
    if ground is not None:
        check_over(mission.plans, ground, vehicle)
        facts = ground_facts(mission.plans, ground, vehicle)
        mission = replace(mission, ground=ground, ground_facts=facts)
        warnings = (*warnings, *said_of_ground(facts, plan, ground, vehicle, flight.home_altitude_m))
        warnings = (*warnings, *_beyond_budget(mission))
    said = (*warnings, *advice(mission), *plan.warnings, *prior.warnings)
    return replace(mission, warnings=said if place.zones is None else (*said, _STRAIGHT))


def _check(mission: PlannedMission, wind: SteadyWind) -> None:
    """Refuse a flyable plan that `sparsor check` would fail."""
    found = [fault for plan in mission.plans for fault in check_faults(plan, mission.vehicle, wind)]
    faults = [fault.sentence for fault in found if fault.fails]
    if mission.flyable and faults:
        raise MissionError(f"the plan fails its checks and is not written: {' '.join(faults)}")


def _said_of(cut: Sorties, mission: PlannedMission) -> str:
    together_s = sum(time.seconds for time in cut.times)
    if len(cut.plans) == 1:
        return (
            f"The route as it was found takes more than one battery; its stops in another order take "
            f"{cut.times[0].used_s / 60:.1f} of {mission.usable_s / 60:.1f} min. The expected error is that of the "
            "route as it was found."
        )
    return (
        f"One battery is not enough for the route: it is cut into {len(cut.plans)} sorties, {together_s / 60:.0f} min "
        f"in all, none above {max(time.used_s for time in cut.times) / 60:.1f} of {mission.usable_s / 60:.1f} min. The "
        "expected error is that of the uncut route."
    )


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


def _home(spec: MissionSpecification, first_lon: float, first_lat: float, ground: Ground | None) -> Home:
    lon, lat = spec.flight.home or (first_lon, first_lat)
    altitude = spec.flight.home_altitude_m
    if altitude is None and ground is not None:
        altitude = round(ground.home_m((lon, lat)), 1)
    return Home(lon, lat, altitude or 0.0, altitude_known=altitude is not None)
