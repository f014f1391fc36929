"""What a flight looks like on a terminal: one line that changes, and a line for everything that happens."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Self

import typer

from sparsor.cli.console import Talk, progress_bar
from sparsor.errors import InputError

if TYPE_CHECKING:
    from sparsor.journeys.flying import Choice
    from sparsor.link.flights.views import Event, View
    from sparsor.link.missions.upload import UploadReport
    from sparsor.link.vehicles import FoundVehicle


class FlightScreen:
    """Shows a flight on stderr and asks on the terminal (`journeys.flying.Watcher`).

    Parameters
    ----------
    talk : Talk
    yes : bool
        Arm and start without a question.

    Raises
    ------
    InputError
        When there is a question and no terminal to ask on.
    """

    def __init__(self, talk: Talk, *, yes: bool) -> None:
        if not yes and not sys.stdin.isatty():
            raise InputError(
                "whether to arm and start is asked on a terminal, and there is none: give --yes to start unasked"
            )
        self._talk, self._yes = talk, yes
        self._terminal = talk is not Talk.QUIET and sys.stderr.isatty()
        self._bars = ExitStack()
        self._status: Any = None  # rich is imported when there is something to show

    def __enter__(self) -> Self:
        self.progress = self._bars.enter_context(progress_bar(self._talk))
        return self

    def __exit__(self, *_: object) -> None:
        self._bars.close()
        self._hide()

    def found(self, vehicle: FoundVehicle) -> None:
        """Say which vehicle was found."""
        self._say(f"found {vehicle.words}")

    def confirm(self, report: UploadReport | None = None) -> bool:
        """Ask whether to arm and start."""
        self._bars.close()
        if report is not None:
            for warning in report.warnings:
                self._say(f"warning: {warning}")
            self._say(f"the vehicle holds the plan: {report.items} items, read back and the same")
            self._say(f"its fence: {fence_words(report)}")
        return self._yes or bool(_ask(lambda: typer.confirm("arm and start?", err=True)))

    def told(self, event: Event) -> None:
        """Say what happens."""
        if event.detail and self._talk is not Talk.VERBOSE:
            return
        self._say(f"warning: {event.text}" if event.warning else event.text)

    def seen(self, view: View) -> None:
        """Show the flight as it is."""
        if not self._terminal:
            return
        if self._status is None:
            from rich.console import Console

            self._status = Console(stderr=True, highlight=False).status("")
            self._status.start()
        self._status.update(flight_line(view))

    def interrupted(self) -> Choice:
        """Ask what to do after a Ctrl-C; without a terminal, stop watching."""
        from sparsor.journeys.flying import Choice

        self._hide()
        if not sys.stdin.isatty():
            return Choice.LEAVE
        question = "return home (r), keep flying and stop watching (k), go on watching (c)?"
        known = {choice.value: choice for choice in Choice}
        try:
            while (answer := _ask(lambda: typer.prompt(question, err=True))) not in known:
                pass
        except KeyboardInterrupt:
            return Choice.LEAVE
        return known[answer]

    def _say(self, line: str) -> None:
        if self._talk is Talk.QUIET:
            return
        if self._status is not None:
            self._status.console.print(line, markup=False)
        else:
            typer.echo(line, err=True)

    def _hide(self) -> None:
        if self._status is not None:
            self._status.stop()
            self._status = None


def fence_words(report: UploadReport) -> str:
    """Return how large the fence of an uploaded plan is, and whether the vehicle keeps to it."""
    enforced = {
        True: "enforced",
        False: "NOT enforced: the autopilot ignores it until it is told otherwise (--enable-fence)",
        None: "the autopilot does not say whether it is enforced",
    }[report.fence_enforced]
    return f"{report.fence_points} points, {enforced}"


def flight_line(view: View) -> str:
    """Return a flight in one line; what is not known is left out."""
    parts = [f"item {view.item} of {view.items}", f"{view.flown_m / 1000:.2f} km flown"]
    if view.left_m is not None:
        parts[-1] += f", {view.left_m / 1000:.2f} km left"
    if view.height_m is not None and view.ground_speed_m_s is not None:
        parts += [f"{view.height_m:.0f} m up", f"{view.ground_speed_m_s:.1f} m/s"]
    if view.battery_percent is not None:
        parts.append(f"battery {view.battery_percent} %")
    if view.sample is None:
        parts.append("no samples")
    else:
        rate = "" if view.sample_rate_hz is None else f", {view.sample_rate_hz:.1f}/s"
        age = "" if view.sample_age_s is None else f", {view.sample_age_s:.0f} s ago"
        parts.append(f"{view.sample} ({view.samples} samples{rate}{age})")
    if view.left_s is not None:
        parts.append(f"{view.left_s / 60:.0f} min left")
    return " | ".join(parts)


def _ask(question: Any) -> Any:  # noqa: ANN401 # whatever the question returns
    try:
        return question()
    except typer.Abort as abort:  # what typer makes of a Ctrl-C and of the end of the input
        raise KeyboardInterrupt from abort
