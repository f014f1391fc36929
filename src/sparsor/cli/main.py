"""The commands under their names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from sparsor import __version__
from sparsor.cli.check import check
from sparsor.cli.download import download
from sparsor.cli.fetch import fetch
from sparsor.cli.fly import fly
from sparsor.cli.inspect import inspect
from sparsor.cli.learn import learn
from sparsor.cli.places import WithPlaces
from sparsor.cli.plan import plan
from sparsor.cli.reconstruct import reconstruct
from sparsor.cli.record import record
from sparsor.cli.send import send
from sparsor.cli.simulate import simulate
from sparsor.cli.study import study
from sparsor.cli.upload import upload

if TYPE_CHECKING:
    from collections.abc import Callable


def _program(name: str, *, no_args_is_help: bool = False) -> typer.Typer:
    return typer.Typer(
        name=name,
        no_args_is_help=no_args_is_help,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode="rich",
        context_settings={"help_option_names": ["-h", "--help"]},
    )


app = _program("sparsor", no_args_is_help=True)
app.command("plan", cls=WithPlaces)(plan)
app.command("reconstruct")(reconstruct)
app.command("learn")(learn)
app.command("inspect")(inspect)
app.command("check")(check)
app.command("upload")(upload)
app.command("fly")(fly)
app.command("record")(record)
app.command("download")(download)
app.command("send")(send)
app.command("simulate")(simulate)
app.command("study")(study)
app.command("fetch")(fetch)


def _alone(name: str, command: Callable[..., None]) -> typer.Typer:
    """Return a program of one command, for those that people type most under their own names."""
    program = _program(name)
    program.command(cls=WithPlaces)(command)
    return program


def _print_version(asked: bool) -> None:
    if asked:
        typer.echo(f"sparsor {__version__}")
        raise typer.Exit


@app.callback()
def sparsor(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Draw a box on the map, get the shortest flight whose samples rebuild the whole pollution map."""
    del version


def main() -> None:
    """Run `sparsor`."""
    app()


def generate_mission() -> None:
    """Run `generate-mission`, which is `sparsor plan`."""
    _alone("generate-mission", plan)()


def upload_mission() -> None:
    """Run `upload-mission`, which is `sparsor upload`."""
    _alone("upload-mission", upload)()


def reconstruct_map() -> None:
    """Run `reconstruct-map`, which is `sparsor reconstruct`."""
    _alone("reconstruct-map", reconstruct)()
