"""`sparsor plan`, also `generate-mission`: from a box on the map to a mission folder."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sparsor.cli.console import (
    SCHEDULER,
    Json,
    Talk,
    Verbose,
    print_columns,
    print_json,
    print_table,
    progress_bar,
    quiet_option,
    reporting,
    warn,
)
from sparsor.cli.places import homes_given
from sparsor.cli.resuming import Flown, check_asked, check_given, resumed_request
from sparsor.cli.summary import curve_table, mission_rows, mission_values

if TYPE_CHECKING:
    from sparsor.journeys.planning import PlannedMission
    from sparsor.journeys.resuming import Before
    from sparsor.mission.specification import MissionSpecification

WHERE, PRIOR, SEARCH, FLIGHT = "Where", "What maps look like", "Search", "Flight"
SENSOR, OUTPUT, RESUME = "Sensor", "Output", "Flying on where a flight was cut"
Box = tuple[float, float, float, float]


def _option(panel: str, help_text: str, *names: str, metavar: str | None = None) -> Any:  # noqa: ANN401
    return typer.Option(*names, help=help_text, rich_help_panel=panel, metavar=metavar, show_default=False)


@reporting
def plan(
    mission_file: Annotated[
        Path | None,
        typer.Argument(
            metavar="[MISSION.toml]",
            help="Make the mission that this file specifies; options change parts of it.",
            show_default=False,
        ),
    ] = None,
    bbox: Annotated[
        Box | None,
        _option(
            WHERE,
            "Box in degrees. West greater than east crosses the antimeridian.",
            "--bbox",
            metavar="W S E N",
        ),
    ] = None,
    area: Annotated[
        Path | None,
        _option(WHERE, "GeoJSON or KML with a polygon, instead of a box.", "--area", metavar="FILE"),
    ] = None,
    name: Annotated[str | None, _option(OUTPUT, "Name of the mission and its files.", "--name")] = None,
    output: Annotated[
        Path | None,
        _option(OUTPUT, "Folder to write to (default: missions/NAME).", "--output", "-o", metavar="DIR"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over another mission.", rich_help_panel=OUTPUT)] = False,
    export: Annotated[
        str | None,
        _option(OUTPUT, "Further files, comma separated: waypoints,kml,geojson.", "--export", metavar="FORMATS"),
    ] = None,
    field: Annotated[
        Path | None,
        _option(
            PRIOR,
            "Learn from this field: GeoTIFF, NetCDF, Zarr, a heatmap picture (default: the built-in synthetic field).",
            "--field",
            metavar="FILE",
        ),
    ] = None,
    variable: Annotated[str | None, _option(PRIOR, "NetCDF variable, or GeoTIFF band.", "--variable")] = None,
    field_time: Annotated[
        str | None,
        _option(PRIOR, "NetCDF time step: its index, the beginning of its date, or all.", "--field-time"),
    ] = None,
    field_bbox: Annotated[
        Box | None, _option(PRIOR, "Where a picture lies.", "--field-bbox", metavar="W S E N")
    ] = None,
    field_colormap: Annotated[
        str | None, _option(PRIOR, "Colour map a picture was drawn with, e.g. viridis.", "--field-colormap")
    ] = None,
    field_range: Annotated[
        tuple[float, float] | None,
        _option(PRIOR, "Values of a picture's first and last colour.", "--field-range", metavar="LO HI"),
    ] = None,
    model: Annotated[Path | None, _option(PRIOR, "Model made by 'sparsor learn'.", "--model", metavar="FILE")] = None,
    atoms: Annotated[int | None, _option(PRIOR, "Atoms of the dictionary, K (default: 256).", "--atoms")] = None,
    planner: Annotated[
        str | None,
        _option(
            SEARCH,
            "refined, the route of least expected error, or monte-carlo, the paper's Algorithm 1 (default: refined, "
            "or monte-carlo where an option of Algorithm 1 is given).",
            "--planner",
            metavar="NAME",
        ),
    ] = None,
    paper: Annotated[
        bool,
        typer.Option(
            "--paper",
            help="Exactly as the paper: K = N atoms, uncentred, plain path, no budget.",
            rich_help_panel=SEARCH,
        ),
    ] = False,
    budget: Annotated[
        str | None,
        _option(
            SEARCH,
            "Longest path over the stops, 10% (of full coverage) or 12km, or time in the air, 25min (default: 10%).",
            "--budget",
            metavar="LIMIT",
        ),
    ] = None,
    pareto: Annotated[
        bool,
        typer.Option(
            "--pareto",
            help="Also plan for smaller and larger budgets, and write table and picture of the error to expect of each "
            "(pareto.csv, pareto.png); takes about eight times as long.",
            rich_help_panel=SEARCH,
        ),
    ] = False,
    rows: Annotated[int | None, _option(SEARCH, "Rows of the measurement matrix, M (default: 35).", "--rows")] = None,
    probability: Annotated[
        float | None,
        _option(SEARCH, "Probability of a 1 in it, p (default: searched within the budget).", "--probability"),
    ] = None,
    theta: Annotated[
        int | None,
        _option(
            SEARCH,
            "Enhanced Sparsification: fewer ones than this empty a column (default: searched).",
            "--theta",
        ),
    ] = None,
    lasso: Annotated[
        float | None, _option(SEARCH, "l1 weight lambda (default: the model's choice).", "--lasso")
    ] = None,
    lambda_valid: Annotated[
        float | None, _option(SEARCH, "Weight of the validation error (default: 1).", "--lambda-valid")
    ] = None,
    lambda_path: Annotated[
        float | None,
        _option(SEARCH, "Weight of the path length; turns the default budget off.", "--lambda-path"),
    ] = None,
    lambda_incoh: Annotated[float | None, _option(SEARCH, "Weight of the incoherence.", "--lambda-incoh")] = None,
    iterations: Annotated[
        int | None,
        _option(SEARCH, "Monte-Carlo samples (default: 4000), or moves of refined (480000).", "--iterations"),
    ] = None,
    time: Annotated[
        float | None,
        _option(
            SEARCH,
            "Search for this long, not by --iterations; the plan then depends on the machine.",
            "--time",
            metavar="SECONDS",
        ),
    ] = None,
    seed: Annotated[int | None, _option(SEARCH, "Seed of the search (default: 0).", "--seed")] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers",
            help="Threads, or processes of --scheduler local (default: one a core); the plan is the same for any.",
            rich_help_panel=SEARCH,
            min=1,
            show_default=False,
        ),
    ] = None,
    scheduler: Annotated[str | None, _option(SEARCH, SCHEDULER, "--scheduler", metavar="local|ADDRESS")] = None,
    vehicle: Annotated[
        str | None,
        _option(
            FLIGHT,
            "quad, plane, vtol, rover, boat, or a profile of your own (.toml) (default: quad).",
            "--vehicle",
            metavar="NAME|FILE.toml",
        ),
    ] = None,
    autopilot: Annotated[
        str | None, _option(FLIGHT, "ardupilot or px4 (default: ardupilot).", "--autopilot", metavar="NAME")
    ] = None,
    altitude: Annotated[
        float | None,
        _option(
            FLIGHT,
            "Height above home, or above the ground of --terrain, m (default: 50; 0 for rovers and boats).",
            "--altitude",
            metavar="M",
        ),
    ] = None,
    speed: Annotated[
        float | None,
        _option(
            FLIGHT,
            "Speed along legs, m/s (default: the vehicle's); airspeed of planes.",
            "--speed",
            metavar="M_S",
        ),
    ] = None,
    hold: Annotated[
        str | None,
        _option(
            FLIGHT,
            "Dwell time at each stop of Algorithm 1, s, or auto: until the sensor (--t90, --sensor-profile) shows 95 % "
            "of a step; one dwell of the refined search, which places as many as pay by itself (default: 5; planes and "
            "VTOLs: 0, flown through, and circles otherwise).",
            "--hold",
            metavar="S|auto",
        ),
    ] = None,
    home: Annotated[
        list[str] | None,
        _option(
            FLIGHT,
            "Take-off and landing place (default: the first stop); repeatable: each flight has the best of them.",
            "--home",
            metavar="LON LAT",
        ),
    ] = None,
    home_altitude: Annotated[
        float | None,
        _option(FLIGHT, "Height of home above mean sea level, m.", "--home-altitude", metavar="M"),
    ] = None,
    wind: Annotated[
        tuple[float, float] | None,
        _option(FLIGHT, "Wind to plan for: m/s, and where it comes from.", "--wind", metavar="SPEED FROM_DEG"),
    ] = None,
    sorties: Annotated[
        bool | None,
        typer.Option(
            "--sorties/--no-sorties",
            help="Whether a route beyond one battery is cut into flights from home and back, NAME-1.plan, NAME-2.plan "
            "... (default), or stays one planning study.",
            rich_help_panel=FLIGHT,
            show_default=False,
        ),
    ] = None,
    drop_unreachable: Annotated[
        bool,
        typer.Option("--drop-unreachable", help="Leave out stops beyond reach of one battery.", rich_help_panel=FLIGHT),
    ] = False,
    vehicles: Annotated[
        int | None,
        _option(FLIGHT, "Fly with this many at once, 1..8, each on a part; in rounds if need be.", "--vehicles"),
    ] = None,
    separation: Annotated[
        float | None,
        _option(FLIGHT, "Least distance between vehicles at once, m (default: 10).", "--separation", metavar="M"),
    ] = None,
    keep_out: Annotated[
        list[Path] | None,
        _option(
            FLIGHT,
            "GeoJSON or KML of what not to fly over: polygons, and circles as points with radius_m; repeatable, added "
            "to those of FILE.toml or --mission (which can be edited).",
            "--keep-out",
            metavar="FILE",
        ),
    ] = None,
    keep_out_margin: Annotated[
        float | None,
        _option(FLIGHT, "Least distance to a keep-out, m (default: 30).", "--keep-out-margin", metavar="M"),
    ] = None,
    land_only: Annotated[
        bool, typer.Option("--land-only", help="Fly and map no cell of sea.", rich_help_panel=WHERE)
    ] = False,
    sea_only: Annotated[
        bool, typer.Option("--sea-only", help="Fly and map no cell of land.", rich_help_panel=WHERE)
    ] = False,
    coastline: Annotated[
        Path | None,
        _option(WHERE, "Polygons of land (default: GSHHG, 40-64 E, 18-34 N).", "--coastline", metavar="FILE"),
    ] = None,
    coastline_accuracy: Annotated[
        float | None,
        _option(
            WHERE, "How good that file is, kept as a margin, m (default: 500).", "--coastline-accuracy", metavar="M"
        ),
    ] = None,
    terrain: Annotated[
        Path | None,
        _option(
            FLIGHT,
            "Elevation model (GeoTIFF): --altitude is kept above it along all legs. It knows no trees and buildings.",
            "--terrain",
            metavar="DEM.tif",
        ),
    ] = None,
    terrain_tolerance: Annotated[
        float | None,
        _option(
            FLIGHT,
            "How much lower or higher a leg may be (default: a tenth of --altitude, 2 m at least).",
            "--terrain-tolerance",
            metavar="M",
        ),
    ] = None,
    trigger: Annotated[
        list[str] | None,
        _option(
            FLIGHT,
            "Switched on at each stop that is dwelt at and off after it: servo:CHANNEL:PWM_ON:PWM_OFF, relay:NUMBER, "
            "message:ID (to a script; these ArduPilot only); camera-distance:METRES from the first stop to the last. "
            "Repeatable.",
            "--trigger",
            metavar="WHAT",
        ),
    ] = None,
    sensor_profile: Annotated[
        str | None,
        _option(
            SENSOR,
            "no2, or a profile of your own (.toml): planned for, and told to reconstruct-map (default: no2, none with "
            "Algorithm 1).",
            "--sensor-profile",
            metavar="NAME|FILE.toml",
        ),
    ] = None,
    t90: Annotated[
        float | None,
        _option(SENSOR, "Instead: no2 with this time to 90 % of a step, s; 0 answers at once.", "--t90", metavar="S"),
    ] = None,
    resume: Annotated[
        list[Path] | None,
        _option(
            RESUME,
            "Log of a flight of --mission: what it measured is kept, and the rest is planned anew within the budget "
            "left; repeatable.",
            "--resume",
            metavar="LOG",
        ),
    ] = None,
    mission: Annotated[
        Path | None, _option(RESUME, "Folder of the mission that was flown.", "--mission", metavar="DIR")
    ] = None,
    sensor: Annotated[
        str | None,
        _option(RESUME, "Named value to read, where the log holds several.", "--sensor", metavar="NAME|MSG.FIELD"),
    ] = None,
    calibration: Annotated[
        Path | None, _option(RESUME, "Calibration of its readings.", "--calibration", metavar="FILE.toml")
    ] = None,
    as_json: Json = False,
    quiet: Annotated[bool, quiet_option("Print only the plan's path, and what speaks against flying it.")] = False,
    verbose: Verbose = False,
) -> None:
    """Plan the flight whose samples rebuild the whole map, and write it as a QGroundControl plan.

    generate-mission --bbox 51.50 25.27 51.53 25.30 --name doha
    """
    talk = Talk.of(quiet=quiet, verbose=verbose)
    given = {
        "name": name,
        "area": {"bbox": bbox, "file": area},
        "prior": {
            "field": field,
            "variable": variable,
            "time": field_time,
            "field_bbox": field_bbox,
            "field_colormap": field_colormap,
            "field_range": field_range,
            "model": model,
            "atoms": atoms,
        },
        "search": {
            "planner": planner,
            "paper": paper or None,
            "rows": rows,
            "probability": probability,
            "theta": theta,
            "lasso": lasso,
            "lambda_valid": lambda_valid,
            "lambda_path": lambda_path,
            "lambda_incoh": lambda_incoh,
            "iterations": iterations,
            "time_s": time,
            "seed": seed,
            "budget": budget,
        },
        "flight": {
            "vehicle": vehicle,
            "autopilot": autopilot,
            "altitude_m": altitude,
            "speed_m_s": speed,
            "hold_s": _number(hold),
            **homes_given(home),
            "home_altitude_m": home_altitude,
            "wind": wind,
            "sorties": sorties,
            "drop_unreachable": drop_unreachable or None,
            "vehicles": vehicles,
            "separation_m": separation,
            "keep_out": tuple(keep_out) if keep_out else None,
            "keep_out_margin_m": keep_out_margin,
            "terrain": terrain,
            "trigger": tuple(trigger) if trigger else None,
            "terrain_tolerance_m": terrain_tolerance,
        },
        "coast": _coast(coastline, coastline_accuracy, land_only=land_only, sea_only=sea_only),
        "sensor": {"profile": sensor_profile, "t90_s": t90} if (sensor_profile, t90) != (None, None) else None,
        "output": {"export": _formats(export)},
    }
    before: Before | None = None
    flown = Flown(mission, tuple(resume or ()), sensor, calibration)
    if flown.is_asked:
        check_asked(flown, given, mission_file, pareto=pareto)
        given["name"] = name or (None if output is None else _cleaned(output.resolve().name))
        with progress_bar(talk) as progress:
            spec, folder, before = resumed_request(flown, given, output, progress)
    else:
        spec, folder = _request(given, mission_file, output)
        if spec.resume is not None:
            check_given(given, pareto=pareto)
    from sparsor.core.schedulers import workers_at
    from sparsor.journeys.advice import advice
    from sparsor.journeys.folder import check_folder, write_mission
    from sparsor.journeys.pareto import curve_files, curve_rows, plan_with_curve
    from sparsor.journeys.planning import plan_mission

    check_folder(spec, folder, force=force)
    curve: tuple[PlannedMission, ...] = ()
    with workers_at(scheduler, workers) as hands, progress_bar(talk) as progress:
        if pareto:
            planned, curve = plan_with_curve(spec, workers=hands, progress=progress)
        else:
            planned = plan_mission(spec, before=before, workers=hands, progress=progress)
    written = write_mission(planned, folder, beside=curve_files(planned, curve) if curve else None)
    result = mission_values(planned, folder)
    if as_json:
        if curve:
            result["pareto"] = curve_rows(curve)
        print_json(result)
        return
    # What says that a mission cannot fly, or is a slip, is said even to those who asked for quiet.
    warn(advice(planned) if talk is Talk.QUIET else planned.warnings)
    if talk is Talk.QUIET:
        typer.echo("\n".join(str(written[file]) for file in planned.plan_files))
        return
    print_table(mission_rows(planned, details=talk is Talk.VERBOSE), spec.name)
    if curve:
        print_columns(*curve_table(planned, curve))
    typer.echo(f"written to {folder}: {', '.join(written)}")


def _coast(file: Path | None, accuracy_m: float | None, *, land_only: bool, sea_only: bool) -> dict[str, Any] | None:
    """Return the section of the coast, None where nothing of it was asked for."""
    from sparsor.errors import MissionError

    if land_only and sea_only:
        raise MissionError("--land-only and --sea-only leave nothing to fly: give one of them")
    side = "land" if land_only else "sea" if sea_only else None
    asked = {"side": side, "file": file, "accuracy_m": accuracy_m}
    return asked if any(value is not None for value in asked.values()) else None


def _request(
    given: dict[str, Any], mission_file: Path | None, output: Path | None
) -> tuple[MissionSpecification, Path]:
    """Return what is asked for and the folder it goes to."""
    from sparsor.errors import MissionError
    from sparsor.mission.specification import changed, read_specification, specification

    if mission_file is not None:
        spec = changed(read_specification(mission_file), given, base=Path.cwd())
        own = mission_file.name == "mission.toml" and given["name"] is None
        beside = mission_file.parent if own else Path("missions") / spec.name
        return spec, output or beside
    box, area = given["area"]["bbox"], given["area"]["file"]
    if box is None and area is None:
        raise MissionError(
            "where? Give --bbox WEST SOUTH EAST NORTH in degrees, --area FILE.geojson, or a mission.toml"
        )
    if box is not None and area is None:
        from sparsor.geodesy import BoundingBox

        BoundingBox(*box)  # its errors say more than the specification's
    if given["name"] is None:
        given["name"] = _default_name(box, area) if output is None else _cleaned(output.resolve().name)
    try:
        spec = specification(given, base=Path.cwd())
    except MissionError as error:
        raise MissionError(_as_typed(str(error))) from None
    return spec, output or Path("missions") / spec.name


def _as_typed(message: str) -> str:
    """Return a message about keys of mission.toml as one about the options that were typed for them."""
    message = message.replace("search.time_s", "--time").replace("prior.time", "--field-time")
    message = message.replace("coast.file", "--coastline").replace("coast.accuracy_m", "--coastline-accuracy")
    message = re.sub(r"\bcoast: ", "--coastline: ", message)
    message = re.sub(r"\bflight\.homes\b(?:\.\d+)?", "flight.home", message)
    message = re.sub(r"\b(?:search|flight|prior|sensor|output)\.(\w+?)(?:_m|_m_s|_s)?(?:\.\d+)?:", r"--\1:", message)
    message = re.sub(r"\barea\.(?:\w+\.)?bbox(?:\.\d+)?:|\barea:", "--bbox or --area:", message)
    return re.sub(r"--[a-z_]+:", lambda option: option[0].replace("_", "-"), message)


def _number(text: str | None) -> float | str | None:
    """Return a number where there is one; what else was typed is judged with the rest."""
    try:
        return None if text is None else float(text)
    except ValueError:
        return text


def _cleaned(name: str) -> str:
    """Return a name that can stand in file names everywhere."""
    return re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-._")[:64] or "mission"


def _default_name(box: Box | None, area: Path | None) -> str:
    if area is not None:
        return _cleaned(area.stem)
    assert box is not None
    return "box_" + "_".join(f"{side:g}" for side in box)


def _formats(export: str | None) -> list[str] | None:
    return None if export is None else [part.strip() for part in export.split(",") if part.strip()]
