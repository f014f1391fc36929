"""mission.toml: everything that was asked for, defaults filled in."""

from __future__ import annotations

import os
import re
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import tomli_w
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    ValidationError,
    field_validator,
    model_validator,
)

from sparsor.errors import MissionError, VehicleError
from sparsor.mission.triggers import Trigger, parse_trigger
from sparsor.vehicle import CALM, SteadyWind, load_sensor, load_vehicle

if TYPE_CHECKING:
    from collections.abc import Mapping

Export = Literal["waypoints", "kml", "geojson"]
Positive = Annotated[FiniteFloat, Field(gt=0)]
NotNegative = Annotated[FiniteFloat, Field(ge=0)]
Longitude = Annotated[FiniteFloat, Field(ge=-180, le=180)]
Latitude = Annotated[FiniteFloat, Field(ge=-85, le=85)]

HEADER = "# Made by sparsor. 'generate-mission mission.toml' makes the same mission again.\n"
PAPER_ROWS, PAPER_PROBABILITY, PAPER_THETA = 35, 0.03, 3
ALGORITHM_1_ITERATIONS = 4000
DEFAULT_BUDGET = "10%"
ALTITUDE_M, HOLD_S = 50.0, 5.0
AUTO = "auto"  # a hold that follows the sensor; a number once it is known
_NO_BUDGET = {"paper", "lambda_path", "probability", "theta"}  # turn the default budget off
# Settings that only Algorithm 1 knows: who gives one asks for it.
_ALGORITHM_1 = frozenset(
    ("paper", "rows", "probability", "theta", "lasso", "lambda_valid", "lambda_path", "lambda_incoh")
)


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class AreaSection(_Section):
    """Where: a box, or a file with a polygon."""

    bbox: tuple[float, float, float, float] | None = None
    file: Path | None = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.bbox is None) == (self.file is None):
            raise ValueError("give either a bbox (west south east north) or an area file")
        return self


class PriorSection(_Section):
    """What maps look like: a field, a model, or (neither) the built-in synthetic field."""

    field: Path | None = None
    variable: str | None = None
    time: str | None = None
    field_bbox: tuple[float, float, float, float] | None = None
    field_colormap: str | None = None
    field_range: tuple[FiniteFloat, FiniteFloat] | None = None
    model: Path | None = None
    atoms: Annotated[int, Field(ge=2, le=4096)] | None = None

    @model_validator(mode="after")
    def _field_options(self) -> Self:
        if self.field is not None and self.model is not None:
            raise ValueError("give either a field to learn from or a model, not both")
        options = {
            "variable": "--variable",
            "time": "--field-time",
            "field_bbox": "--field-bbox",
            "field_colormap": "--field-colormap",
            "field_range": "--field-range",
        }
        given = [option for name, option in options.items() if getattr(self, name) is not None]
        if given and self.field is None:
            raise ValueError(f"{', '.join(given)} only make sense with --field")
        return self


class SearchSection(_Section):
    """The search's settings; of Algorithm 1 those left out are searched (p, theta) or chosen (lambdas)."""

    planner: Literal["refined", "monte-carlo"]
    paper: bool = False
    rows: Annotated[int, Field(ge=1, le=1024)] | None = None
    probability: Annotated[FiniteFloat, Field(gt=0, le=1)] | None = None
    theta: Annotated[int, Field(ge=0)] | None = None
    lasso: Positive | None = None
    lambda_valid: NotNegative | None = None
    lambda_path: NotNegative | None = None
    lambda_incoh: NotNegative | None = None
    iterations: Annotated[int, Field(ge=1, le=100_000_000)]
    time_s: Positive | None = None
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    budget: str | None = None

    @model_validator(mode="after")
    def _theta_within_rows(self) -> Self:
        if self.theta is not None and self.rows is not None and self.theta > self.rows:
            raise ValueError(f"theta is {self.theta}; it has to be 0..{self.rows}, the number of rows of Phi")
        return self

    @model_validator(mode="after")
    def _refined_on_its_own(self) -> Self:
        foreign = _of_algorithm_1({name: getattr(self, name) for name in _ALGORITHM_1})
        if self.planner == "refined" and foreign:
            raise ValueError(
                f"{', '.join(foreign)}: the refined planner does not know what only Algorithm 1 has; leave it out, or "
                "take the monte-carlo planner"
            )
        return self

    @field_validator("budget")
    @classmethod
    def _readable(cls, budget: str | None) -> str | None:
        from sparsor.design.budget import parse_budget

        if budget is not None:
            parse_budget(budget)
        return budget

    @model_validator(mode="before")
    @classmethod
    def _fill(cls, given: Any) -> Any:  # noqa: ANN401 (pydantic hands over whatever was given)
        """Fill in what the planner, `--paper` and the missing budget imply, so that mission.toml states it."""
        if not isinstance(given, dict):
            return given
        filled = {key: value for key, value in given.items() if value is not None}
        filled.setdefault("planner", "monte-carlo" if _of_algorithm_1(filled) else "refined")
        if filled["planner"] == "refined":
            from sparsor.design.refined import DEFAULT_ITERATIONS

            filled.setdefault("iterations", DEFAULT_ITERATIONS)
            filled.setdefault("budget", DEFAULT_BUDGET)
            return filled
        filled.setdefault("iterations", ALGORITHM_1_ITERATIONS)
        filled.setdefault("rows", PAPER_ROWS)
        filled.setdefault("lambda_valid", 1.0)
        both = "probability" in filled and "theta" in filled
        no_default = filled.get("paper") or "lambda_path" in filled or both
        if "budget" not in filled and no_default:
            filled.setdefault("probability", PAPER_PROBABILITY)
            filled.setdefault("theta", min(PAPER_THETA, filled["rows"]))
        elif "budget" not in filled:
            filled["budget"] = DEFAULT_BUDGET
        return filled


class FlightSection(_Section):
    """What flies, how high, how fast, from where."""

    vehicle: str = "quad"
    autopilot: Literal["ardupilot", "px4"] = "ardupilot"
    altitude_m: Annotated[FiniteFloat, Field(ge=0, le=20_000)] = ALTITUDE_M
    speed_m_s: Annotated[FiniteFloat, Field(gt=0, le=200)] | None = None
    hold_s: Annotated[FiniteFloat, Field(ge=0, le=65_535)] = HOLD_S
    home: tuple[Longitude, Latitude] | None = None
    home_altitude_m: Annotated[FiniteFloat, Field(ge=-500, le=9000)] | None = None
    fence_margin_m: Annotated[FiniteFloat, Field(ge=5, le=5000)] = 50.0
    wind: tuple[FiniteFloat, FiniteFloat] | None = None
    sorties: bool = True
    keep_out: tuple[Path, ...] = ()
    keep_out_margin_m: Annotated[FiniteFloat, Field(ge=1, le=10_000)] = 30.0
    homes: tuple[tuple[Longitude, Latitude], ...] = ()
    drop_unreachable: bool = False
    vehicles: Annotated[int, Field(ge=1, le=8)] = 1
    separation_m: Annotated[FiniteFloat, Field(ge=1, le=1000)] = 10.0
    terrain: Path | None = None
    terrain_tolerance_m: Annotated[FiniteFloat, Field(gt=0, le=1000)] | None = None
    trigger: tuple[str, ...] | None = None

    @field_validator("wind")
    @classmethod
    def _blows(cls, wind: tuple[float, float] | None) -> tuple[float, float] | None:
        if wind is not None:
            SteadyWind(*wind)
        return wind

    @model_validator(mode="after")
    def _homes_once(self) -> Self:
        if self.homes and self.home is not None:
            raise ValueError("give either one home or several homes, not both")
        if len(set(self.homes)) < len(self.homes):
            raise ValueError("two of the homes are the same place")
        return self

    @model_validator(mode="after")
    def _cut_where_that_is_needed(self) -> Self:
        if self.drop_unreachable and not self.sorties:
            raise ValueError("--drop-unreachable goes with sorties: leave out --no-sorties (sorties = false)")
        if self.vehicles > 1 and not self.sorties:
            raise ValueError("--vehicles goes with sorties: leave out --no-sorties (sorties = false)")
        if self.vehicles > 1 and self.terrain is not None:
            raise ValueError("--vehicles is not planned over a --terrain: give one of them")
        if self.vehicles > 1 and len(self.given_homes) not in (0, 1, self.vehicles):
            raise ValueError(
                f"{self.vehicles} vehicles and {len(self.given_homes)} homes: give one home, beside which places are "
                "looked for, or one for each vehicle"
            )
        return self

    @property
    def given_homes(self) -> tuple[tuple[float, float], ...]:
        """The homes that were given; none where the route's first stop is to be home."""
        return self.homes if self.home is None else (self.home,)

    @field_validator("trigger")
    @classmethod
    def _can_be_switched(cls, trigger: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for one in trigger or ():
            parse_trigger(one)
        return trigger

    @property
    def triggers(self) -> tuple[Trigger, ...]:
        """What is switched at the stops."""
        return tuple(parse_trigger(one) for one in self.trigger or ())

    @model_validator(mode="after")
    def _tolerance_of_a_terrain(self) -> Self:
        if self.terrain_tolerance_m is not None and self.terrain is None:
            raise ValueError("--terrain-tolerance only makes sense with --terrain")
        if self.terrain_tolerance_m is not None and self.terrain_tolerance_m >= self.altitude_m:
            raise ValueError(
                f"a terrain tolerance of {self.terrain_tolerance_m:g} m for a flight {self.altitude_m:g} m above the "
                "ground; it has to be below the height"
            )
        return self

    @property
    def steady_wind(self) -> SteadyWind:
        """The wind that is planned for."""
        return CALM if self.wind is None else SteadyWind(*self.wind)


class CoastSection(_Section):
    """Land or sea alone, by the packaged coastline or one of the user's own."""

    side: Literal["land", "sea"] | None = None
    file: Path | None = None
    accuracy_m: Annotated[FiniteFloat, Field(ge=1, le=10_000)] | None = None

    @model_validator(mode="after")
    def _together(self) -> Self:
        if self.side is None:
            raise ValueError("a coastline alone asks for nothing: add --land-only or --sea-only")
        if self.accuracy_m is not None and self.file is None:
            raise ValueError(
                "an accuracy is that of a coastline of your own (--coastline FILE); the packaged one is good to 500 m"
            )
        return self


class SensorSection(_Section):
    """What measures: a packaged profile's name or a profile's file, or the packaged sensor with another response."""

    profile: str | None = None
    t90_s: Annotated[FiniteFloat, Field(ge=0, le=86_400)] | None = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.profile is None) == (self.t90_s is None):
            raise ValueError("give either a profile (--sensor-profile) or a response time (--t90)")
        return self


class OutputSection(_Section):
    """Which files are written beside the plan."""

    export: tuple[Export, ...] = ()


class ResumeSection(_Section):
    """What was flown before: the mission's folder, its flights' logs, and which of their values to read."""

    mission: Path
    logs: Annotated[tuple[Path, ...], Field(min_length=1)]
    sensor: str | None = None
    calibration: Path | None = None


class MissionSpecification(_Section):
    """A mission as it was asked for."""

    name: str
    area: AreaSection
    prior: PriorSection = PriorSection()
    search: SearchSection = Field(default_factory=lambda: SearchSection.model_validate({}))
    flight: FlightSection = FlightSection()
    coast: CoastSection | None = None
    sensor: SensorSection | None = None
    output: OutputSection = OutputSection()
    resume: ResumeSection | None = None

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files that this mission is made from."""
        sensor = None if self.sensor is None else self.sensor.profile
        profiles = [Path(one) for one in (self.flight.vehicle, sensor) if one is not None and one.endswith(".toml")]
        coast = None if self.coast is None else self.coast.file
        paths = (
            self.area.file,
            coast,
            self.prior.field,
            self.prior.model,
            self.flight.terrain,
            *self.flight.keep_out,
            *profiles,
        )
        before = self.resume
        flown = () if before is None else (before.mission / "mission.toml", *before.logs, before.calibration)
        return tuple(path for path in (*paths, *flown) if path is not None)

    @model_validator(mode="after")
    def _resumed_by_the_refined_search(self) -> Self:
        if self.resume is not None and self.search.planner != "refined":
            raise ValueError("what is left of a mission is planned by the refined search: leave the planner out")
        return self

    @field_validator("name")
    @classmethod
    def _usable_in_file_names(cls, name: str) -> str:
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", name):
            raise ValueError("a name is 1..64 of A-Z a-z 0-9 . _ - and begins with a letter or a digit")
        return name


def specification(data: dict[str, Any], *, base: Path) -> MissionSpecification:
    """Check what was asked for.

    Parameters
    ----------
    data : dict
        The sections of mission.toml; keys whose value is None count as left out.
    base : Path
        Folder that relative paths start from.

    Raises
    ------
    MissionError
        Names each key that is wrong, its value and what is allowed.
    """
    by_the_sensor = (data.get("flight") or {}).get("hold_s") == AUTO
    if by_the_sensor:
        data = {**data, "flight": {**data["flight"], "hold_s": 0.0}}
    try:
        spec = MissionSpecification.model_validate(_without_none(data))
    except ValidationError as error:
        raise MissionError(_explain(error)) from None
    spec = _with_paths(spec, lambda path: Path(os.path.normpath(base / path)))
    if by_the_sensor:
        spec = spec.model_copy(update={"flight": spec.flight.model_copy(update={"hold_s": _dwell_s(spec)})})
    return _as_its_vehicle_moves(spec, data.get("flight") or {})


def _dwell_s(spec: MissionSpecification) -> float:
    """Return how long a stop of Algorithm 1 is dwelt at so that its sensor answers to 95 %, seconds."""
    if spec.search.planner == "refined":
        raise MissionError(
            "--hold auto is of Algorithm 1 (--planner monte-carlo): the refined planner places its dwells by the "
            "sensor's response already, and --hold is the length of one; give seconds, or leave it out"
        )
    if spec.sensor is None:
        raise MissionError("--hold auto follows the sensor's response: say which one with --t90 or --sensor-profile")
    if spec.sensor.profile is not None:
        return load_sensor(spec.sensor.profile).dwell_s
    return load_sensor().model_copy(update={"t90_s": spec.sensor.t90_s}).dwell_s


def _as_its_vehicle_moves(spec: MissionSpecification, given: Mapping[str, object]) -> MissionSpecification:
    """Fill in the height and the hold that suit the kind of vehicle, where they were not given."""
    try:
        vehicle = load_vehicle(spec.flight.vehicle)
    except VehicleError:  # said when it is flown with
        return spec
    suits: dict[str, float] = {}
    if not vehicle.flies and given.get("altitude_m") is None:
        suits["altitude_m"] = 0.0
    if vehicle.circles and given.get("hold_s") is None:
        suits["hold_s"] = 0.0
    return spec.model_copy(update={"flight": spec.flight.model_copy(update=suits)}) if suits else spec


def changed(spec: MissionSpecification, data: dict[str, Any], *, base: Path) -> MissionSpecification:
    """Return a specification with what `data` gives in place of its own; a new area replaces the old.

    Keep-outs come to those that are there: one that was left out unseen would be flown over.

    Raises
    ------
    MissionError
        As `specification` does.
    """
    merged = spec.model_dump(exclude_none=True)
    asked = _without_none(data.get("search", {}))
    search = merged["search"]
    # What was filled in follows from what is asked for now, not from what was asked for then.
    if "budget" not in asked and search.get("budget") == DEFAULT_BUDGET and _NO_BUDGET & asked.keys():
        del search["budget"]
    if "budget" in asked and "budget" not in search:
        for name, filled in (("probability", PAPER_PROBABILITY), ("theta", PAPER_THETA)):
            if search.get(name) == filled:
                del search[name]
    wanted = asked.get("planner", "monte-carlo" if _of_algorithm_1(asked) else search["planner"])
    if wanted != search["planner"]:  # what was said to the other one is not meant for it
        for name in ("planner", "iterations", *_ALGORITHM_1):
            search.pop(name, None)
    flight = merged["flight"]
    for given, replaced in (("home", "homes"), ("homes", "home")):
        if data.get("flight", {}).get(given):
            flight.pop(replaced, None)
    if _without_none(data.get("flight", {})).get("vehicle", flight["vehicle"]) != flight["vehicle"]:
        for name, usual in (("altitude_m", (ALTITUDE_M, 0.0)), ("hold_s", (HOLD_S, 0.0))):
            if flight[name] in usual:  # it suited the vehicle of then
                del flight[name]
    there, added = flight.get("keep_out", ()), _without_none(data.get("flight", {})).get("keep_out", ())
    for section, values in _without_none(data).items():
        if section in ("area", "sensor") and values:  # of two that exclude each other
            merged[section] = values
        elif isinstance(values, dict):
            merged[section] = {**merged.get(section, {}), **values}
        else:
            merged[section] = values
    if added:
        merged["flight"]["keep_out"] = tuple(dict.fromkeys((base / path).resolve() for path in (*there, *added)))
    return specification(merged, base=base)


def read_specification(path: Path) -> MissionSpecification:
    """Read a mission.toml; paths in it start from its own folder.

    Raises
    ------
    MissionError
        When it cannot be read or something in it is wrong.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise MissionError(f"'{path}' cannot be read as a mission specification: {error}") from error
    try:
        return specification(data, base=path.absolute().parent)
    except MissionError as error:
        raise MissionError(f"'{path}': {error}") from None


def specification_toml(spec: MissionSpecification, folder: Path) -> bytes:
    """Return the mission.toml of a specification, with paths relative to the folder it will lie in."""

    def relative(path: Path) -> Path:
        try:
            return Path(Path(os.path.relpath(path, folder.absolute())).as_posix())
        except ValueError:  # another drive
            return path

    data = _with_paths(spec, relative).model_dump(mode="json", exclude_none=True)
    return (HEADER + tomli_w.dumps(data)).encode()


def _with_paths(spec: MissionSpecification, change: Any) -> MissionSpecification:  # noqa: ANN401
    def moved(section: Any, *names: str) -> Any:  # noqa: ANN401
        paths = {name: change(getattr(section, name)) for name in names if getattr(section, name) is not None}
        return section.model_copy(update=paths)

    flight = spec.flight
    if flight.vehicle.endswith(".toml"):
        flight = flight.model_copy(update={"vehicle": change(Path(flight.vehicle)).as_posix()})
    flight = moved(flight.model_copy(update={"keep_out": tuple(change(path) for path in flight.keep_out)}), "terrain")
    sensor = spec.sensor
    if sensor is not None and sensor.profile is not None and sensor.profile.endswith(".toml"):
        sensor = sensor.model_copy(update={"profile": change(Path(sensor.profile)).as_posix()})
    resume = spec.resume
    if resume is not None:
        logs = tuple(change(path) for path in resume.logs)
        resume = moved(resume, "mission", "calibration").model_copy(update={"logs": logs})
    return spec.model_copy(
        update={
            "area": moved(spec.area, "file"),
            "coast": spec.coast and moved(spec.coast, "file"),
            "prior": moved(spec.prior, "field", "model"),
            "flight": flight,
            "sensor": sensor,
            "resume": resume,
        }
    )


def _of_algorithm_1(settings: Mapping[str, object]) -> list[str]:
    """Return the names of the settings given that only Algorithm 1 knows."""
    return [name for name in sorted(_ALGORITHM_1) if settings.get(name) is not None and settings[name] is not False]


def _without_none(data: dict[str, Any]) -> dict[str, Any]:
    kept = {key: value for key, value in data.items() if value is not None}
    return {key: _without_none(value) if isinstance(value, dict) else value for key, value in kept.items()}


def _explain(error: ValidationError) -> str:
    sentences = []
    for fault in error.errors():
        place = ".".join(str(part) for part in fault["loc"]) or "the specification"
        reason = fault["msg"].removeprefix("Value error, ")
        given = "" if isinstance(fault["input"], dict) else f", given {fault['input']!r}"
        sentences.append(f"{place}: {reason}{given}")
    return "; ".join(dict.fromkeys(sentences))
