"""What the commands share: errors to exit codes, progress, tables, JSON."""

from __future__ import annotations

import functools
import json
import sys
import traceback
from contextlib import contextmanager, suppress
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


def quiet_option(prints: str) -> Any:  # noqa: ANN401 # what typer.Option returns
    """Return the option -q of a command, which says what is still printed."""
    return typer.Option("--quiet", "-q", help=prints, rich_help_panel=TELLING)


Quiet = Annotated[bool, quiet_option("Print the result's path only.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Show tracebacks and details.", rich_help_panel=TELLING)]


SCHEDULER = (
    "Share the work among processes: 'local' starts some on this machine, the address of a dask scheduler, e.g. "
    "tcp://192.168.1.5:8786, takes its workers (default: threads). The result is the same."
)


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
    """Turn what a command raises into a sentence on stderr and an exit code; no traceback without -v.

    With --json one object with the key "error" is printed where the result would have been.
    """
    return reporting_as("interrupted: what was there before is still there")(command)


def reporting_as(
    interrupted: str, also: Callable[[BaseException], Mapping[str, object]] = lambda _: {}
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Do as `reporting` for a command with its own sentence for a Ctrl-C, and perhaps more to say of an error.

    Parameters
    ----------
    interrupted : str
    also : callable
        Given what was raised, returns what stands beside "error" in the JSON object.
    """

    def guard(command: Callable[P, R]) -> Callable[P, R]:
        return _guarded(command, interrupted, also)

    return guard


def _guarded(
    command: Callable[P, R], interrupted: str, also: Callable[[BaseException], Mapping[str, object]]
) -> Callable[P, R]:
    def tell(error: BaseException, words: str, *, as_json: bool) -> None:
        if as_json:
            with suppress(OSError):  # what reads the output may be gone: the error may say just that
                print_json({"error": words, **also(error)})

    @functools.wraps(command)
    def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return command(*args, **kwargs)
        except KeyboardInterrupt as error:
            tell(error, str(error) or "interrupted", as_json=bool(kwargs.get("as_json")))
            typer.echo(interrupted, err=True)
            raise typer.Exit(INTERRUPTED) from None
        except (SparsorError, OSError, MemoryError) as error:
            if kwargs.get("verbose"):
                typer.echo(traceback.format_exc(), err=True)
            words = str(error) or type(error).__name__
            tell(error, words, as_json=bool(kwargs.get("as_json")))
            typer.echo(f"error: {words}", err=True)
            raise typer.Exit(getattr(error, "exit_code", 1)) from None

    return guarded


@contextmanager
def ended_by_signals(stop: Callable[[], None]) -> Iterator[None]:
    """Let the first Ctrl-C or request to terminate call `stop`; those that follow change nothing.

    Also where a shell started the program in the background, with Ctrl-C ignored.
    """
    import signal

    asked = False

    def end(*_: object) -> None:
        nonlocal asked
        if not asked:
            asked = True
            stop()

    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def interrupt() -> None:
    """Do as a Ctrl-C does."""
    raise KeyboardInterrupt


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


def print_columns(names: Sequence[str], rows: Sequence[Sequence[str]], title: str) -> None:
    """Print a table of several columns with their names."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE, pad_edge=False)
    for name in names:
        table.add_column(name, justify="right")
    for row in rows:
        table.add_row(*row)
    Console(highlight=False, soft_wrap=False).print(table)


def warn(warnings: Sequence[str]) -> None:
    """Print warnings on stderr."""
    for warning in warnings:
        typer.echo(f"warning: {warning}", err=True)
