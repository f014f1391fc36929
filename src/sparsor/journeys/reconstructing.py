"""From flight logs and a mission to the map: composes the stages, holds no algorithm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.design.decoders import decode
from sparsor.errors import InputError, LogError
from sparsor.fieldmap.fieldmap import FieldMap, FlownSamples
from sparsor.fieldmap.measuring import measure
from sparsor.flightlog import read_logs, samples
from sparsor.geodesy.lengths import distance_m
from sparsor.journeys.flown import mission_of_folder, mission_of_plan
from sparsor.journeys.mapfacts import map_facts
from sparsor.journeys.readings import concentrations
from sparsor.vehicle import load_sensor

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from sparsor.design.decoders import Decoded, DecoderName
    from sparsor.fieldmap.measuring import Measured
    from sparsor.flightlog import Samples
    from sparsor.journeys.flown import FlownMission
    from sparsor.journeys.readings import Readings
    from sparsor.vehicle import SensorProfile

LARGEST_FINER = 16
MOSTLY = 0.5
"""A log of another mission may touch the box; one of this mission has more than this share of its samples in it."""
LONGEST_S = 3 * 3600.0
"""A field changes: what was sampled over a longer time is a map of no one moment."""


@dataclass(frozen=True)
class ReconstructRequest:
    """What is to be reconstructed, and how.

    Parameters
    ----------
    logs : tuple of Path
        Of one mission; several sorties together.
    mission : Path, optional
        A mission folder.
    plan, bbox, model
        Instead of a folder: anybody's .plan, the box (west, south, east, north in degrees), perhaps a model.
    sensor : str, optional
        NAME, NAME@SYSTEM/COMPONENT, or MSG.FIELD of a .BIN.
    system : int, optional
        The vehicle.
    profile, calibration : Path, optional
        Files.
    unit : str, optional
    t90_s : float, optional
    decoder : str
    finer : int
        How many times finer than the grid the map is to be.
    """

    logs: tuple[Path, ...]
    mission: Path | None = None
    plan: Path | None = None
    bbox: tuple[float, float, float, float] | None = None
    model: Path | None = None
    sensor: str | None = None
    system: int | None = None
    profile: Path | None = None
    calibration: Path | None = None
    unit: str | None = None
    t90_s: float | None = None
    decoder: DecoderName = "auto"
    finer: int = 1

    def __post_init__(self) -> None:
        if (self.mission is None) == (self.plan is None):
            raise InputError("which mission? Give --mission DIR, or --plan FILE.plan with --bbox W S E N")
        if (self.plan is None) != (self.bbox is None):
            raise InputError("--plan and --bbox W S E N belong together; a mission folder knows its box")
        if self.model is not None and self.plan is None:
            raise InputError("--model goes with --plan and --bbox; a mission folder holds its own model")
        if not 1 <= self.finer <= LARGEST_FINER:
            raise InputError(f"--finer is {self.finer}; it has to be 1..{LARGEST_FINER}")
        if self.t90_s is not None and not 0 <= self.t90_s < 1e5:
            raise InputError(f"--t90 is {self.t90_s:g} s; it has to be 0 or above")

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Files that are read besides the mission's; never written over."""
        return tuple(path for path in (*self.logs, self.profile, self.calibration) if path is not None)


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """A map with everything that led to it.

    Parameters
    ----------
    mission : FlownMission
    samples : Samples
    readings : Readings
    measured : Measured
    decoded : Decoded
    field_map : FieldMap
    flown : FlownSamples
    warnings : tuple of str
    """

    mission: FlownMission
    samples: Samples
    readings: Readings
    measured: Measured
    decoded: Decoded
    field_map: FieldMap
    flown: FlownSamples
    warnings: tuple[str, ...]

    @property
    def clock(self) -> str:
        """What the samples were timed by."""
        return ", ".join(dict.fromkeys(use.clock for use in self.samples.clocks if use.samples))


def requested_mission(request: ReconstructRequest, *, progress: Progress = silent) -> FlownMission:
    """Return the mission that a request names.

    Raises
    ------
    InputError
        When it cannot be used.
    """
    if request.mission is not None:
        return mission_of_folder(request.mission)
    assert request.plan is not None
    assert request.bbox is not None
    return mission_of_plan(request.plan, request.bbox, request.model, progress=progress)


def reconstruct(
    request: ReconstructRequest, mission: FlownMission | None = None, *, progress: Progress = silent
) -> Reconstruction:
    """Return the map that the logs of a mission give.

    Parameters
    ----------
    request : ReconstructRequest
    mission : FlownMission, optional
        As `requested_mission` returns it.
    progress : Progress

    Raises
    ------
    InputError
        When the logs cannot be read, hold no such sensor, or were not flown here.
    """
    mission = mission or requested_mission(request, progress=progress)
    flight = measured_flight(
        request.logs,
        mission,
        mission.sensor if request.profile is None else load_sensor(request.profile),
        sensor=request.sensor,
        system=request.system,
        calibration=request.calibration,
        unit=request.unit,
        t90_s=request.t90_s,
        progress=progress,
    )
    logged, readings, measured = flight.samples, flight.readings, flight.measured
    progress("decoding", 0, 1)
    decoded = decode(
        measured.measurements,
        mission.model,
        request.decoder,
        allowed=mission.allowed,
        phi=mission.phi,
        widening=mission.widening,
        finer=request.finer,
    )
    progress("decoding", 1, 1)
    facts = map_facts(request.logs, mission, logged, readings, measured, decoded)
    return Reconstruction(
        mission=mission,
        samples=logged,
        readings=readings,
        measured=measured,
        decoded=decoded,
        field_map=_field_map(mission, logged, readings, measured, decoded, facts),
        flown=_flown(logged, readings, measured),
        warnings=(
            *mission.warnings,
            *readings.warnings,
            *measured.warnings,
            *_earlier_flights(mission, measured),
            *_warnings(request, logged, measured, decoded),
        ),
    )


@dataclass(frozen=True, eq=False)
class MeasuredFlight:
    """What the logs of a mission say before anything is decoded."""

    samples: Samples
    readings: Readings
    measured: Measured


def measured_flight(
    logs: Sequence[Path],
    mission: FlownMission,
    profile: SensorProfile | None,
    *,
    sensor: str | None = None,
    system: int | None = None,
    calibration: Path | None = None,
    unit: str | None = None,
    t90_s: float | None = None,
    whole: bool = True,
    progress: Progress = silent,
) -> MeasuredFlight:
    """Return what the logs of a mission measured.

    Parameters
    ----------
    logs : sequence of Path
    mission : FlownMission
    profile : SensorProfile or None
        The sensor that flew, as far as it is known.
    sensor, system, calibration, unit, t90_s
        As for `ReconstructRequest`.
    whole : bool
        Whether every stop was meant to be flown: then those that were missed are told.
    progress : Progress

    Raises
    ------
    InputError
        When the logs cannot be read, hold no such sensor, or were not flown here.
    """
    log = read_logs(logs, sensor=sensor, progress=progress)
    logged = samples(log, sensor=sensor, system=system)
    _check_flown_here(logged, mission)
    readings = concentrations(log, logged, profile=profile, calibration=calibration, unit=unit, t90_s=t90_s)
    measured = measure(
        logged,
        mission.grid,
        readings.profile,
        value=readings.value,
        stops=mission.stops if whole else None,
        altitude_m=mission.altitude_m,
        way=mission.way,
        heights_m=mission.heights_m,
    )
    return MeasuredFlight(logged, readings, measured)


def _check_flown_here(logged: Samples, mission: FlownMission) -> None:
    """Refuse a log that only brushes the mission's box."""
    cells = mission.grid.cell_at(logged.lon_deg, logged.lat_deg)
    inside = cells >= 0
    if not inside.any() or inside.mean() > MOSTLY or np.isin(mission.stops, cells).any():
        return
    box = mission.grid.box
    lon_deg, lat_deg = float(np.median(logged.lon_deg)), float(np.median(logged.lat_deg))
    away_m = float(distance_m(lon_deg, lat_deg, box.centre_lon_deg, box.centre_lat_deg))
    raise LogError(
        f"{int((~inside).sum())} of {inside.size} samples lie outside the box of mission '{mission.name}', and none at "
        f"any of its {mission.stops.size} stops: they lie around {lon_deg:.5f} {lat_deg:.5f}, {away_m / 1000:.1f} km "
        "from its middle; give the mission that was flown"
    )


def _field_map(
    mission: FlownMission,
    logged: Samples,
    readings: Readings,
    measured: Measured,
    decoded: Decoded,
    facts: Mapping[str, str],
) -> FieldMap:
    seen = np.zeros(mission.grid.size, dtype=np.bool_)
    seen[measured.cells] = True
    return FieldMap(
        name=mission.name,
        quantity=logged.sensor,
        unit=readings.unit,
        grid=mission.grid,
        values=decoded.values,
        standard_deviation=decoded.standard_deviation,
        measured=seen,
        allowed=mission.allowed,
        decoder=decoded.decoder,
        facts=facts,
        finer=decoded.finer,
    )


def _flown(logged: Samples, readings: Readings, measured: Measured) -> FlownSamples:
    answers_at_once = measured.model.tau_s == 0
    return FlownSamples(
        time_s=logged.time_s,
        lon_deg=logged.lon_deg,
        lat_deg=logged.lat_deg,
        alt_m=logged.alt_m,
        value=readings.value,
        air=readings.value if answers_at_once else measured.air,
        clock=logged.clock,
        boot=logged.boot,
        unix_s=logged.unix_s,
        reason=measured.reason,
    )


def _earlier_flights(mission: FlownMission, measured: Measured) -> tuple[str, ...]:
    """Say when stops are missed that flights before a resumed mission measured."""
    count = int(np.isin(mission.stops[: mission.earlier], measured.missed).sum())
    if not count:
        return ()
    return (
        f"{count} of the stops missed were measured by the flights that '{mission.name}' resumes: give their logs too, "
        "for the map of all flights together.",
    )


def _warnings(request: ReconstructRequest, logged: Samples, measured: Measured, decoded: Decoded) -> list[str]:
    said = []
    if request.finer > 1 and decoded.finer is None:
        said.append(
            f"The decoder '{decoded.decoder}' knows cells only, so the map is not finer; --decoder kriging can be."
        )
    dropped = logged.dropped.no_position
    if dropped:
        said.append(f"{dropped} samples have no position on both sides within a few seconds: left out.")
    lasted_s = float(np.nan_to_num(np.ptp(logged.unix_s[measured.used])))
    if lasted_s > LONGEST_S:
        said.append(
            f"The samples span {lasted_s / 3600:.1f} h, in which a field changes: the map is a mean over that time."
        )
    return said
