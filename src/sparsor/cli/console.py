"""What the commands share: errors to exit codes, progress, tables, JSON."""

from __future__ import annotations

import functools
import json
import sys
import traceback
from contextlib import contextmanager
from enum import IntEnum
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec, TypeVar

import typer

from sparsor.core.progress import Progress, silent
from sparsor.errors import SparsorError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

P = ParamSpec("P")
R = TypeVar("R")

INTERRUPTED = 130

TELLING = "What it tells"
Json = Annotated[
    bool,
    typer.Option("--json", help="Print one JSON object, SI units in the key names.", rich_help_panel=TELLING),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print the result's path only.", rich_help_panel=TELLING)]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Show tracebacks and details.", rich_help_panel=TELLING)]


class Talk(IntEnum):
    """How much a command says."""

    QUIET = 0
    NORMAL = 1
    VERBOSE = 2

    @classmethod
    def of(cls, *, quiet: bool, verbose: bool) -> Talk:
        """Return what the two flags ask for; -v wins."""
        if verbose:
            return cls.VERBOSE
        return cls.QUIET if quiet else cls.NORMAL


def reporting(command: Callable[P, R]) -> Callable[P, R]:
    """Turn what a command raises into a sentence on stderr and an exit code; no traceback without -v."""

    @functools.wraps(command)
    def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return command(*args, **kwargs)
        except KeyboardInterrupt:
            typer.echo("interrupted: what was there before is still there", err=True)
            raise typer.Exit(INTERRUPTED) from None
        except (SparsorError, OSError, MemoryError) as error:
            if kwargs.get("verbose"):
                typer.echo(traceback.format_exc(), err=True)
            typer.echo(f"error: {str(error) or type(error).__name__}", err=True)
            raise typer.Exit(getattr(error, "exit_code", 1)) from None

    return guarded


@contextmanager
def progress_bar(talk: Talk) -> Iterator[Progress]:
    """Yield what a journey reports to: a bar on a terminal, nothing elsewhere."""
    if talk is Talk.QUIET or not sys.stderr.isatty():
        yield silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as RichProgress

    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    with RichProgress(*columns, console=Console(stderr=True), transient=True) as bars:
        known: dict[str, Any] = {}

        def report(task: str, done: int, total: int) -> None:
            if task not in known:
                known[task] = bars.add_task(task, total=total)
            bars.update(known[task], completed=done, total=total)

        yield report


def print_json(result: Mapping[str, object]) -> None:
    """Print one JSON object."""
    typer.echo(json.dumps(result, indent=2, allow_nan=False))


def print_table(rows: Sequence[tuple[str, str]], title: str) -> None:
    """Print names and values in two columns."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, title_justify="left", show_header=False, box=box.SIMPLE, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in rows:
        table.add_row(name, value)
    Console(highlight=False, soft_wrap=False).print(table)


def warn(warnings: Sequence[str]) -> None:
    """Print warnings on stderr."""
    for warning in warnings:
        typer.echo(f"warning: {warning}", err=True)
