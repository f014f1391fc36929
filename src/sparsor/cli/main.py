"""The commands under their names."""

from __future__ import annotations

from typing import Annotated

import typer

from sparsor import __version__
from sparsor.cli.inspect import inspect
from sparsor.cli.learn import learn
from sparsor.cli.plan import plan

app = typer.Typer(
    name="sparsor",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("plan")(plan)
app.command("learn")(learn)
app.command("inspect")(inspect)

_generate_mission = typer.Typer(
    name="generate-mission",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
_generate_mission.command()(plan)


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
    _generate_mission()
