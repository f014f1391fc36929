"""`sparsor inspect`: what a plan, model, sidecar or specification holds, in words."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sparsor.cli.console import Json, Quiet, Verbose, print_json, reporting


@reporting
def inspect(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A .plan, a model or sidecar (.npz), or a mission.toml.")
    ],
    as_json: Json = False,
    quiet: Quiet = False,
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
