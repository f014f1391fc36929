"""A mission whose flight was cut: what its logs measured is kept, and the rest is planned anew within what is left."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.core.workers import one_blas_thread
from sparsor.design import parse_budget
from sparsor.design.decoders.linear import mmse
from sparsor.design.decoders.noise import Noise
from sparsor.design.decoders.setting import Setting
from sparsor.errors import BudgetError, MissionError
from sparsor.fieldmap.faults import Reason
from sparsor.journeys.covered import air_seconds, covered
from sparsor.journeys.flown import mission_of_folder
from sparsor.journeys.folder import SPECIFICATION_FILE
from sparsor.journeys.preparing import sensor_of
from sparsor.journeys.reconstructing import measured_flight
from sparsor.journeys.refining import READING_NOISE, Known
from sparsor.mission.specification import changed, read_specification

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.fieldmap.measuring import Measured
    from sparsor.journeys.covered import Covered
    from sparsor.journeys.flown import FlownMission
    from sparsor.journeys.reconstructing import MeasuredFlight
    from sparsor.mission.specification import MissionSpecification, ResumeSection
    from sparsor.prior.model import Model
    from sparsor.vehicle import SensorProfile

ALL_BUT: Final = 0.02
"""Share of a route that may lack where all of its stops were measured, for it to count as flown."""
LEAST_SPREAD: Final = 1.0
"""Of a map, over the noise of a reading: below, readings so far tell nothing of the map's spread."""
PAUSE_S: Final = 1200.0
"""Between the flight that was cut and the next: a battery changed, a plan made and sent. The sensor's zero drifts."""


@dataclass(frozen=True, eq=False)
class Before:
    """What was flown before a mission that resumes another.

    Parameters
    ----------
    mission : FlownMission
        That other one.
    logs : tuple of Path
    flight : MeasuredFlight
        Of all logs together.
    known : Known
        The same as the planner takes it.
    covered : Covered
        Of the mission's own route, by the logs of its own flights.
    air_s : float
        Time in the air of those.
    """

    mission: FlownMission
    logs: tuple[Path, ...]
    flight: MeasuredFlight
    known: Known
    covered: Covered
    air_s: float

    @property
    def cells(self) -> NDArray[np.int64]:
        """Cells in which something was measured, ascending."""
        return self.flight.measured.cells

    @property
    def stops(self) -> NDArray[np.int64]:
        """Stops of the mission that were measured, in flight order."""
        return self.mission.stops[np.isin(self.mission.stops, self.cells)]

    @property
    def all_flown(self) -> bool:
        """Whether nothing of the mission is left."""
        if self.stops.size < self.mission.stops.size:
            return False
        # Between sorties lies home, not the leg that the uncut route had there.
        sorties = sum(path.suffix == ".plan" for path in self.mission.files) > 1
        return sorties or self.covered.length_m >= (1 - ALL_BUT) * self.covered.total_m

    @property
    def warnings(self) -> tuple[str, ...]:
        """What has to be said of the logs."""
        return (*self.flight.readings.warnings, *(f"The log: {one}." for one in self.flight.measured.warnings))


def resumed_specification(
    folder: Path,
    logs: tuple[Path, ...],
    given: dict[str, Any],
    *,
    base: Path,
    sensor: str | None = None,
    calibration: Path | None = None,
    progress: Progress = silent,
) -> tuple[MissionSpecification, Before]:
    """Return what asks for the rest of a mission, and what was flown of it.

    Parameters
    ----------
    folder : Path
        Of the mission that was flown.
    logs : tuple of Path
        Of its flights. Of a mission that resumes another itself, the other's logs need not be given again.
    given : dict
        Sections of mission.toml with what is to be changed; None leaves it. Without a budget it is what is left of the
        mission's own.
    base : Path
        Folder that relative paths in `given` start from.
    sensor : str, optional
        NAME, NAME@SYSTEM/COMPONENT, or MSG.FIELD of a .BIN, where the logs hold several.
    calibration : Path, optional
    progress : Progress

    Raises
    ------
    InputError
        When the mission or a log cannot be used, or nothing is left of the route or of the budget.
    """
    mission = mission_of_folder(folder)
    old = read_specification(folder / SPECIFICATION_FILE)
    earlier = () if old.resume is None else old.resume.logs
    new = _others(tuple(base / path for path in logs), earlier)
    asked = {
        **given,
        "name": given.get("name") or following(old.name),
        "search": {"planner": "refined", **_given(given.get("search"))},
        "flight": _flight(mission, old, _given(given.get("flight"))),
        "resume": {"mission": folder, "logs": (*earlier, *new), "sensor": sensor, "calibration": calibration},
    }
    spec = changed(old, asked, base=base)
    assert spec.resume is not None
    before = flown_before(spec.resume, sensor_of(spec), mission=mission, progress=progress)
    if asked["search"].get("budget") is None:
        if before.all_flown:
            raise MissionError(
                f"nothing is left to plan: the logs cover all {before.mission.route.size} stops of '{folder}' and "
                f"{before.covered.length_m / 1000:.2f} of {before.covered.total_m / 1000:.2f} km; make the map "
                "(reconstruct-map), or give a --budget for what a further flight may be"
            )
        spec = changed(spec, {"search": {"budget": budget_left(old, before)}}, base=Path())
    return spec, before


def flown_before(
    resume: ResumeSection,
    profile: SensorProfile | None,
    *,
    mission: FlownMission | None = None,
    progress: Progress = silent,
) -> Before:
    """Return what the flights that a mission resumes measured.

    Parameters
    ----------
    resume : ResumeSection
    profile : SensorProfile or None
        What measured, and will.
    mission : FlownMission, optional
        As `mission_of_folder` returns it.
    progress : Progress

    Raises
    ------
    InputError
        When the mission or a log cannot be used.
    """
    mission = mission or mission_of_folder(resume.mission)

    def measured(logs: tuple[Path, ...]) -> MeasuredFlight:
        return measured_flight(
            logs,
            mission,
            profile,
            sensor=resume.sensor,
            calibration=resume.calibration,
            whole=False,
            progress=progress,
        )

    flight = measured(resume.logs)
    # A mission that resumed another was given what that one had left: only its own flights draw on it.
    own_logs = _own_logs(resume)
    own = flight if own_logs == resume.logs else measured(own_logs) if own_logs else None
    if own is None:
        raise MissionError(
            f"all logs given are of the flights that '{resume.mission}' resumed itself: give the log of its own flight "
            "(--resume LOG)"
        )
    beyond = np.isin(own.measured.reason, [str(Reason.OUTSIDE), str(Reason.NOT_IN_FLIGHT)])
    return Before(
        mission=mission,
        logs=resume.logs,
        flight=flight,
        known=known_of(flight.measured, mission.model, mission.allowed, flight.readings.profile.drift_sd_per_h),
        covered=covered(mission.grid, mission.route, own.samples, ~beyond),
        air_s=air_seconds(own.samples),
    )


def known_of(measured: Measured, model: Model, allowed: NDArray[np.bool_], drift_sd_per_h: float) -> Known:
    """Return what was measured as the planner takes it: for maps of a spread of 1.

    The spread of the flown map is what the training maps' covariance finds in the readings.

    Parameters
    ----------
    measured : Measured
    model : Model
    allowed : array of bool (N,)
        Cells that count.
    drift_sd_per_h : float
        Of the sensor, in the readings' unit.
    """
    readings = measured.measurements.in_order()
    setting = Setting(model, readings, allowed, np.zeros(readings.count), 0)
    with one_blas_thread():
        spread = mmse(setting).decode(readings.values[None]).spread(allowed)
    noise_sd = float(measured.model.noise_sd)
    spread = max(spread, LEAST_SPREAD * noise_sd, float(np.finfo(np.float64).tiny ** 0.25))
    # Readings to come have this share whatever they tell: so had those that are there.
    variance = readings.variance / spread**2 + READING_NOISE
    drift_sd = readings.drift_sd / spread
    zero_sd = float(drift_sd.max()) + drift_sd_per_h / spread * PAUSE_S / 3600.0
    return Known(readings.weights, Noise(variance, drift_sd), (noise_sd / spread) ** 2, zero_sd)


def budget_left(spec: MissionSpecification, before: Before) -> str:
    """Return what is left of a mission's budget, as it is written; without one, of its route's length.

    Raises
    ------
    BudgetError
        When nothing is.
    """
    grid, flown_to = before.mission.grid, before.mission.flown_to
    total_m, flown_m = before.covered.total_m, before.covered.length_m
    if spec.search.budget is not None:
        asked = parse_budget(spec.search.budget)
        if asked.measure == "time":
            if before.air_s >= asked.value:
                raise BudgetError(_spent(spec, f"{before.air_s / 60:.1f} of {asked.value / 60:.1f} min were flown"))
            return f"{asked.value - before.air_s:.1f}s"
        total_m = asked.value * grid.full_coverage_m(flown_to) if asked.measure == "fraction" else asked.value
    if round(total_m - flown_m, 1) <= 0:
        raise BudgetError(_spent(spec, f"{flown_m / 1000:.2f} of {total_m / 1000:.2f} km over the stops were flown"))
    return f"{total_m - flown_m:.1f}m"


def following(name: str) -> str:
    """Return the name of what follows a mission.

    Examples
    --------
    >>> following("doha"), following("doha-2")
    ('doha-2', 'doha-3')
    """
    numbered = re.fullmatch(r"(.*[^-])-(\d{1,3})", name)
    if numbered is not None and int(numbered[2]) > 1:
        return f"{numbered[1]}-{int(numbered[2]) + 1}"
    return f"{name[:61]}-2"


def _own_logs(resume: ResumeSection) -> tuple[Path, ...]:
    """Return the logs that are not of the flights before the mission that is resumed."""
    path = resume.mission / SPECIFICATION_FILE
    before = read_specification(path).resume if path.is_file() else None
    return resume.logs if before is None else _others(resume.logs, before.logs)


def _others(logs: tuple[Path, ...], known: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return the logs that are none of those known, by whatever path they were given."""
    places = {log.resolve() for log in known}
    return tuple(log for log in logs if log.resolve() not in places)


def _flight(mission: FlownMission, spec: MissionSpecification, given: dict[str, Any]) -> dict[str, Any]:
    """Return what is asked of the flight, home as it was: where none was given it was the first stop."""
    known = bool(spec.flight.given_homes) or not given.keys().isdisjoint(("home", "homes"))
    return given if known else {"home": mission.home, **given}


def _given(section: dict[str, Any] | None) -> dict[str, Any]:
    return {name: value for name, value in (section or {}).items() if value is not None}


def _spent(spec: MissionSpecification, what: str) -> str:
    return (
        f"nothing is left of the budget of mission '{spec.name}': {what}; give a --budget for what a further flight "
        "may be, like 3km"
    )
