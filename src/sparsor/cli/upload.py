"""`upload-mission`: a plan onto the vehicle, read back and compared."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sparsor.cli.console import (
    Json,
    Quiet,
    Talk,
    Verbose,
    print_json,
    print_table,
    progress_bar,
    reporting,
    warn,
)

if TYPE_CHECKING:
    from sparsor.link.upload import UploadReport

CONNECT_HELP = "Where the vehicle is: udpin://0.0.0.0:14550, tcpout://127.0.0.1:5760, serial:///dev/ttyUSB0:57600 ..."


@reporting
def upload(
    plan: Annotated[Path, typer.Argument(metavar="DIR|FILE.plan", help="A mission folder or any .plan.")],
    connect: Annotated[str, typer.Option("--connect", metavar="URL", help=CONNECT_HELP)],
    sortie: Annotated[int | None, typer.Option(metavar="N", help="Which plan of a folder with several.")] = None,
    system: Annotated[int | None, typer.Option(metavar="ID", min=1, max=255, help="Which of several vehicles.")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Do all but the sending.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Send to an armed vehicle too.")] = False,
    timeout: Annotated[
        float, typer.Option("--timeout", metavar="S", min=0.1, max=3600, help="How long to wait for the vehicle.")
    ] = 10.0,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Send a plan to the vehicle, read it back and compare.

    upload-mission missions/doha --connect udpin://0.0.0.0:14550
    """
    from sparsor.journeys.uploading import upload_mission

    talk = Talk.of(quiet=quiet, verbose=verbose)
    with progress_bar(talk) as progress:
        report = upload_mission(
            plan,
            connect,
            sortie=sortie,
            system_id=system,
            dry_run=dry_run,
            force=force,
            timeout_s=timeout,
            progress=progress,
            found=lambda vehicle: None if talk is Talk.QUIET else typer.echo(f"found {vehicle.words}", err=True),
        )
    warn(report.warnings)
    if as_json:
        print_json(_contents(report))
    elif quiet:
        typer.echo(report.vehicle_state)
    else:
        print_table(_rows(report), title="Nothing was sent" if dry_run else "Uploaded")


def _contents(report: UploadReport) -> dict[str, object]:
    return {
        "autopilot": report.autopilot,
        "vehicle": report.vehicle,
        "system_id": report.system_id,
        "items": report.items,
        "fence_points": report.fence_points,
        "rally_points": report.rally_points,
        "verified": report.verified,
        "fence_enforced": report.fence_enforced,
        "changed": list(report.changed),
        "vehicle_state": report.vehicle_state,
        "warnings": list(report.warnings),
    }


def _rows(report: UploadReport) -> list[tuple[str, str]]:
    verified = {True: "read back and the same", None: "nothing was sent", False: "no"}[report.verified]
    enforced = {
        True: "enforced",
        False: "NOT enforced: the autopilot ignores it until it is told otherwise",
        None: "the autopilot does not say whether it is enforced",
    }[report.fence_enforced]
    return [
        ("vehicle", f"{report.autopilot} {report.vehicle}, system {report.system_id}"),
        ("items", str(report.items)),
        ("fence", f"{report.fence_points} points, {enforced}"),
        ("rally points", str(report.rally_points)),
        ("verified", verified),
        *(("changed", sentence) for sentence in report.changed),
        ("it holds", report.vehicle_state if report.verified else "what it held before"),
    ]
