"""`sparsor check`: what is wrong with a plan, before it is flown."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sparsor.cli.console import Json, Verbose, print_json, quiet_option, reporting_as, warn


@reporting_as("interrupted")
def check(
    plan: Annotated[
        Path, typer.Argument(metavar="DIR|FILE.plan", help="A folder with plans, or a plan, ours or anybody's.")
    ],
    vehicle: Annotated[
        str | None,
        typer.Option(
            "--vehicle",
            help="quad, plane, vtol, rover, boat, or a profile of your own (.toml) (default: the mission's).",
            metavar="NAME|FILE.toml",
            show_default=False,
        ),
    ] = None,
    terrain: Annotated[
        Path | None,
        typer.Option(
            "--terrain",
            help="Elevation model (GeoTIFF) to check the legs against (default: the mission's).",
            metavar="DEM.tif",
            show_default=False,
        ),
    ] = None,
    clearance: Annotated[
        float | None,
        typer.Option(
            "--clearance",
            help="Least height above it, m (default: the mission's height less its tolerance, 10 of other plans).",
            metavar="M",
            show_default=False,
        ),
    ] = None,
    as_json: Json = False,
    quiet: Annotated[bool, quiet_option("Print only the faults.")] = False,
    verbose: Verbose = False,
) -> None:
    """Check a plan: limits, order, positions, legs against fences and terrain, home, endurance, edits.

    Ends with 1 when it finds a fault. It knows no rules of the air and no obstacles.

    sparsor check missions/doha
    """
    del verbose
    from sparsor.journeys.checking import check_plans

    found = check_plans(plan, vehicle, terrain=terrain, clearance_m=clearance)
    if as_json:
        print_json(
            {
                "plans": [str(one) for one in found.plans],
                "faults": list(found.faults),
                "warnings": list(found.warnings),
                "vehicles_apart_m": found.apart_m,
            }
        )
    else:
        if not quiet:
            warn(found.warnings)
        for fault in found.faults:
            typer.echo(fault)
        if not quiet and not found.faults:
            typer.echo(f"{', '.join(one.name for one in found.plans)}: no fault noticed")
        if not quiet and found.apart_m is not None:
            typer.echo(f"vehicles at once: planned paths {found.apart_m:.1f} m apart at least, whenever each starts")
    if found.faults:
        raise typer.Exit(1)
