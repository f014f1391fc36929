"""What is switched on at a stop and off after it: servos, relays, scripts; and a camera along the way.

An autopilot runs a DO item when the item before it is done. What is to be on while the vehicle waits at a stop comes
between two items at its place: one that arrives, and one that waits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.errors import MissionError
from sparsor.mission.items import (
    DO_SEND_SCRIPT_MESSAGE,
    DO_SET_CAM_TRIGG_DIST,
    DO_SET_RELAY,
    DO_SET_SERVO,
    FRAME_MISSION,
    MissionItem,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.vehicle import Autopilot

CAMERA, SERVO, RELAY, MESSAGE = "camera-distance", "servo", "relay", "message"
# Of each kind the names, lowest and highest of its numbers; only a camera's distance may have a fraction.
FORMS = {
    SERVO: (("CHANNEL", 1, 32), ("PWM_ON", 500, 2500), ("PWM_OFF", 500, 2500)),
    RELAY: (("NUMBER", 0, 15),),
    CAMERA: (("METRES", 0.1, 10_000),),
    MESSAGE: (("ID", 0, 65_535),),
}
ALLOWED = ", ".join(":".join((kind, *(name for name, _, _ in form))) for kind, form in FORMS.items())


@dataclass(frozen=True)
class Trigger:
    """One thing that a mission switches.

    Parameters
    ----------
    kind : {"servo", "relay", "camera-distance", "message"}
    numbers : tuple of float
        As `FORMS` names them.
    """

    kind: str
    numbers: tuple[float, ...]

    def item(self, *, on: bool, stop: int) -> MissionItem:
        """Return the item that switches it; a script's message says which stop, counted from 1."""
        first, *others = self.numbers
        if self.kind == SERVO:
            return _do(DO_SET_SERVO, first, others[0] if on else others[1])
        if self.kind == RELAY:
            return _do(DO_SET_RELAY, first, float(on))
        if self.kind == MESSAGE:
            return _do(DO_SEND_SCRIPT_MESSAGE, first, float(on), float(stop))
        # Parameter 3: a picture at once.
        return _do(DO_SET_CAM_TRIGG_DIST, first if on else 0.0, 0.0, float(on))


def parse_trigger(text: str) -> Trigger:
    """Return what is written ``servo:9:1900:1100``, ``relay:0``, ``camera-distance:25`` or ``message:7``.

    Raises
    ------
    MissionError
        Names what is wrong and what is allowed.

    Examples
    --------
    >>> parse_trigger("servo:9:1900:1100")
    Trigger(kind='servo', numbers=(9.0, 1900.0, 1100.0))
    """
    kind, *given = text.strip().split(":")
    form = FORMS.get(kind)
    if form is None or len(given) != len(form):
        raise MissionError(f"a trigger '{text}'; allowed are {ALLOWED}")
    numbers = []
    for (name, low, high), word in zip(form, given, strict=True):
        try:
            number = float(word)
        except ValueError:
            number = float("nan")
        if not low <= number <= high or (kind != CAMERA and number % 1):
            raise MissionError(f"a trigger '{text}': its {name} is '{word}'; allowed are {low:g}..{high:g}")
        numbers.append(number)
    return Trigger(kind, tuple(numbers))


def check_triggers(triggers: Sequence[Trigger], autopilot: Autopilot) -> None:
    """Refuse what an autopilot does not take in a mission.

    Raises
    ------
    MissionError
    """
    refused = [one.kind for one in triggers if one.kind != CAMERA]
    if autopilot.name == "px4" and refused:
        raise MissionError(
            f"PX4 refuses a mission with a {refused[0]} trigger (DO_SET_SERVO, DO_SET_RELAY and DO_SEND_SCRIPT_MESSAGE "
            f"are ArduPilot's); it takes {CAMERA}: leave the trigger out, or fly with ArduPilot"
        )


def _do(command: int, first: float, second: float, third: float = 0.0) -> MissionItem:
    return MissionItem(command, FRAME_MISSION, (first, second, third, 0.0, 0.0, 0.0, 0.0))
