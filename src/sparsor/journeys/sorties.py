"""A planned route that is too long for one battery, as plans that are not."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.geodesy.lengths import distance_m, wgs84
from sparsor.mission.sorties import SortieCosts, best_sorties
from sparsor.vehicle import ground_speed_m_s, stop_seconds, turn_seconds, usable_seconds

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike, NDArray

    from sparsor.journeys.flights import Flights
    from sparsor.mission import FlightTime, Home, MissionPlan

    OrderError = Callable[[Sequence[NDArray[np.int64]]], float]

SPARE: Final = (1.0, 0.98, 0.95, 0.9, 0.8)  # of the endurance less its reserve, tried in this order
MARGIN_S: Final = 0.5  # positions are rounded to a centimetre
NAMED: Final = 10  # of what is beyond reach, in the warning


@dataclass(frozen=True)
class Sorties:
    """Flights that together visit the stops of a route, each from a home and back within the endurance less reserve.

    Parameters
    ----------
    plans : tuple of MissionPlan
    times : tuple of FlightTime
    orders : tuple of arrays of int64
        Places on the route of each flight's stops, in flight order.
    dropped : array of int64
        Places on the route of the stops that no flight visits, beyond reach of them all.
    apart_m : float or None
        Of flights at once: two are never nearer, whenever each of them starts.
    heights_m : tuple of float
        Of flights at once, above home.
    vehicles : tuple of int
        Of flights at once, which vehicle flies each, from 1. It keeps its home and its height.
    rounds : tuple of int
        Of flights at once, the round of each, from 1: those of one round are in the air together, and nobody takes off
        before all of the round before have landed.
    """

    plans: tuple[MissionPlan, ...]
    times: tuple[FlightTime, ...]
    orders: tuple[NDArray[np.int64], ...]
    dropped: NDArray[np.int64]
    apart_m: float | None = None
    heights_m: tuple[float, ...] = ()
    rounds: tuple[int, ...] = ()
    vehicles: tuple[int, ...] = ()

    @property
    def times_by_round(self) -> list[list[FlightTime]]:
        """The times of the flights of each round; of all in one where there are no rounds."""
        numbers = self.rounds or (1,) * len(self.times)
        return [
            [time for time, its in zip(self.times, numbers, strict=True) if its == number]
            for number in sorted({*numbers})
        ]


def cut_into_sorties(flights: Flights, error: OrderError | None = None) -> Sorties | str:
    """Return the flights of a route, or a sentence that says why there are none.

    Stops beyond reach are dropped where the mission says so.

    Parameters
    ----------
    flights : Flights
    error : callable, optional
        To expect of flights over stops at places on the route, where their order matters.
    """
    alone_s = alone_seconds(flights, flights.homes)
    kept, said = within_reach(flights, alone_s)
    if said:
        return said
    usable_s = usable_seconds(flights.prepared.vehicle)
    costs = sortie_costs(flights, flights.homes, kept, alone_s[:, kept])
    for spare in SPARE:
        limited = replace(costs, limit_s=spare * usable_s - MARGIN_S)
        if limited.beyond_reach.size:
            break
        cut = best_sorties(
            limited,
            seed=flights.spec.search.seed,
            error=None if error is None else lambda parts: error([kept[part] for part in parts]),
        )
        orders = tuple(kept[one] for one in cut)
        plans = tuple(flights.build(kept[one], flights.homes[costs.home_of(one)]) for one in cut)
        times = tuple(flights.time(plan) for plan in plans)
        if all(time.used_s <= usable_s for time in times):
            return Sorties(plans, times, orders, np.setdiff1d(np.arange(flights.stops.size), kept))
    return "It is not cut into sorties: what its flights take beside their stops leaves no room for any."


def alone_seconds(flights: Flights, homes: Sequence[Home], altitude_m: float | None = None) -> NDArray[np.float64]:
    """Return what a flight to each stop alone uses of the endurance, from each home, (h, n)."""
    places = range(flights.stops.size)
    return np.array(
        [
            [flights.time(flights.build(np.array([place]), home, altitude_m)).used_s for place in places]
            for home in homes
        ]
    )


def within_reach(flights: Flights, alone_s: NDArray[np.float64]) -> tuple[NDArray[np.int64], str]:
    """Return the places on the route of the stops to fly to, and a sentence where none can be cut off."""
    usable_s = usable_seconds(flights.prepared.vehicle)
    near = alone_s.min(axis=0) <= usable_s - MARGIN_S
    kept, far = np.flatnonzero(near), np.flatnonzero(~near)
    if not far.size or (kept.size and flights.spec.flight.drop_unreachable):
        return kept, ""
    named = ", ".join(str(place + 1) for place in far[:NAMED])
    more = f" and {far.size - NAMED} more" if far.size > NAMED else ""
    are = "stop is" if near.size == 1 else "stops is" if far.size == 1 else "stops are"
    without = ", or leave them out (--drop-unreachable)" if kept.size else "; without them nothing would be left"
    return kept, (
        f"It is not cut into sorties: {far.size} of {near.size} {are} farther from home than one battery reaches and "
        f"comes back from ({named}{more}, counted along the route). Take off nearer (--home LON LAT), or take a "
        f"vehicle of longer endurance{without}."
    )


def sortie_costs(
    flights: Flights, homes: Sequence[Home], kept: NDArray[np.int64], alone_s: NDArray[np.float64]
) -> SortieCosts:
    """Return what flights over some of the stops use.

    Parameters
    ----------
    flights : Flights
    homes : sequence of Home (h,)
    kept : array of int64 (n,)
        Places on the route of the stops to fly to.
    alone_s : array of float64 (h, n)
        What a flight to each of them alone uses.
    """
    prepared = flights.prepared
    vehicle, speed_m_s = prepared.vehicle, prepared.speed_m_s
    stops = flights.stops[kept]
    lon, lat = prepared.place.grid.centres_deg(stops)
    out_s, back_s = map(np.array, zip(*(_ways(flights, home, lon, lat) for home in homes), strict=True))
    leg_s = _seconds(flights, lon[:, None], lat[:, None], lon, lat)
    leg_s[prepared.legs.length[np.ix_(stops, stops)] > prepared.legs.longest] = np.inf
    load = 1.0 if vehicle.circles else vehicle.load("hover")
    stop_s = load * np.array([stop_seconds(vehicle, float(hold), speed_m_s) for hold in flights.holds_s[kept]])
    fixed_s = max(float((alone_s - out_s - back_s - stop_s).max()), 0.0)
    return SortieCosts(leg_s, out_s, back_s, stop_s, fixed_s, usable_seconds(vehicle))


def _seconds(
    flights: Flights, lon0: ArrayLike, lat0: ArrayLike, lon1: ArrayLike, lat1: ArrayLike
) -> NDArray[np.float64]:
    """Return the seconds of legs in the direction flown, with a plane's corner as half a circle."""
    vehicle, speed_m_s = flights.prepared.vehicle, flights.prepared.speed_m_s
    start_lon, start_lat, end_lon, end_lat = np.broadcast_arrays(lon0, lat0, lon1, lat1)
    course_deg, _, length_m = wgs84().inv(
        start_lon.astype(np.float64).ravel(),
        start_lat.astype(np.float64).ravel(),
        end_lon.astype(np.float64).ravel(),
        end_lat.astype(np.float64).ravel(),
    )
    flown = np.asarray(length_m) / ground_speed_m_s(vehicle, speed_m_s, course_deg, flights.prepared.wind)
    flown = flown + turn_seconds(vehicle, np.pi, speed_m_s)
    return np.asarray(flown, dtype=np.float64).reshape(start_lon.shape)


def _ways(
    flights: Flights, home: Home, lon: NDArray[np.float64], lat: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the seconds from a home to each stop and back."""
    prepared = flights.prepared
    vehicle, speed_m_s, zones = prepared.vehicle, prepared.speed_m_s, prepared.place.zones
    base = home.place
    out_s, back_s = _seconds(flights, *base, lon, lat), _seconds(flights, lon, lat, *base)
    if zones is None:
        return out_s, back_s
    # A way past a keep-out counts as if it were flown against the wind.
    way_m, straight_m = zones.lengths_m(base, lon, lat), distance_m(*base, lon, lat)
    against_m_s = speed_m_s - (prepared.wind.speed_m_s if vehicle.flies else 0.0)
    longer = way_m > 1.001 * straight_m
    past_s = way_m / against_m_s + 4.0 * turn_seconds(vehicle, np.pi, speed_m_s)
    return np.where(longer, past_s, out_s), np.where(longer, past_s, back_s)
