"""`sparsor record`: a link to a .tlog."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from sparsor.cli.console import (
    Json,
    Quiet,
    Talk,
    Verbose,
    ended_by_signals,
    interrupt,
    print_json,
    progress_bar,
    reporting_as,
)
from sparsor.cli.upload import CONNECT_HELP


@reporting_as("interrupted: whatever had come is recorded")
def record(
    connect: Annotated[str, typer.Option("--connect", metavar="URL", help=CONNECT_HELP)],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE.tlog", help="Where to.")],
    seconds: Annotated[
        float, typer.Option("--seconds", metavar="S", min=0.1, help="How long; until Ctrl-C when not given.")
    ] = math.inf,
    timeout: Annotated[
        float, typer.Option("--timeout", metavar="S", min=0.1, help="How long to wait for the first frame.")
    ] = 30.0,
    listen_only: Annotated[
        bool, typer.Option("--listen-only", help="Send nothing: no heartbeat, no request for positions.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Record everything that passes on a link, both directions, to a .tlog. Ctrl-C or a request to terminate ends it.

    sparsor record --connect udpin://0.0.0.0:14550 -o flight.tlog
    """
    from sparsor.link.recorder import record as record_link

    talk = Talk.of(quiet=quiet, verbose=verbose)
    with progress_bar(talk) as progress, ended_by_signals(interrupt):
        made = record_link(
            connect,
            output,
            seconds=seconds,
            timeout_s=timeout,
            listen_only=listen_only,
            replace=force,
            progress=progress,
        )
    if as_json:
        print_json(
            {
                "file": str(made.file),
                "messages": made.messages,
                "received": made.received,
                "seconds": round(made.seconds, 3),
                "vehicles": [vehicle.words for vehicle in made.vehicles],
            }
        )
    elif quiet:
        typer.echo(str(made.file))
    else:
        heard = "; ".join(vehicle.words for vehicle in made.vehicles) or "no vehicle"
        typer.echo(f"{made.file}: {made.messages} messages in {made.seconds:.0f} s ({heard})")
