"""What the vehicle holds against what was sent to it: what it changed, and whether that matters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sparsor.link.missions.wire import FENCE, KINDS, MISSION, RALLY
from sparsor.mission.describe import command_name
from sparsor.mission.items import (
    DO_CHANGE_SPEED,
    DO_SEND_SCRIPT_MESSAGE,
    DO_SET_CAM_TRIGG_DIST,
    DO_SET_RELAY,
    DO_SET_SERVO,
    FRAME_GLOBAL,
    FRAME_MISSION,
    NAV_DELAY,
    NAV_LAND,
    NAV_LOITER_TIME,
    WAYPOINTS,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from sparsor.link.missions.wire import WireItem

WHOLE_FRAMES: Final = {5: 0, 6: 3, 11: 10}  # MAV_FRAME_*_INT mean what the frames without INT mean
POSITION_E7: Final = 1
ALTITUDE_M: Final = {MISSION: 0.011, FENCE: math.inf, RALLY: 1.0}  # ArduPilot keeps centimetres, rally points metres
# ArduPilot reads back the direction in which a plane turns to land, whatever was sent.
MEANINGLESS: Final = {NAV_LAND: {3}}
# Parameters that make the flight another one when they change, by command.
ESSENTIAL: Final = {command: {0} for command in (*WAYPOINTS, NAV_LOITER_TIME, NAV_DELAY)} | {
    DO_CHANGE_SPEED: {0, 1},
    DO_SET_SERVO: {0, 1},
    DO_SET_RELAY: {0, 1},
    DO_SET_CAM_TRIGG_DIST: {0},
    DO_SEND_SCRIPT_MESSAGE: {0, 1, 2, 3},
}


@dataclass(frozen=True)
class Difference:
    """One thing that was read back otherwise than it was sent.

    Parameters
    ----------
    sentence : str
    harmless : bool
        Whether the flight stays the same.
    """

    sentence: str
    harmless: bool


def differences(
    kind: int, sent: Sequence[WireItem], held: Sequence[WireItem], *, home_is_item_0: bool
) -> tuple[Difference, ...]:
    """Compare what was sent with what was read back, item by item.

    Parameters
    ----------
    kind : int
        MAV_MISSION_TYPE.
    sent, held : sequence of WireItem
    home_is_item_0 : bool
        Whether the autopilot writes where it is into item 0 of a mission.
    """
    if len(sent) != len(held):
        return (Difference(f"The vehicle holds {len(held)} {KINDS[kind]} items, {len(sent)} were sent.", False),)
    found: list[Difference] = []
    for number, (ours, theirs) in enumerate(zip(sent, held, strict=True)):
        if kind == MISSION and number == 0 and home_is_item_0:
            found += _home(ours, theirs)
        else:
            found += _item(kind, f"{KINDS[kind].capitalize()} item {number}", ours, theirs)
    return tuple(found)


def _home(ours: WireItem, theirs: WireItem) -> Iterator[Difference]:
    if (ours.x, ours.y, ours.z) != (theirs.x, theirs.y, theirs.z):
        yield Difference(
            f"Home (item 0) is where the vehicle is: {theirs.y / 1e7:.7f} E {theirs.x / 1e7:.7f} N, {theirs.z:g} m.",
            True,
        )


def _item(kind: int, name: str, ours: WireItem, theirs: WireItem) -> Iterator[Difference]:
    if ours.command != theirs.command:
        yield Difference(f"{name} is {command_name(theirs.command)} instead of {command_name(ours.command)}.", False)
        return
    name = f"{name} ({command_name(ours.command)})"
    placed = kind != MISSION or ours.flown_to
    shift = max(abs(ours.x - theirs.x), abs(ours.y - theirs.y))
    if shift > (POSITION_E7 if placed else 0):
        yield Difference(f"{name} lies at {_place(theirs)} instead of {_place(ours)}.", False)
    if abs(ours.z - theirs.z) > ALTITUDE_M[kind]:
        yield Difference(f"{name} has the altitude {theirs.z:g} m instead of {ours.z:g} m.", False)
    # A fence has no altitude, so its frame means nothing.
    if kind != FENCE and WHOLE_FRAMES.get(ours.frame, ours.frame) != WHOLE_FRAMES.get(theirs.frame, theirs.frame):
        harmless = not placed and {ours.frame, theirs.frame} == {FRAME_MISSION, FRAME_GLOBAL}
        yield Difference(f"{name} is in frame {theirs.frame} instead of {ours.frame}.", harmless)
    yield from _parameters(kind, name, ours, theirs)


def _parameters(kind: int, name: str, ours: WireItem, theirs: WireItem) -> Iterator[Difference]:
    essential = {0} if kind == FENCE else ESSENTIAL.get(ours.command, set()) if kind == MISSION else set()
    for place, (given, kept) in enumerate(zip(ours.params, theirs.params, strict=True)):
        if math.isclose(given, kept, rel_tol=1e-6, abs_tol=1e-6) or (math.isnan(given) and math.isnan(kept)):
            continue
        # The autopilot has no use for it.
        dropped = abs(kept) < 1e-6 or (kind == MISSION and place in MEANINGLESS.get(ours.command, ()))
        fraction = ours.command in WAYPOINTS and place == 0 and abs(given - kept) < 1
        sentence = f"{name} has {kept:g} instead of {given:g} in parameter {place + 1}."
        yield Difference(sentence, fraction or (place not in essential and (dropped or math.isnan(given))))


def _place(item: WireItem) -> str:
    return f"{item.y / 1e7:.7f} E {item.x / 1e7:.7f} N"


def summary(found: Sequence[Difference]) -> list[str]:
    """Return the sentences of harmless differences; one and a count where many items have the same.

    Examples
    --------
    >>> summary([Difference(f"Mission item {n} (RTL) is in frame 0.", True) for n in (4, 7)])
    ['Mission item 4 (RTL) is in frame 0. (and 1 more like it)']
    """
    groups: dict[str, list[str]] = {}
    for one in found:
        key = one.sentence.partition("(")[2] or one.sentence
        groups.setdefault(key, []).append(one.sentence)
    return [
        sentences[0] + (f" (and {len(sentences) - 1} more like it)" if len(sentences) > 1 else "")
        for sentences in groups.values()
    ]
