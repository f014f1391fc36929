"""Which positions of a track are believed, and where a vehicle was between two of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.core.compiled import njit
from sparsor.flightlog.log import DroppedFixes, Places, Track

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.flightlog.recording import Fixes

FASTEST_M_S: Final = 100.0
"""A position that could only be reached faster than this is a fault of the receiver."""
_M_PER_DEG = 111_195.0  # a mean sphere: a check against 100 m/s needs no ellipsoid


def believed_track(message: str, fixes: Fixes, time_s: NDArray[np.float64]) -> Track:
    """Return the positions in order of time without those that cannot be true.

    Parameters
    ----------
    message : str
    fixes : Fixes
        Of one boot.
    time_s : array of float64 (n,)
        Their time since boot.
    """
    places = fixes.places
    zero = (places.lon_deg == 0) & (places.lat_deg == 0)
    with np.errstate(invalid="ignore"):
        globe = (np.abs(places.lon_deg) <= 180) & (np.abs(places.lat_deg) <= 90) & np.isfinite(time_s)
    zero |= ~globe
    good = np.flatnonzero(fixes.has_fix & ~zero)
    _, first = np.unique(time_s[good], return_index=True)
    rows = good[first]
    ordered = (time_s[rows], places.lon_deg[rows], places.lat_deg[rows])
    smooth = _reachable(*ordered, _surely_true(*ordered))
    stands_for = np.ones(zero.size, dtype=np.int32) if fixes.stands_for is None else fixes.stands_for
    dropped = DroppedFixes(
        zero=int(stands_for[zero & fixes.has_fix].sum()),
        no_fix=int(stands_for[~fixes.has_fix].sum()),
        jumping=int(stands_for[rows[~smooth]].sum()),
    )
    kept = rows[smooth]
    return Track(message, time_s[kept], places.take(kept), dropped)


def interpolated(track: Track, time_s: NDArray[np.float64], max_gap_s: float) -> tuple[Places, NDArray[np.bool_]]:
    """Return where the vehicle was, and for which times that is known.

    Parameters
    ----------
    track : Track
    time_s : array of float64 (n,)
        Seconds since boot.
    max_gap_s : float
        Positions farther apart in time than this say nothing about what lies between them.

    Returns
    -------
    places : Places (n,)
    known : array of bool (n,)
        Whether there is a position before (or at) and after (or at) the time.
    """
    own_s = track.time_s
    if own_s.size == 0:
        nowhere = np.full(time_s.size, np.nan)
        return Places(nowhere, nowhere, nowhere, nowhere), np.zeros(time_s.size, dtype=np.bool_)
    after = np.clip(np.searchsorted(own_s, time_s), 0, own_s.size - 1)
    before = np.clip(np.searchsorted(own_s, time_s, side="right") - 1, 0, own_s.size - 1)
    with np.errstate(invalid="ignore"):
        inside = (time_s >= own_s[0]) & (time_s <= own_s[-1])
        known = inside & (own_s[after] - own_s[before] <= max_gap_s)
    turned = np.unwrap(track.places.lon_deg, period=360.0)  # a flight may cross the antimeridian
    lon_deg = (np.interp(time_s, own_s, turned) + 180.0) % 360.0 - 180.0
    lat_deg, alt_m, height_m = (
        np.interp(time_s, own_s, values)
        for values in (track.places.lat_deg, track.places.alt_amsl_m, track.places.height_m)
    )
    return Places(lon_deg, lat_deg, alt_m, height_m), known


def filled(tracks: tuple[Track, ...], max_gap_s: float) -> Track:
    """Return the first track, with the others' positions where it has none for longer than `max_gap_s`.

    Parameters
    ----------
    tracks : tuple of Track
        At least one; the most trusted first.
    """
    best = tracks[0]
    for other in tracks[1:]:
        _, known = interpolated(best, other.time_s, max_gap_s)
        if known.all():
            continue
        times_s = np.concatenate((best.time_s, other.time_s[~known]))
        rows = np.argsort(times_s, kind="stable")
        name = f"{best.message}, {other.message}" if best.time_s.size else other.message
        best = Track(name, times_s[rows], joined(best.places, other.places.take(~known)).take(rows), best.dropped)
    return best


def joined(one: Places, other: Places) -> Places:
    """Return the places of two, one after the other."""
    return Places(
        np.concatenate((one.lon_deg, other.lon_deg)),
        np.concatenate((one.lat_deg, other.lat_deg)),
        np.concatenate((one.alt_amsl_m, other.alt_amsl_m)),
        np.concatenate((one.height_m, other.height_m)),
    )


def _surely_true(time_s: NDArray[np.float64], lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]) -> int:
    """Return a row in the middle of the longest piece without a jump."""
    jumps = np.flatnonzero(_speeds(time_s, lon_deg, lat_deg) > FASTEST_M_S) + 1
    edges = np.concatenate(([0], jumps, [time_s.size]))
    longest = int(np.argmax(np.diff(edges)))
    return int(edges[longest] + edges[longest + 1]) // 2


def _speeds(
    time_s: NDArray[np.float64], lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]
) -> NDArray[np.float64]:
    across = (np.diff(lon_deg) + 180.0) % 360.0 - 180.0
    east = across * np.cos(np.radians(lat_deg[1:]))
    return np.asarray(np.hypot(east, np.diff(lat_deg)) * _M_PER_DEG / np.diff(time_s), dtype=np.float64)


@njit(cache=True, nogil=True)
def _reachable(
    time_s: NDArray[np.float64], lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64], anchor: int
) -> NDArray[np.bool_]:
    """Go from a true position both ways, and believe what can be reached from the last one believed."""
    believed = np.zeros(time_s.size, dtype=np.bool_)
    if time_s.size == 0:
        return believed
    believed[anchor] = True
    for step in (-1, 1):
        last = anchor
        row = anchor + step
        while 0 <= row < time_s.size:
            across = (lon_deg[row] - lon_deg[last] + 180.0) % 360.0 - 180.0
            east = across * np.cos(np.radians(lat_deg[row]))
            metres = np.hypot(east, lat_deg[row] - lat_deg[last]) * _M_PER_DEG
            if metres <= FASTEST_M_S * abs(time_s[row] - time_s[last]):
                believed[row] = True
                last = row
            row += step
    return believed
