"""Several log files of one mission put together: what two of them hold counts once."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from sparsor.flightlog.clocks import Clock
from sparsor.flightlog.log import Boot, Damage, Event, FlightLog, NamedValues, Track
from sparsor.flightlog.positions import joined

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

SAME_BOOT_S = 2.0
"""Two boots of one vehicle whose time of day at power-up differs by less are one."""
SAME_EVENT_S = 3.0
_SHARED = 0.1  # of the shorter track's positions
_KEY = np.dtype([("boot", "<i8"), ("stamp", "<i8"), ("value", "<i8"), ("nth", "<i8")])


def join(logs: Sequence[FlightLog]) -> FlightLog:
    """Return one log for several.

    A boot that two files hold (a log and its repeat, two ground stations, the vehicle's own log and the ground
    station's) becomes one, and a value that both hold (same source, boot, stamp, name and value) is kept once.

    Parameters
    ----------
    logs : sequence of FlightLog
        At least one.
    """
    return reduce(_join_two, logs)


def _join_two(one: FlightLog, other: FlightLog) -> FlightLog:
    shift = 1 + max(
        (
            int(array.max())
            for array in (*(c.order for c in one.clocks.values()), *(v.order for v in one.values))
            if array.size
        ),
        default=0,
    )
    numbers = _numbering(one, other)
    other = _renumbered(other, numbers, shift)
    clocks = {
        system: _joined_clocks([log.clocks[system] for log in (one, other) if system in log.clocks], shift)
        for system in sorted({*one.clocks, *other.clocks})
    }
    values, repeated = _joined_values(one, other)
    heard = Counter(dict(one.heard))
    heard.update(other.heard)
    return FlightLog(
        files=one.files + other.files,
        kinds=one.kinds + other.kinds,
        clocks=clocks,
        boots=_joined_boots(one, other),
        values=values,
        events=_joined_events(one, other),
        heard=dict(sorted(heard.items())),
        fields=tuple(sorted({*one.fields, *other.fields})),
        damage=one.damage + other.damage + Damage(repeated=repeated),
    )


def _numbering(one: FlightLog, other: FlightLog) -> dict[tuple[int, int], int]:
    """Return which number every boot of the other log gets."""
    numbers: dict[tuple[int, int], int] = {}
    used: set[tuple[int, int]] = set()
    following = {
        system: 1 + max((b.number for b in one.boots if b.system == system), default=-1) for system in other.clocks
    }
    for boot in other.boots:
        own = [known for known in one.boots if known.system == boot.system and _same_boot(known, boot)]
        own = [known for known in own if (known.system, known.number) not in used]
        if own:
            numbers[boot.system, boot.number] = own[0].number
            used.add((boot.system, own[0].number))
        else:
            numbers[boot.system, boot.number] = following[boot.system]
            following[boot.system] += 1
    return numbers


def _same_boot(one: Boot, other: Boot) -> bool:
    same_time = abs(one.unix_offset_s - other.unix_offset_s) < SAME_BOOT_S
    if same_time or one.unix_source == other.unix_source == "vehicle":
        return same_time
    # A recorder's clock may be wrong: the same places at the same times are the same flight.
    rows = {track.message: _rows(track) for track in one.tracks}
    for track in other.tracks:
        mine, theirs = rows.get(track.message, set()), _rows(track)
        if mine and theirs and len(mine & theirs) > _SHARED * min(len(mine), len(theirs)):
            return True
    return False


def _rows(track: Track) -> set[tuple[float, float, float]]:
    columns = (track.time_s.tolist(), track.places.lon_deg.tolist(), track.places.lat_deg.tolist())
    return set(zip(*columns, strict=True))


def _renumbered(log: FlightLog, numbers: dict[tuple[int, int], int], shift: int) -> FlightLog:
    def new(system: int, boots: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.array([numbers[system, number] for number in boots.tolist()], dtype=np.int64)

    return replace(
        log,
        clocks={
            system: replace(clock, order=clock.order + shift, boot=new(system, clock.boot))
            for system, clock in log.clocks.items()
        },
        boots=tuple(replace(boot, number=numbers[boot.system, boot.number]) for boot in log.boots),
        values=tuple(replace(values, order=values.order + shift) for values in log.values),
        events=tuple(replace(event, boot=numbers[event.system, event.boot]) for event in log.events),
    )


def _joined_clocks(clocks: Sequence[Clock], begin: int) -> Clock:
    """Put clocks one behind the other, the second of which is of a file whose places in the log begin there.

    The first stands still to the end of its file and the second from the beginning of its own, so that no place in one
    file gets a time between the two.
    """
    if len(clocks) > 1:
        clocks = (_reading_at(clocks[0], begin - 1, -1), _reading_at(clocks[1], begin, 0))
    return Clock(
        np.concatenate([clock.order for clock in clocks]),
        np.concatenate([clock.received_s for clock in clocks]),
        np.concatenate([clock.time_s for clock in clocks]),
        np.concatenate([clock.boot for clock in clocks]),
    )


def _reading_at(clock: Clock, order: int, row: int) -> Clock:
    """Repeat the last reading (row -1) behind the others, or the first one (row 0) before them."""
    where = clock.order.size if row else 0
    return Clock(
        np.insert(clock.order, where, order),
        np.insert(clock.received_s, where, clock.received_s[row]),
        np.insert(clock.time_s, where, clock.time_s[row]),
        np.insert(clock.boot, where, clock.boot[row]),
    )


def _joined_boots(one: FlightLog, other: FlightLog) -> tuple[Boot, ...]:
    boots = {(boot.system, boot.number): boot for boot in one.boots}
    for boot in other.boots:
        known = boots.get((boot.system, boot.number))
        boots[boot.system, boot.number] = boot if known is None else _joined_boot(known, boot)
    return tuple(boots[key] for key in sorted(boots))


def _joined_boot(one: Boot, other: Boot) -> Boot:
    tracks = {track.message: track for track in one.tracks}
    for track in other.tracks:
        known = tracks.get(track.message)
        tracks[track.message] = track if known is None else _joined_track(known, track)
    told = other if one.unix_source != "vehicle" and other.unix_source == "vehicle" else one
    return Boot(
        one.system,
        one.number,
        min(one.start_s, other.start_s),
        max(one.end_s, other.end_s),
        told.unix_offset_s,
        told.unix_source,
        tuple(tracks.values()),
    )


def _joined_track(one: Track, other: Track) -> Track:
    time_s, rows = np.unique(np.concatenate((one.time_s, other.time_s)), return_index=True)
    return Track(one.message, time_s, joined(one.places, other.places).take(rows), one.dropped + other.dropped)


def _joined_events(one: FlightLog, other: FlightLog) -> tuple[Event, ...]:
    """Put the events together; the same one at about the same time counts once."""

    def key(event: Event) -> Event:
        return replace(event, time_s=0.0)

    known: dict[Event, list[float]] = {}
    for event in one.events:
        known.setdefault(key(event), []).append(event.time_s)
    new = [
        event
        for event in other.events
        if not any(abs(event.time_s - time_s) < SAME_EVENT_S for time_s in known.get(key(event), ()))
    ]
    events = [*one.events, *new]
    return tuple(sorted(events, key=lambda event: (event.system, event.boot, event.time_s)))


def _joined_values(one: FlightLog, other: FlightLog) -> tuple[tuple[NamedValues, ...], int]:
    series = {(values.sender, values.message, values.name): values for values in one.values}
    repeated = 0
    for values in other.values:
        key = (values.sender, values.message, values.name)
        known = series.get(key)
        if known is None:
            series[key] = values
            continue
        new = ~np.isin(_keys(values, other), _keys(known, one))
        repeated += int((~new).sum())
        series[key] = _appended(known, values.take(new))
    return tuple(series.values()), repeated


def _keys(values: NamedValues, log: FlightLog) -> np.ndarray:
    """Return what tells one value from another; a value that comes twice in one file is two values."""
    clock = log.clocks.get(values.sender.system) or next(iter(log.clocks.values()), None)
    keys = np.zeros(values.order.size, dtype=_KEY)
    if clock is not None:
        keys["boot"] = clock.at(values.order, values.received_s)[1]
    keys["stamp"] = np.nan_to_num(np.round(values.stamp_s * 1e6), nan=-1.0).astype(np.int64)
    keys["value"] = values.value.view(np.int64)
    _, which = np.unique(keys, return_inverse=True)
    rows = np.argsort(which, kind="stable")
    starts = np.concatenate(([0], np.flatnonzero(np.diff(which[rows])) + 1))
    lengths = np.diff(np.concatenate((starts, [rows.size])))
    keys["nth"][rows] = np.arange(rows.size) - np.repeat(starts, lengths)
    return keys


def _appended(one: NamedValues, other: NamedValues) -> NamedValues:
    places = None
    if one.places is not None and other.places is not None:
        places = joined(one.places, other.places)
    return replace(
        one,
        order=np.concatenate((one.order, other.order)),
        received_s=np.concatenate((one.received_s, other.received_s)),
        stamp_s=np.concatenate((one.stamp_s, other.stamp_s)),
        value=np.concatenate((one.value, other.value)),
        places=places,
    )
