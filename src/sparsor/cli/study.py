"""`sparsor study`: the paper's figures and the scoreboard, over any field."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from sparsor.cli.console import (
    SCHEDULER,
    Json,
    Quiet,
    Talk,
    Verbose,
    print_json,
    progress_bar,
    reporting_as,
)


@reporting_as("interrupted: what was finished is kept, the same command goes on from there")
def study(
    fields: Annotated[
        list[Path] | None,
        typer.Option(
            "--field", metavar="FILE", help="GeoTIFF or NetCDF; may be repeated (default: the built-in field)."
        ),
    ] = None,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of tables and pictures.")
    ] = Path("study"),
    results: Annotated[
        Path | None,
        typer.Option("--results", metavar="FILE.md", help="The page (default: results.md in DIR).", show_default=False),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A small study, to see that all is there.")] = False,
    peers_python: Annotated[
        str | None,
        typer.Option(
            "--peers-python",
            metavar="PATH",
            help="A Python that has planners by others, sgptools or python-sensors: they run too (default: this one, "
            "where it has them).",
            show_default=False,
        ),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="local|ADDRESS", help=SCHEDULER, show_default=False)
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Check the method on a field: what the paper claims, what holds, and what is better.

    sparsor study --field no2.tif -o study --quick
    """
    from sparsor.core.schedulers import workers_at
    from sparsor.journeys.studying import StudyRequest, study

    talk = Talk.of(quiet=quiet, verbose=verbose)
    words = ["sparsor", "study", *(word for path in fields or () for word in ("--field", path.name))]
    words += ["-o", str(output), *(("--results", str(results)) if results else ()), *(("--quick",) if quick else ())]
    words += ["--peers-python", "PATH"] if peers_python else []
    request = StudyRequest(tuple(fields or ()), output, results, shlex.join(words), quick, peers_python=peers_python)
    with workers_at(scheduler) as hands, progress_bar(talk) as progress:
        done = study(request, workers=hands, progress=progress)
    if as_json:
        print_json({"results": str(done.page), "files": [str(path) for path in done.files]})
        return
    if talk is not Talk.QUIET:
        for one in done.results:
            typer.echo(one.claims.text())
            for figure in one.figures:
                typer.echo(f"{figure.title}. Paper: {figure.claimed}. Here: {figure.found}.")
            typer.echo("")
    typer.echo(done.page)
