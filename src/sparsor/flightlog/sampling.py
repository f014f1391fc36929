"""From a log to samples: every value with the place at which it was measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.flightlog.choosing import chosen_sensor, chosen_vehicle, sensors
from sparsor.flightlog.log import AUTOPILOT, Boot, Places
from sparsor.flightlog.positions import believed_track, filled, interpolated
from sparsor.flightlog.recording import Fixes
from sparsor.flightlog.table import MESSAGE
from sparsor.flightlog.timing import VEHICLE, ClockUse, vehicle_times

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.flightlog.log import FlightLog, NamedValues, Sender, Track

MAX_GAP_S: Final = 5.0
"""Positions farther apart in time than this say nothing about what lies between them, unless told otherwise."""
FILE = "file"


@dataclass(frozen=True)
class DroppedSamples:
    """Values that were left out.

    Parameters
    ----------
    no_position : int
        No position near enough before and after, or none that is believed.
    not_finite : int
        The value or its time was not a number.
    """

    no_position: int = 0
    not_finite: int = 0


@dataclass(frozen=True, eq=False)
class Samples:
    """The values of one sensor and where they were measured, in order of time.

    Parameters
    ----------
    sensor : str
    sender : Sender
    system : int
        The vehicle whose positions they have.
    time_s : array of float64 (n,)
        The vehicle's seconds since boot; starts again with every boot.
    lon_deg, lat_deg : array of float64 (n,)
    alt_m : array of float64 (n,)
        Metres above mean sea level; NaN when unknown.
    value : array of float64 (n,)
        In the sensor's unit.
    clock : array of str (n,)
        What `time_s` is from, as in `ClockUse`.
    boot : array of int64 (n,)
        Number of the vehicle's boot.
    unix_s : array of float64 (n,)
        Time of day, seconds since 1970; NaN when nothing tells it.
    height_m : array of float64 (n,)
        Metres above home; NaN when unknown.
    clocks : tuple of ClockUse
    track : str
        Messages the positions are from.
    dropped : DroppedSamples
    others : tuple of str
        Other sensors in the log, as NAME@SYSTEM/COMPONENT.
    """

    sensor: str
    sender: Sender
    system: int
    time_s: NDArray[np.float64]
    lon_deg: NDArray[np.float64]
    lat_deg: NDArray[np.float64]
    alt_m: NDArray[np.float64]
    value: NDArray[np.float64]
    clock: NDArray[np.str_]
    boot: NDArray[np.int64]
    unix_s: NDArray[np.float64]
    height_m: NDArray[np.float64]
    clocks: tuple[ClockUse, ...]
    track: str
    dropped: DroppedSamples
    others: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Part:
    """Samples of one boot."""

    boot: Boot
    rows: NDArray[np.intp]
    time_s: NDArray[np.float64]
    places: Places
    clock: NDArray[np.str_]
    uses: list[ClockUse]
    track: str


def samples(
    log: FlightLog, *, sensor: str | None = None, system: int | None = None, max_gap_s: float = MAX_GAP_S
) -> Samples:
    """Return a sensor's values with places, interpolated between the vehicle's positions on one clock.

    The stamps of a sender that shares the vehicle's clock are its time since boot, in whatever unit; those of another
    clock are mapped by a line through its stamps and the vehicle's time at their arrival; without useful stamps the
    arrival counts. A value with no position on both sides is dropped.

    Parameters
    ----------
    log : FlightLog
    sensor : str, optional
        NAME, NAME@SYSTEM/COMPONENT, or MSG.FIELD of a .BIN file; may be left out when there is one sensor.
    system : int, optional
        The vehicle; may be left out when only one has positions, or when it carries the sensor.
    max_gap_s : float
        Positions farther apart than this are not interpolated between, seconds.

    Raises
    ------
    LogError
        When the sensor or the vehicle is not in the log, or may be one of several.
    """
    values = chosen_sensor(log, sensor)
    vehicle = chosen_vehicle(log, values, system)
    clock = log.clocks[vehicle]
    heard_s, boot_of = clock.at(values.order, values.received_s)
    heard = clock.runs_at(values.order, values.received_s, max_gap_s)
    parts: list[_Part] = []
    by_boot = np.flatnonzero(heard)
    by_boot = by_boot[np.argsort(boot_of[by_boot], kind="stable")]
    for boot in (one for one in log.boots if one.system == vehicle):
        rows = by_boot[slice(*np.searchsorted(boot_of[by_boot], (boot.number, boot.number + 1)))]
        if rows.size:
            parts.append(_part(values, boot, rows, heard_s[rows], max_gap_s))
    return _together(log, values, vehicle, parts)


def _part(
    values: NamedValues, boot: Boot, rows: NDArray[np.intp], heard_s: NDArray[np.float64], max_gap_s: float
) -> _Part:
    own = values.take(rows)
    if own.places is not None:
        return _own_places(own, boot, rows)
    autopilot = own.sender == (boot.system, AUTOPILOT)
    time_s, clock, uses = vehicle_times(boot.number, own.stamp_s, heard_s, boot.unix_offset_s, autopilot=autopilot)
    track = filled(boot.tracks, max_gap_s) if boot.tracks else None
    if track is None:
        return _Part(boot, rows[:0], time_s[:0], Places(*(time_s[:0],) * 4), clock[:0], uses, "")
    places, known = interpolated(track, time_s, max_gap_s)
    return _Part(boot, rows[known], time_s[known], places.take(known), clock[known], uses, track.message)


def _own_places(own: NamedValues, boot: Boot, rows: NDArray[np.intp]) -> _Part:
    """Take the places that the messages themselves hold, those that can be true."""
    assert own.places is not None
    everywhere = np.ones(rows.size, dtype=np.bool_)
    fixes = Fixes(own.order, own.received_s, own.stamp_s, own.places, everywhere)
    track = believed_track(own.message, fixes, own.stamp_s)
    known = _on_track(own.places, own.stamp_s, track)
    clock = FILE if own.message == MESSAGE else VEHICLE
    use = ClockUse(boot.number, clock, 1.0, 0.0, 0.0, int(known.sum()))
    labels = np.full(int(known.sum()), clock)
    return _Part(boot, rows[known], own.stamp_s[known], own.places.take(known), labels, [use], own.message)


def _on_track(places: Places, time_s: NDArray[np.float64], track: Track) -> NDArray[np.bool_]:
    if track.time_s.size == 0:
        return np.zeros(time_s.size, dtype=np.bool_)
    at = np.clip(np.searchsorted(track.time_s, time_s), 0, track.time_s.size - 1)
    same_place = (track.places.lon_deg[at] == places.lon_deg) & (track.places.lat_deg[at] == places.lat_deg)
    return np.asarray((track.time_s[at] == time_s) & same_place, dtype=np.bool_)


def _together(log: FlightLog, values: NamedValues, vehicle: int, parts: Sequence[_Part]) -> Samples:
    def row(arrays: Sequence[NDArray[np.generic]]) -> np.ndarray:
        return np.concatenate(arrays) if arrays else np.zeros(0)

    began_unix_s = {part.boot.number: part.boot.start_s + part.boot.unix_offset_s for part in parts}
    if np.isfinite(list(began_unix_s.values())).all():  # files may be given in any order
        parts = sorted(parts, key=lambda part: began_unix_s[part.boot.number])
    time_s = row([part.time_s for part in parts])
    turn = row([np.full(part.time_s.size, place) for place, part in enumerate(parts)])
    boot = row([np.full(part.time_s.size, part.boot.number) for part in parts])
    unix_s = row([part.time_s + part.boot.unix_offset_s for part in parts])
    height_m = row([_heights_m(part) for part in parts])
    value = row([values.value[part.rows] for part in parts])
    lon, lat, alt = (
        row([getattr(part.places, name) for part in parts]) for name in ("lon_deg", "lat_deg", "alt_amsl_m")
    )
    clock = row([part.clock for part in parts])
    good = np.isfinite(value) & np.isfinite(time_s)
    rows = np.lexsort((time_s, turn))
    rows = rows[good[rows]]
    return Samples(
        sensor=values.name,
        sender=values.sender,
        system=vehicle,
        time_s=time_s[rows],
        lon_deg=lon[rows],
        lat_deg=lat[rows],
        alt_m=alt[rows],
        value=value[rows],
        clock=clock[rows].astype(np.str_),
        boot=boot[rows].astype(np.int64),
        unix_s=unix_s[rows],
        height_m=height_m[rows],
        clocks=tuple(use for part in parts for use in part.uses),
        track=", ".join(dict.fromkeys(part.track for part in parts if part.track)),
        dropped=DroppedSamples(values.value.size - value.size, int((~good).sum())),
        others=tuple(f"{one.name}@{one.sender}" for one in sensors(log) if one is not values),
    )


def _heights_m(part: _Part) -> NDArray[np.float64]:
    """Return heights above home; where a message has none, from the home that the boot's tracks agree on."""
    homes = [track.places.alt_amsl_m - track.places.height_m for track in part.boot.tracks]
    home = np.concatenate([np.zeros(0), *homes])
    home = home[np.isfinite(home)]
    if home.size == 0:
        return part.places.height_m
    return np.where(np.isnan(part.places.height_m), part.places.alt_amsl_m - np.median(home), part.places.height_m)
