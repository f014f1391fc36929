"""`sparsor inspect`: what a plan, model, sidecar, specification or flight log holds, in words."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sparsor.cli.console import Json, Verbose, print_json, quiet_option, reporting_as


@reporting_as("interrupted")
def inspect(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE|DIR",
            help="A .plan or its folder, a model or sidecar (.npz), a mission.toml, or a flight log (.tlog, .BIN, "
            ".ulg, .csv).",
        ),
    ],
    as_json: Json = False,
    quiet: Annotated[bool, quiet_option("Print only what kind of file it is.")] = False,
    verbose: Verbose = False,
) -> None:
    """Say in words what a file holds.

    sparsor inspect missions/doha/doha.plan
    """
    del verbose
    from sparsor.journeys.inspection import inspect_file

    found = inspect_file(file)
    if as_json:
        print_json({"kind": found.kind, **found.contents})
    elif quiet:
        typer.echo(found.kind)
    else:
        typer.echo("\n".join(found.lines))
