"""`sparsor fly`: upload, arm, start, watch and record until the vehicle has landed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sparsor.cli.console import Json, Talk, Verbose, print_json, print_table, quiet_option, reporting_as
from sparsor.cli.flightscreen import FlightScreen, fence_words
from sparsor.cli.upload import CONNECT_HELP, EnableFence, Sortie, System, Timeout, Yes, left_with

if TYPE_CHECKING:
    from sparsor.journeys.flying import FlightReport


@reporting_as("interrupted: nothing was sent, the vehicle is as it was", left_with)
def fly(
    plan: Annotated[Path, typer.Argument(metavar="DIR|FILE.plan", help="A mission folder or any .plan.")],
    connect: Annotated[str, typer.Option("--connect", metavar="URL", help=CONNECT_HELP)],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE.tlog", help="The recording; beside the plan, by its name and the time."
        ),
    ] = None,
    sortie: Sortie = None,
    system: System = None,
    enable_fence: EnableFence = False,
    yes: Yes = False,
    force: Annotated[
        bool,
        typer.Option(
            "--force",
            help="Fly an armed vehicle too, one far away or with an empty battery; replace a recording that is there.",
        ),
    ] = False,
    timeout: Timeout = 10.0,
    ready_timeout: Annotated[
        float,
        typer.Option("--ready-timeout", metavar="S", min=1, help="How long to wait until it is ready to fly."),
    ] = 120.0,
    lost_timeout: Annotated[
        float,
        typer.Option("--lost-timeout", metavar="S", min=1, help="How long to wait for a vehicle that fell silent."),
    ] = 60.0,
    as_json: Json = False,
    quiet: Annotated[bool, quiet_option("Print only the recording's path.")] = False,
    verbose: Verbose = False,
) -> None:
    """Upload a plan, arm, start, watch and record everything until the vehicle has landed.

    sparsor fly missions/doha --connect udpin://0.0.0.0:14550
    """
    from sparsor.journeys.flying import FlightOptions, fly_mission

    talk = Talk.of(quiet=quiet, verbose=verbose)
    options = FlightOptions(sortie, system, enable_fence, force, timeout, ready_timeout, lost_timeout)
    with FlightScreen(talk, yes=yes) as screen:
        report = fly_mission(plan, connect, output, options, screen)
    if as_json:
        print_json(_contents(report))
    elif quiet:
        typer.echo(str(report.tlog))
    else:
        print_table(_rows(report), title="Flown")
        typer.echo("\n".join(_next_steps(connect, report)))
    if report.result.outcome != "complete":
        typer.echo(f"error: {report.result.outcome}: {_missed(report) or 'every waypoint was reached'}", err=True)
        raise typer.Exit(1)


def _next_steps(url: str, report: FlightReport) -> list[str]:
    """Return what is usually typed next."""
    folder = report.plan.parent
    of_ours = any(folder.glob("*.npz"))
    mission = f"--mission {folder}" if of_ours else f"--plan {report.plan} --bbox W S E N"
    return [
        f"the map: reconstruct-map {report.tlog} {mission}",
        f"the vehicle's own log: sparsor download --connect {url} -o {folder}/",
    ]


def _contents(report: FlightReport) -> dict[str, object]:
    upload, result = report.upload, report.result
    return {
        "tlog": str(report.tlog),
        "samples": sum(report.samples.values()),
        "sensors": report.samples,
        "reached": len(result.reached),
        "missed": list(result.missed),
        "complete": result.outcome == "complete",
        "outcome": result.outcome,
        "seconds": result.seconds,
        "distance_m": result.distance_m,
        "messages": report.messages,
        "autopilot": upload.autopilot,
        "vehicle": upload.vehicle,
        "system_id": upload.system_id,
        "items": upload.items,
        "fence_enforced": upload.fence_enforced,
        "warnings": [*upload.warnings, *result.warnings],
    }


def _rows(report: FlightReport) -> list[tuple[str, str]]:
    result = report.result
    sensors = ", ".join(f"{count} {name}" for name, count in sorted(report.samples.items())) or "none"
    return [
        ("outcome", result.outcome),
        ("waypoints", f"{len(result.reached)} reached{', ' * bool(result.missed)}{_missed(report)}"),
        ("flight", f"{result.distance_m / 1000:.2f} km in {result.seconds / 60:.1f} min"),
        ("fence", fence_words(report.upload)),
        ("samples", sensors),
        ("recording", f"{report.tlog}, {report.messages} messages"),
    ]


def _missed(report: FlightReport) -> str:
    missed = report.result.missed
    if not missed:
        return ""
    listed = ", ".join(map(str, missed[:10])) + (" ..." if len(missed) > 10 else "")
    return f"{len(missed)} waypoints not reached (items {listed})"
