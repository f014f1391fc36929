"""What a flight looks like on a terminal: one line that changes, and a line for everything that happens."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Self

import typer

from sparsor.cli.console import Talk, progress_bar, warn
from sparsor.errors import InputError

if TYPE_CHECKING:
    from sparsor.journeys.flying import Choice
    from sparsor.link.flights.briefing import Briefing
    from sparsor.link.flights.samples import SampleCounter
    from sparsor.link.flights.views import Event, View
    from sparsor.link.missions.upload import UploadReport
    from sparsor.link.vehicles import FoundVehicle

OLD_SAMPLE_S = 3.0


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

    def confirm(self, report: UploadReport, briefing: Briefing, samples: SampleCounter) -> bool:
        """Say what has to be known, to those who asked for quiet the warnings, and ask whether to arm and start."""
        self._bars.close()
        self._say(f"the vehicle holds the plan: {report.items} items, read back and the same")
        for line in briefing_lines(report, briefing, samples):
            self._say(line)
        warn([*report.warnings, *briefing.warnings])
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


def briefing_lines(report: UploadReport, briefing: Briefing, samples: SampleCounter) -> list[str]:
    """Return what somebody should know who is asked whether to arm."""
    places = [("home", briefing.home_m), ("the first waypoint", briefing.first_m)]
    away = [f"{_length(metres)} to {what}" for what, metres in places if metres is not None]
    battery = "not known" if briefing.battery_percent is None else f"{briefing.battery_percent} %"
    heard = ", ".join(f"{count} {name}" for name, count in sorted(samples.counts.items()))
    return [
        f"from the vehicle: {', '.join(away) or 'not known, it does not say where it is'}",
        f"the flight: {briefing.length_m / 1000:.2f} km, about {briefing.seconds / 60:.0f} min, up to "
        f"{briefing.height_m:g} m above home",
        f"battery: {battery}",
        f"its fence: {fence_words(report)}",
        f"sensor: {f'heard ({heard})' if heard else 'not heard yet'}",
    ]


def _length(metres: float) -> str:
    return f"{metres:.0f} m" if metres < 1000 else f"{metres / 1000:.1f} km"


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
        old = view.sample_age_s is not None and view.sample_age_s >= OLD_SAMPLE_S
        parts.append(f"{view.sample} ({view.samples}{rate}{f', {view.sample_age_s:.0f} s ago' if old else ''})")
    if view.left_s is not None:
        parts.append(f"{view.left_s / 60:.0f} min left")
    return " | ".join(parts)


def _ask(question: Any) -> Any:  # noqa: ANN401 # whatever the question returns
    try:
        return question()
    except typer.Abort as abort:  # what typer makes of a Ctrl-C and of the end of the input
        raise KeyboardInterrupt from abort
