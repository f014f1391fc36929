"""What the practice autopilot flies, and through which field: put together from options and mission folders."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from sparsor.core.files import write_file
from sparsor.errors import FieldError, InputError, MissionError
from sparsor.geodesy import BoundingBox
from sparsor.journeys.folder import SPECIFICATION_FILE
from sparsor.link.practice import (
    PracticeSettings,
    RasterTruth,
    SensorSettings,
    Troubles,
    WindSettings,
    built_in_over,
    built_in_truth,
    field_truth,
    flavour_named,
    truth_netcdf,
)
from sparsor.link.practice.motion import AIRSPEED_PER_CRUISE
from sparsor.link.practice.place import FlatMap
from sparsor.mission import Home, read_plan
from sparsor.mission.sidecar import Sidecar, read_sidecar
from sparsor.mission.specification import read_specification
from sparsor.prior.reading import read_field
from sparsor.vehicle import load_vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from sparsor.mission.specification import MissionSpecification
    from sparsor.vehicle import SensorProfile, Vehicle

Box = tuple[float, float, float, float]
NEAR_M = 1500.0
FLAT_SHARE = 0.05


@dataclass(frozen=True)
class FieldRequest:
    """The field to fly through.

    Parameters
    ----------
    file : Path, optional
        GeoTIFF, NetCDF or heatmap picture; None is the built-in synthetic field.
    variable, time, box, colormap, value_range
        As `read_field`.
    over : tuple of float, optional
        West, south, east, north: lay the field over this box, as a pattern; default: over the mission's box, and
        without a mission where it lies.
    """

    file: Path | None = None
    variable: str | None = None
    time: str | None = None
    box: Box | None = None
    colormap: str | None = None
    value_range: tuple[float, float] | None = None
    over: Box | None = None

    def __post_init__(self) -> None:
        options = {
            "--variable": self.variable,
            "--field-time": self.time,
            "--field-bbox": self.box,
            "--field-colormap": self.colormap,
            "--field-range": self.value_range,
        }
        given = [name for name, value in options.items() if value is not None]
        if given and self.file is None:
            raise InputError(f"{', '.join(given)} only make sense with --field FILE")


@dataclass(frozen=True)
class PracticeRequest:
    """A practice flight as it is asked for; what is None comes from the mission, else from the defaults.

    Parameters
    ----------
    mission : Path, optional
        Folder of the mission to rehearse; or one of its plans, at whose home the vehicle then stands.
    home : tuple of float, optional
        Longitude and latitude; needed without a mission.
    home_altitude_m : float, optional
        Above mean sea level.
    autopilot, vehicle : str, optional
    through : FieldRequest
    sensor : SensorSettings or None
        None flies no sensor.
    t90_s, noise_ppb : float, optional
        Of the sensor; None: of the sensor that the mission was planned for, else as `sensor` has them.
    wind : WindSettings
    troubles : Troubles
    seed, system : int
    logs : Path, optional
        Folder for the vehicle's own logs.
    """

    mission: Path | None = None
    home: tuple[float, float] | None = None
    home_altitude_m: float | None = None
    autopilot: str | None = None
    vehicle: str | None = None
    through: FieldRequest = FieldRequest()
    sensor: SensorSettings | None = field(default_factory=SensorSettings)
    t90_s: float | None = None
    noise_ppb: float | None = None
    wind: WindSettings = field(default_factory=WindSettings)
    troubles: Troubles = field(default_factory=Troubles)
    seed: int = 0
    system: int = 1
    logs: Path | None = None


@dataclass(frozen=True)
class Practice:
    """A practice flight that is ready.

    Parameters
    ----------
    settings : PracticeSettings
    truth : RasterTruth or None
        What the sensor flies through.
    notes : tuple of str
        What was assumed, one sentence each.
    """

    settings: PracticeSettings
    truth: RasterTruth | None
    notes: tuple[str, ...]


def prepare_practice(request: PracticeRequest) -> Practice:
    """Return the settings of the practice autopilot for what is asked for.

    Raises
    ------
    InputError
        When something asked for is wrong, a file cannot be read, or nobody says where home is.
    """
    mission = None if request.mission is None else _read_mission(request.mission)
    home = _home(request, mission)
    flight = mission[0].flight if mission else None
    truth, notes = _truth(request, home, mission[1].grid.box if mission else None)
    flown = load_vehicle(request.vehicle or (flight.vehicle if flight else "quad"))
    settings = PracticeSettings(
        home=home,
        flavour=flavour_named(request.autopilot or (flight.autopilot if flight else "ardupilot")).on(flown.kind),
        vehicle=flown,
        sensor=_sensor(request, mission[1].sensor if mission else None),
        truth=truth,
        wind=request.wind,
        troubles=request.troubles,
        seed=request.seed,
        system=request.system,
        boot_unix_s=time.time(),
        logs=request.logs,
    )
    return Practice(settings, truth, (*notes, *_too_windy(request.wind, flown)))


def _sensor(request: PracticeRequest, planned: SensorProfile | None) -> SensorSettings:
    """Return how the sensor measures: as asked for, else as the one that the mission was planned for."""
    settings = request.sensor or SensorSettings()
    if planned is not None:
        noise_ppb = planned.noise_sd if planned.unit == "ppb" else settings.noise_ppb
        settings = replace(settings, t90_s=planned.t90_s, noise_ppb=noise_ppb)
    return replace(
        settings,
        t90_s=settings.t90_s if request.t90_s is None else request.t90_s,
        noise_ppb=settings.noise_ppb if request.noise_ppb is None else request.noise_ppb,
    )


def _too_windy(wind: WindSettings, vehicle: Vehicle) -> tuple[str, ...]:
    limit_m_s = AIRSPEED_PER_CRUISE * vehicle.cruise_m_s
    if wind.speed_m_s <= limit_m_s:
        return ()
    return (f"A wind of {wind.speed_m_s:g} m/s is more than it flies against ({limit_m_s:g} m/s): it will be blown.",)


def write_truth(practice: Practice, path: Path) -> None:
    """Write the field that the sensor flies through, in ppb, as NetCDF.

    Raises
    ------
    InputError
        When no sensor flies.
    OutputError
        When the file cannot be written.
    """
    if practice.truth is None:
        raise InputError("--truth: without a sensor there is no field to write; leave out --no-sensor")
    sensor = practice.settings.sensor
    write_file(path, truth_netcdf(practice.truth, sensor.low_ppb, sensor.high_ppb))


def _read_mission(path: Path) -> tuple[MissionSpecification, Sidecar]:
    folder = path.parent if _is_plan(path) else path
    if not (folder / SPECIFICATION_FILE).is_file():
        raise MissionError(
            f"'{folder}' is not a mission folder: it has no {SPECIFICATION_FILE}; make one with 'sparsor plan'"
        )
    spec = read_specification(folder / SPECIFICATION_FILE)
    return spec, read_sidecar(folder / f"{spec.name}.npz")


def _is_plan(path: Path) -> bool:
    return path.suffix == ".plan" and path.is_file()


def _home(request: PracticeRequest, mission: tuple[MissionSpecification, Sidecar] | None) -> Home:
    asked_m = request.home_altitude_m
    if request.home is not None:
        return Home(*request.home, asked_m or 0.0, altitude_known=asked_m is not None)
    if mission is None:
        raise InputError("where does the vehicle stand? Give --home LON LAT, or --mission DIR of a planned mission")
    lon, lat, altitude_m = mission[1].home
    if request.mission is not None and _is_plan(request.mission):
        its = read_plan(request.mission).home
        lon, lat, altitude_m = its.lon_deg, its.lat_deg, its.alt_amsl_m
    if asked_m is not None:
        return Home(lon, lat, asked_m, altitude_known=True)
    return Home(lon, lat, altitude_m, altitude_known=mission[1].home_altitude_known)


def _truth(
    request: PracticeRequest, home: Home, mission_box: BoundingBox | None
) -> tuple[RasterTruth | None, tuple[str, ...]]:
    asked = request.through
    if request.sensor is None:
        if asked.file is not None or asked.over is not None:
            raise InputError("--no-sensor flies through no field: leave out --field and --field-over, or --no-sensor")
        return None, ()
    over = BoundingBox(*asked.over) if asked.over is not None else mission_box
    box = None if over is None else (over.west_deg, over.south_deg, over.west_deg + over.width_deg, over.north_deg)
    if asked.file is None:
        return _built_in(home, box), ()
    read = read_field(
        asked.file,
        variable=asked.variable,
        time=asked.time,
        box=asked.box,
        colormap=asked.colormap,
        value_range=asked.value_range,
    )
    truth = field_truth(read, box)
    notes = list(read.notes)
    if read.gap_fraction > 0:
        notes.append(
            f"{read.gap_fraction:.1%} of the field are gaps: filled linearly from their rims, beyond the outermost "
            "values by the nearest one."
        )
    return truth, (*notes, *_doubts(truth, home))


def _built_in(home: Home, box: Box | None) -> RasterTruth:
    try:
        return built_in_truth(home.lon_deg, home.lat_deg) if box is None else built_in_over(box)
    except FieldError as error:
        raise FieldError(
            f"{error}. The built-in field covers the Gulf region; give a field of your own with --field FILE, laid "
            "over your box with --field-over W S E N, or fly without a sensor (--no-sensor)"
        ) from error


def _doubts(truth: RasterTruth, home: Home) -> tuple[str, ...]:
    """Say when the sensor will hardly see the field change round home."""
    if not truth.covers(home.lon_deg, home.lat_deg):
        return ("Home lies outside the field: the sensor reads the field's edge there. Lay it with --field-over.",)
    around, steps = FlatMap(home.lon_deg, home.lat_deg), (-NEAR_M, -NEAR_M / 2, 0.0, NEAR_M / 2, NEAR_M)
    near = [truth(*around.degrees(east_m, north_m)) for east_m in steps for north_m in steps]
    spread = max(near) - min(near)
    if spread >= FLAT_SHARE:
        return ()
    return (
        f"Within {NEAR_M / 1000:g} km of home the field changes by {spread:.1%} of its range only: a flight there sees "
        "hardly any of it. Lay it over the mission as a pattern with --field-over W S E N or --mission DIR.",
    )
