"""`sparsor send`: a companion computer's sensor to NAMED_VALUE_FLOAT."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sparsor.cli.console import (
    Json,
    Talk,
    Verbose,
    ended_by_signals,
    interrupt,
    print_json,
    quiet_option,
    reporting_as,
)
from sparsor.cli.upload import CONNECT_HELP
from sparsor.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from sparsor.link.sensing import LineFormat, Outlet, Sent, Source

SOURCE = "Where the lines come from: one of these, or - for standard input"
FORMAT = "What a line says"
LINK = "How it is sent"


@reporting_as("interrupted")
def send(
    connect: Annotated[str, typer.Option("--connect", metavar="URL", help=CONNECT_HELP)],
    stdin: Annotated[str | None, typer.Argument(metavar="[-]", help="Read standard input.")] = None,
    serial: Annotated[
        str | None,
        typer.Option(
            metavar="DEVICE[:BAUD]", help="A sensor's port: /dev/ttyUSB1, COM4:115200.", rich_help_panel=SOURCE
        ),
    ] = None,
    csv: Annotated[
        Path | None,
        typer.Option(
            "--csv",
            metavar="FILE",
            help="A recorded file, with the spacing it was recorded with.",
            rich_help_panel=SOURCE,
        ),
    ] = None,
    value: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=]COLUMN",
            help="A column by its number from 1, or its name in the first line. For each value. Default: 1, where the "
            "first line does not name several.",
            rich_help_panel=FORMAT,
        ),
    ] = None,
    time: Annotated[
        str | None,
        typer.Option(metavar="COLUMN", help="The sensor's own time: a number, or ISO 8601.", rich_help_panel=FORMAT),
    ] = None,
    delimiter: Annotated[
        str | None,
        typer.Option(metavar="CHARACTER", help="Or comma (default), semicolon, tab, space.", rich_help_panel=FORMAT),
    ] = None,
    pattern: Annotated[
        str | None,
        typer.Option(metavar="REGEX", help="Instead of columns: 'NO2=(?P<value>[-0-9.]+)'.", rich_help_panel=FORMAT),
    ] = None,
    time_unit: Annotated[
        str, typer.Option("--time-unit", metavar="s|ms|us", help="Of a time that is a number.", rich_help_panel=FORMAT)
    ] = "s",
    name: Annotated[
        str, typer.Option(metavar="NAME", help="Of a value that has no other; 10 characters.", rich_help_panel=FORMAT)
    ] = "NO2",
    rate: Annotated[
        float | None,
        typer.Option(
            metavar="HZ",
            min=0.001,
            max=1000,
            help="At most so many of each name a second; for a file without times, its lines a second.",
            rich_help_panel=LINK,
        ),
    ] = None,
    replay_speed: Annotated[
        float, typer.Option("--replay-speed", metavar="X", help="Recorded seconds a second.", rich_help_panel=LINK)
    ] = 1.0,
    system: Annotated[
        int | None,
        typer.Option(metavar="ID", min=1, max=255, help="The vehicle's; default: the one heard.", rich_help_panel=LINK),
    ] = None,
    component: Annotated[
        int,
        typer.Option(metavar="ID", min=1, max=255, help="Ours: an onboard computer's.", rich_help_panel=LINK),
    ] = 191,
    timeout: Annotated[
        float,
        typer.Option(metavar="S", min=0.1, help="How long a file waits for the vehicle.", rich_help_panel=LINK),
    ] = 10.0,
    as_json: Json = False,
    quiet: Annotated[bool, quiet_option("Print only how many values were sent.")] = False,
    verbose: Verbose = False,
) -> None:
    """Send a sensor's values into the telemetry as NAMED_VALUE_FLOAT, until its lines end or Ctrl-C.

    sparsor send --connect /dev/ttyAMA0:921600 --serial /dev/ttyUSB0 --pattern 'NO2=(?P<value>[-0-9.]+)'

    sparsor send --connect udpout://127.0.0.1:14550 --csv day.csv --value NO2=no2_ppb --value T=temp_c --time time_s

    my-sensor | sparsor send --connect udpout://127.0.0.1:14551 - --delimiter space --value NO2=2

    A link or a sensor that is gone is tried again until Ctrl-C; what comes meanwhile is lost, and counted.
    """
    from sparsor.link.sensing import Outlet, send_samples

    talk = Talk.of(quiet=quiet, verbose=verbose)

    def say(sentence: str) -> None:
        typer.echo(sentence, err=True)

    if (stdin is not None) + (serial is not None) + (csv is not None) != 1:
        raise InputError("say where the values come from: --serial DEVICE, --csv FILE, or - for standard input")
    columns = ["1"] if serial is not None and not value else value  # a sensor's first line may be a greeting
    form = _form(pattern, columns, time, delimiter, name, time_unit)
    source = _source(stdin, serial, csv, form, replay_speed, rate, say)
    spacing_is_rate = csv is not None and not form.has_time
    opened = Outlet(connect, system_id=system, component_id=component, say=say)
    with ended_by_signals(interrupt), opened as outlet:
        sent = send_samples(source, outlet, rate_hz=None if spacing_is_rate else rate, timeout_s=timeout, say=say)
    _report(sent, outlet, talk, as_json=as_json)


def _form(
    pattern: str | None,
    values: list[str] | None,
    time: str | None,
    delimiter: str | None,
    name: str,
    time_unit: str,
) -> LineFormat:
    from sparsor.link.sensing import Columns, Pattern

    if pattern is None:
        return Columns(values, name=name, time=time, delimiter=delimiter or "comma", time_unit=time_unit)
    if values or time or delimiter:
        raise InputError("--pattern finds the values by itself; leave out --value, --time and --delimiter")
    return Pattern(pattern, name=name, time_unit=time_unit)


def _source(
    stdin: str | None,
    serial: str | None,
    csv: Path | None,
    form: LineFormat,
    replay_speed: float,
    rate: float | None,
    say: Callable[[str], None],
) -> Source:
    from sparsor.link.sensing import PipedLines, ReplayedFile, SensorPort

    if csv is not None:
        return ReplayedFile(csv, form, speed=replay_speed, rate_hz=rate)
    if replay_speed != 1:
        raise InputError("--replay-speed is for --csv; a sensor has its own")
    if serial is not None:
        return SensorPort(serial, form, say)
    if stdin != "-":
        raise InputError(f"'{stdin}' is not understood; - is standard input, a file goes with --csv")
    return PipedLines(sys.stdin, form)


def _report(sent: Sent, outlet: Outlet, talk: Talk, *, as_json: bool) -> None:
    if as_json:
        print_json(
            {
                "sent": sent.sent,
                "skipped": sent.skipped,
                "first_skipped": sent.first_skipped,
                "lost": sent.lost,
                "left_out": sent.left_out,
                "names": sent.names,
                "seconds": round(sent.seconds, 3),
                "system_id": outlet.system_id,
                "component_id": outlet.component_id,
            }
        )
        return
    if talk is Talk.QUIET:
        typer.echo(str(sent.sent))
        return
    named = ", ".join(f"{count} {name}" for name, count in sent.names.items())
    typer.echo(f"sent {sent.sent} values in {sent.seconds:.0f} s{f' ({named})' if named else ''}")
    if sent.skipped:
        typer.echo(f"skipped {sent.skipped} that could not be read, the first: {sent.first_skipped}")
    if sent.lost:
        typer.echo(f"lost {sent.lost} that came while the link was down")
    if sent.left_out:
        typer.echo(f"left out {sent.left_out} beyond the rate")
