"""`upload-mission`: a plan onto the vehicle, read back and compared."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sparsor.cli.console import Json, Talk, Verbose, print_json, print_table, quiet_option, reporting_as, warn
from sparsor.cli.flightscreen import FlightScreen, fence_words
from sparsor.errors import SparsorError

if TYPE_CHECKING:
    from sparsor.link.missions.upload import UploadReport

CONNECT_HELP = "Where the vehicle is: udpin://0.0.0.0:14550, tcpout://127.0.0.1:5760, serial:///dev/ttyUSB0:57600 ..."
Sortie = Annotated[int | None, typer.Option("--sortie", metavar="N", help="Which plan of a folder with several.")]
System = Annotated[
    int | None, typer.Option("--system", metavar="ID", min=1, max=255, help="Which of several vehicles.")
]
EnableFence = Annotated[
    bool, typer.Option("--enable-fence", help="Make the vehicle keep to the plan's fence, and to nothing else.")
]
Yes = Annotated[bool, typer.Option("--yes", help="Arm and start without a question.")]
Timeout = Annotated[
    float, typer.Option("--timeout", metavar="S", min=0.1, max=3600, help="How long to wait for the vehicle.")
]


def left_with(error: BaseException) -> dict[str, object]:
    """Return what the vehicle is left with after an error, and the recording if there is one.

    An error of ours that does not say so, and a Ctrl-C that nobody made one of, came before anything was sent.
    """
    if not isinstance(error, (SparsorError, KeyboardInterrupt)):
        return {}
    recording = getattr(error, "recording", None)
    state = getattr(error, "vehicle_state", "unchanged")
    return {"vehicle_state": state, **({} if recording is None else {"tlog": recording})}


@reporting_as("interrupted: nothing was sent, the vehicle is as it was", left_with)
def upload(
    plan: Annotated[Path, typer.Argument(metavar="DIR|FILE.plan", help="A mission folder or any .plan.")],
    connect: Annotated[str, typer.Option("--connect", metavar="URL", help=CONNECT_HELP)],
    sortie: Sortie = None,
    system: System = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Do all but the sending.")] = False,
    start: Annotated[
        bool, typer.Option("--start", help="Arm and start after the upload, and after a question.")
    ] = False,
    enable_fence: EnableFence = False,
    yes: Yes = False,
    force: Annotated[
        bool, typer.Option("--force", help="Send to an armed vehicle too; start where it would be refused.")
    ] = False,
    timeout: Timeout = 10.0,
    as_json: Json = False,
    quiet: Annotated[bool, quiet_option("Print only what the vehicle holds, and warnings.")] = False,
    verbose: Verbose = False,
) -> None:
    """Send a plan to the vehicle, read it back and compare.

    upload-mission missions/doha --connect udpin://0.0.0.0:14550
    """
    from sparsor.journeys.uploading import upload_mission

    talk = Talk.of(quiet=quiet, verbose=verbose)
    with FlightScreen(talk, yes=yes or not start) as screen:
        report = upload_mission(
            plan,
            connect,
            sortie=sortie,
            system_id=system,
            dry_run=dry_run,
            force=force,
            enable_fence=enable_fence,
            start=screen.confirm if start else None,
            timeout_s=timeout,
            progress=screen.progress,
            found=screen.found,
            told=screen.told,
        )
    if not start:  # else they were said before the start
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
        **({} if report.started is None else {"started": report.started}),
    }


def _rows(report: UploadReport) -> list[tuple[str, str]]:
    verified = {True: "read back and the same", None: "nothing was sent", False: "no"}[report.verified]
    return [
        ("vehicle", f"{report.autopilot} {report.vehicle}, system {report.system_id}"),
        ("items", str(report.items)),
        ("fence", fence_words(report)),
        ("rally points", str(report.rally_points)),
        ("verified", verified),
        *(("changed", sentence) for sentence in report.changed),
        ("it holds", report.vehicle_state if report.verified else "what it held before"),
        *([] if report.started is None else [("mission", "started" if report.started else "not started")]),
    ]
