"""`sparsor fetch`: training fields from public archives."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sparsor.cli.console import (
    Json,
    Quiet,
    Talk,
    Verbose,
    print_json,
    print_table,
    progress_bar,
    reporting_as,
)


@reporting_as("interrupted: what has arrived is kept, the same command goes on from there")
def fetch(
    archive: Annotated[str | None, typer.Argument(metavar="[ARCHIVE]", help="Its name; without one: a list.")] = None,
    months: Annotated[
        list[str] | None, typer.Option("--month", metavar="YYYY-MM", help="May be repeated.", show_default=False)
    ] = None,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the files.")] = Path(),
    bbox: Annotated[
        tuple[float, float, float, float] | None,
        typer.Option("--bbox", metavar="W S E N", help="Only this part.", show_default=False),
    ] = None,
    catalogue: Annotated[
        Path | None, typer.Option("--catalogue", metavar="FILE.toml", help="Other archives.", show_default=False)
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite files that are there.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Fetch monthly NO2 fields of the whole Earth, to learn from: no account needed.

    sparsor fetch omi --month 2020-09 --bbox 45 22 58 31
    """
    from sparsor.journeys.fetching import fetch
    from sparsor.prior.archives import catalogue as read_catalogue

    talk = Talk.of(quiet=quiet, verbose=verbose)
    if archive is None:
        known = read_catalogue(catalogue).archive
        if as_json:
            print_json({"archives": [{"name": one.name, "title": one.title, "first": one.first} for one in known]})
        else:
            print_table([(one.name, f"{one.title}; from {one.first}. {one.licence}") for one in known], "archives")
        return
    if not months:
        raise typer.BadParameter("say which, like --month 2020-09", param_hint="--month")
    with progress_bar(talk) as progress:
        done = fetch(archive, tuple(months), output, box=bbox, catalogue_file=catalogue, force=force, progress=progress)
    if as_json:
        files = [{"file": str(one.path), "url": one.url, "sha256": one.sha256, "cached": one.cached} for one in done]
        print_json({"files": files})
        return
    for one in done:
        where = "from the cache" if one.cached else f"from {one.url}"
        typer.echo(one.path if talk is Talk.QUIET else f"{one.path}: {one.shape[0]} x {one.shape[1]} pixels, {where}")
