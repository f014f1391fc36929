"""`sparsor download`: the vehicle's own log."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

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
from sparsor.cli.upload import CONNECT_HELP
from sparsor.errors import InputError

WHICH = "Which logs"


@reporting
def download(
    connect: Annotated[str, typer.Option("--connect", metavar="URL", help=CONNECT_HELP)],
    output: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE|DIR/",
            help="Where to; in a folder it gets the vehicle's name (DIR/ is made when it is missing).",
        ),
    ] = ".",
    log: Annotated[
        int | None,
        typer.Option(
            "--log", metavar="N", min=0, help="By the vehicle's number; default the last.", rich_help_panel=WHICH
        ),
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="All of them.", rich_help_panel=WHICH)] = False,
    only_list: Annotated[bool, typer.Option("--list", help="Say what there is.", rich_help_panel=WHICH)] = False,
    system: Annotated[
        int | None, typer.Option("--system", metavar="ID", min=1, max=255, help="Which vehicle, by MAVLink system id.")
    ] = None,
    timeout: Annotated[
        float,
        typer.Option("--timeout", metavar="S", min=0.1, help="How long to wait for the vehicle, and for anything new."),
    ] = 30.0,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
    as_json: Json = False,
    quiet: Annotated[bool, quiet_option("Print the paths only; with --list the numbers.")] = False,
    verbose: Verbose = False,
) -> None:
    """Fetch the log that the vehicle wrote itself: ArduPilot's .BIN, PX4's .ulg. Lost parts are asked for again.

    sparsor download --connect udpin://0.0.0.0:14550 -o flight.BIN
    """
    from sparsor.link.vehiclelogs.download import download as fetch
    from sparsor.link.vehiclelogs.download import list_logs

    if sum((log is not None, every, only_list)) > 1:
        raise InputError("--log, --all and --list exclude each other; give one of them")
    if only_list:
        vehicle, entries = list_logs(connect, system_id=system, timeout_s=timeout)
        rows = [{"log": entry.number, "bytes": entry.size, "date": entry.date} for entry in entries]
        if as_json:
            print_json({"vehicle": vehicle.words, "logs": rows})
        elif quiet:
            typer.echo("\n".join(str(entry.number) for entry in entries))
        else:
            table = [(str(entry.number), f"{entry.size} bytes  {entry.date}") for entry in entries]
            print_table(table, f"Logs on {vehicle.words}")
        return
    with progress_bar(Talk.of(quiet=quiet, verbose=verbose)) as progress:
        made = fetch(
            connect,
            Path(output),
            number=log,
            every=every,
            into_folder=output.endswith(("/", os.sep)),
            system_id=system,
            timeout_s=timeout,
            replace=force,
            warn=lambda sentence: warn([sentence]),
            progress=progress,
        )
    rows = [
        {"file": str(one.file), "bytes": one.size, "log": one.log, "seconds": round(one.seconds, 3)}
        for one in made.logs
    ]
    if as_json:
        print_json({"vehicle": made.vehicle.words, **({"logs": rows} if every else rows[0])})
        return
    for one in made.logs:
        rate = one.size / 1000 / max(one.seconds, 1e-3)
        told = f": log {one.log}, {one.size} bytes in {one.seconds:.1f} s ({rate:.0f} kB/s)"
        typer.echo(f"{one.file}{'' if quiet else told}")
