"""`sparsor reconstruct`, also `reconstruct-map`: from flight logs and a mission to the map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from sparsor.cli.console import (
    Json,
    Talk,
    Verbose,
    print_json,
    print_table,
    progress_bar,
    quiet_option,
    reporting,
    warn,
)

MISSION, SENSOR, MAP, OUTPUT = "The mission that was flown", "The sensor", "The map", "Output"
Choice = Literal["auto", "lasso", "lasso-sums", "mmse", "kriging", "blend"]


@reporting
def reconstruct(
    logs: Annotated[
        list[Path],
        typer.Argument(metavar="LOG...", help="One mission's .tlog, .BIN, .ulg or .csv, also packed by gzip or xz."),
    ],
    mission: Annotated[
        Path | None,
        typer.Option("--mission", metavar="DIR", help="Its folder.", rich_help_panel=MISSION, show_default=False),
    ] = None,
    plan: Annotated[
        Path | None,
        typer.Option(
            "--plan",
            metavar="FILE.plan",
            help="Instead of a folder: anybody's plan, with --bbox.",
            rich_help_panel=MISSION,
            show_default=False,
        ),
    ] = None,
    bbox: Annotated[
        tuple[float, float, float, float] | None,
        typer.Option(
            "--bbox", metavar="W S E N", help="Box of the map, degrees.", rich_help_panel=MISSION, show_default=False
        ),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            metavar="FILE.npz",
            help="With --plan: what maps look like (default: the built-in model of the box's size).",
            rich_help_panel=MISSION,
            show_default=False,
        ),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            "--sensor",
            metavar="NAME|MSG.FIELD",
            help="Named value, NAME@SYSTEM/COMPONENT, or field of a .BIN; needed where the log holds several.",
            rich_help_panel=SENSOR,
            show_default=False,
        ),
    ] = None,
    sensor_profile: Annotated[
        Path | None,
        typer.Option(
            "--sensor-profile",
            metavar="FILE.toml",
            help="Its unit, response, noise and range.",
            rich_help_panel=SENSOR,
            show_default=False,
        ),
    ] = None,
    system: Annotated[
        int | None,
        typer.Option(
            "--system",
            metavar="ID",
            min=1,
            max=255,
            help="The vehicle, where the log holds several.",
            rich_help_panel=SENSOR,
            show_default=False,
        ),
    ] = None,
    t90: Annotated[
        float | None,
        typer.Option(
            "--t90",
            metavar="S",
            help="Time to 90 % of a step, whose lag is undone (default: the profile's; without one none is).",
            rich_help_panel=SENSOR,
            show_default=False,
        ),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            "--calibration",
            metavar="FILE.toml",
            help="Zero, span, temperature, humidity and cross-sensitivities.",
            rich_help_panel=SENSOR,
            show_default=False,
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(
            "--unit",
            metavar="ppb|ug/m3|...",
            help="Of the map: converted to from the profile's or calibration's; without these the readings' own.",
            rich_help_panel=SENSOR,
            show_default=False,
        ),
    ] = None,
    decoder: Annotated[
        Choice, typer.Option("--decoder", help="auto: what the validation maps choose.", rich_help_panel=MAP)
    ] = "auto",
    finer: Annotated[
        int, typer.Option("--finer", metavar="K", min=1, help="Map K times finer than the grid.", rich_help_panel=MAP)
    ] = 1,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="A .tif, .nc, .png, .html or .csv; may be repeated (default: all, named after the mission, into its "
            "folder, with --plan into this one).",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace files that are there.", rich_help_panel=OUTPUT)
    ] = False,
    as_json: Json = False,
    quiet: Annotated[bool, quiet_option("Print only warnings and the paths of what was made.")] = False,
    verbose: Verbose = False,
) -> None:
    """Turn a flight's logs into the map, with its uncertainty.

    reconstruct-map flight.tlog --mission missions/doha
    """
    from sparsor.journeys.mapfiles import map_files, write_map
    from sparsor.journeys.mapsummary import map_rows, map_values
    from sparsor.journeys.reconstructing import ReconstructRequest, requested_mission
    from sparsor.journeys.reconstructing import reconstruct as reconstruct_map

    talk = Talk.of(quiet=quiet, verbose=verbose)
    request = ReconstructRequest(
        logs=tuple(logs),
        mission=mission,
        plan=plan,
        bbox=bbox,
        model=model,
        sensor=sensor,
        system=system,
        profile=sensor_profile,
        calibration=calibration,
        unit=unit,
        t90_s=t90,
        decoder=decoder,
        finer=finer,
    )
    with progress_bar(talk) as progress:
        flown = requested_mission(request, progress=progress)
        files = map_files(output or (), flown, request.inputs, force=force)
        made = reconstruct_map(request, flown, progress=progress)
        write_map(made, files)
    if as_json:
        print_json(map_values(made, files))
        return
    warn(made.warnings)
    if talk is not Talk.QUIET:
        details = [(f"  {name}", value) for name, value in made.field_map.facts.items()] if verbose else []
        print_table([*map_rows(made), *details], flown.name)
    typer.echo("\n".join(str(path) for path in files))
