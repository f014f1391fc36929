"""From what one file holds to a FlightLog: boots told apart, positions sorted and judged."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from sparsor.flightlog.clocks import Clock, boots_of
from sparsor.flightlog.log import Boot, Event, FlightLog, Track
from sparsor.flightlog.positions import believed_track
from sparsor.flightlog.recording import changes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from sparsor.flightlog.recording import Fixes, PackedFixes, Recording, Ticks


def assemble(name: str, recording: Recording) -> FlightLog:
    """Return the flight log of one file.

    Parameters
    ----------
    name : str
        Of the file, for messages.
    recording : Recording
        Its positions are given away.
    """
    clocks = {system: _clock(ticks) for system, ticks in recording.ticks.items() if ticks.order.size}
    boots = [boot for system, clock in clocks.items() for boot in _boots(system, clock, recording)]
    events = sorted(_events(recording, clocks), key=lambda event: (event.system, event.boot, event.time_s))
    return FlightLog(
        files=(name,),
        kinds=(recording.kind,),
        clocks=clocks,
        boots=tuple(boots),
        values=tuple(recording.values),
        events=tuple(events),
        heard=recording.heard,
        fields=recording.fields,
        damage=recording.damage,
    )


def _clock(ticks: Ticks) -> Clock:
    return Clock(ticks.order, ticks.received_s, ticks.time_s, boots_of(ticks.time_s))


def _boots(system: int, clock: Clock, recording: Recording) -> Iterator[Boot]:
    tracks: dict[int, list[Track]] = {number: [] for number in range(int(clock.boot[-1]) + 1)}
    for owner, message in list(recording.fixes):
        if owner == system:  # and given away: a long log is not held twice
            for number, track in _tracks(message, recording.fixes.pop((owner, message)), clock):
                tracks[number].append(track)
    told_s = _told_offsets(system, clock, recording)
    edges = np.searchsorted(clock.boot, range(len(tracks) + 1))  # boots follow each other in a file
    for number, own in tracks.items():
        rows = slice(edges[number], edges[number + 1])
        time_s, received_s = clock.time_s[rows], clock.received_s[rows]
        offset_s, source = told_s.get(number, float("nan")), "vehicle"
        if np.isnan(offset_s):
            offset_s, source = _offset_at_receipt(time_s, received_s)
        yield Boot(system, number, float(time_s.min()), float(time_s.max()), offset_s, source, tuple(own))


def _tracks(message: str, fixes: Fixes | PackedFixes, clock: Clock) -> Iterator[tuple[int, Track]]:
    heard_s, boot = clock.at(fixes.order, fixes.received_s)
    for number, rows in _runs(boot):
        own = fixes.take(rows)
        yield number, believed_track(message, own, np.where(np.isnan(own.time_s), heard_s[rows], own.time_s))


def _told_offsets(system: int, clock: Clock, recording: Recording) -> dict[int, float]:
    """Return unix time less time since boot, by boot, where the vehicle tells it."""
    told = recording.unix.get(system)
    if told is None:
        return {}
    _, boot = clock.at(told.order, np.full(told.order.size, np.nan))
    return {number: float(np.median(told.offset_s[rows])) for number, rows in _runs(boot)}


def _runs(boot: NDArray[np.int64]) -> Iterator[tuple[int, slice | NDArray[np.intp]]]:
    """Yield every boot and its rows, in their order; boots follow each other, but for a recorder's clock that steps."""
    ordered = bool((np.diff(boot) >= 0).all())
    rows = np.arange(boot.size) if ordered else np.argsort(boot, kind="stable")
    for start, end in pairwise([*changes(boot[rows]).tolist(), boot.size]):
        yield int(boot[rows[start]]), slice(start, end) if ordered else rows[start:end]


def _offset_at_receipt(time_s: NDArray[np.float64], received_s: NDArray[np.float64]) -> tuple[float, str]:
    offset_s = received_s - time_s
    if np.isfinite(offset_s).any():
        return float(np.nanmedian(offset_s)), "receiver"
    return float("nan"), ""


def _events(recording: Recording, clocks: dict[int, Clock]) -> Iterator[Event]:
    for system, clock in clocks.items():
        own = [one for one in recording.happenings if one.system == system]
        order = np.array([one.order for one in own], dtype=np.int64)
        time_s, boot = clock.at(order, np.array([one.received_s for one in own], dtype=np.float64))
        for one, at_s, number in zip(own, time_s.tolist(), boot.tolist(), strict=True):
            yield Event(system, number, at_s, one.kind, one.value, one.text)
