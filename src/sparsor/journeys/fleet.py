"""A planned route for several vehicles at once."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import MissionError
from sparsor.journeys.sorties import MARGIN_S, Sorties, alone_seconds, sortie_costs, within_reach
from sparsor.mission.apart import flights_apart
from sparsor.mission.fleet import MOST_TRIES, SHORTER, balanced_flights, cut_evenly, in_rounds, longest_s

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.journeys.flights import Flights
    from sparsor.journeys.sorties import OrderError
    from sparsor.mission import Home, MissionPlan
    from sparsor.mission.fleet import Cut
    from sparsor.mission.sorties import SortieCosts

HOPELESS = SHORTER**-MOST_TRIES  # how much shorter than the route's even parts PyVRP's flights may come out
MOST_BUILT = 4  # numbers of rounds that should fit and do not, from where the vehicles stand
FAILSAFE = (
    "A failsafe return flies straight home at the vehicle's own return height, through the others' heights: set "
    "RTL_ALT (PX4: RTL_RETURN_ALT) of each vehicle to the height of its own plan, and expect less distance when one "
    "returns."
)


def cut_for_vehicles(flights: Flights, error: OrderError | None = None) -> Sorties | str:
    """Return flights of several vehicles at once, in as few rounds as were found; parameters as for sorties.

    Or a sentence that says why there are none.

    Raises
    ------
    MissionError
        When they cannot be kept apart.
    """
    flight = flights.spec.flight
    highest_m = _highest_m(flights)
    alone_s = alone_seconds(flights, flights.homes, highest_m)
    kept, said = within_reach(flights, alone_s)
    if said:
        return said
    costs = sortie_costs(flights, flights.homes, kept, alone_s[:, kept])
    own = costs.homes > 1
    at_once = 1 if own else min(flight.vehicles, kept.size)  # at least, of flights of one stop each
    built = 0
    for rounds in range(1, -(-kept.size // at_once) + 1):
        even = cut_evenly(costs, flight.vehicles, rounds)
        if HOPELESS * costs.limit_s < longest_s(costs, even) < np.inf:
            continue
        cut = _balanced(flights, costs, kept, even, rounds, error)
        if longest_s(costs, cut) > costs.limit_s - MARGIN_S:
            continue
        by_round = in_rounds(cut, flight.vehicles, own=own)
        sorties = _apart(flights, [[(home, kept[stops]) for home, stops in one] for one in by_round])
        if all(time.used_s <= costs.limit_s for time in sorties.times):
            return replace(sorties, dropped=np.setdiff1d(np.arange(flights.stops.size), kept))
        built += 1
        if built == MOST_BUILT:
            break
    return (
        f"It is not cut for {flight.vehicles} vehicles at once: what a flight takes beside its stops, from a place of "
        "its own, leaves no room for any. Take off nearer (--home LON LAT, once a vehicle), or leave --vehicles out "
        "and fly one sortie after the other."
    )


def _balanced(
    flights: Flights, costs: SortieCosts, kept: NDArray[np.int64], even: Cut, rounds: int, error: OrderError | None
) -> Cut:
    """Return flights whose longest is short; in another order than the route's where the map does not lose by it."""
    spec = flights.spec
    found = balanced_flights(costs, spec.flight.vehicles, rounds=rounds, even=even, seed=spec.search.seed)
    if error is None or found == even or longest_s(costs, even) == np.inf:
        return found
    lost = error([kept[stops] for _, stops in found]) > error([kept[stops] for _, stops in even])
    return even if lost else found


def _highest_m(flights: Flights) -> float:
    """Return the height of the highest flight.

    Raises
    ------
    MissionError
        When it is above the vehicle's ceiling.
    """
    flight, vehicle = flights.spec.flight, flights.prepared.vehicle
    if not vehicle.flies:
        return flight.altitude_m
    highest_m = flight.altitude_m + (flight.vehicles - 1) * flight.separation_m
    if highest_m > vehicle.ceiling_m:
        raise MissionError(
            f"{flight.vehicles} vehicles {flight.separation_m:g} m above each other from {flight.altitude_m:g} m up "
            f"reach {highest_m:g} m, above the ceiling of {vehicle.ceiling_m:g} m in the profile of the "
            f"{vehicle.name}: lower --altitude or --separation, or take fewer --vehicles"
        )
    return highest_m


def _apart(flights: Flights, cut: Sequence[Sequence[tuple[int, NDArray[np.int64]]]]) -> Sorties:
    """Return the flights of each round, by their homes and places on the route, so that they are apart.

    Raises
    ------
    MissionError
        When they cannot be.
    """
    flight, vehicle = flights.spec.flight, flights.prepared.vehicle
    each = [(number, home, order) for number, one in enumerate(cut, start=1) for home, order in one]
    rounds, orders = tuple(number for number, *_ in each), tuple(order for *_, order in each)
    zones = flights.prepared.place.zones

    def build(number: int, home: Home, altitude_m: float) -> MissionPlan | None:
        if zones is not None and bool(zones.holds(home.lon_deg, home.lat_deg)):
            return None
        try:
            return flights.build(orders[number], home, altitude_m)
        except MissionError:  # no way from there past what is kept out of
            if zones is None:
                raise
            return None

    ends = []
    for order in orders:
        lon, lat = flights.prepared.place.grid.centres_deg(flights.stops[order[[0, -1]]])
        ends.append(((float(lon[0]), float(lat[0])), (float(lon[1]), float(lat[1]))))
    own = len(flights.homes) > 1
    found = flights_apart(
        build,
        ends,
        [flights.homes[home] for _, home, _ in each] if own else flights.homes[:1],
        vehicle=vehicle,
        lowest_m=flight.altitude_m,
        separation_m=flight.separation_m,
        rounds=rounds,
    )
    if found is None:
        raise MissionError(_not_apart(flights, max(map(len, cut))))
    given = list(flight.given_homes)  # in which order vehicles are counted; the flights' own begins with the best
    vehicles = [given.index(flights.homes[home].place) for _, home, _ in each] if own else found.vehicles
    placed = sorted(range(len(each)), key=lambda place: (rounds[place], vehicles[place]))
    sorties = Sorties(
        tuple(found.plans[place] for place in placed),
        tuple(flights.time(found.plans[place]) for place in placed),
        tuple(orders[place] for place in placed),
        np.empty(0, dtype=np.int64),
    )
    if len(each) == max(rounds):  # one after the other
        return sorties
    return replace(
        sorties,
        apart_m=found.distance_m,
        heights_m=tuple(found.heights_m[place] for place in placed),
        rounds=tuple(rounds[place] for place in placed),
        vehicles=tuple(vehicles[place] + 1 for place in placed),
    )


def _not_apart(flights: Flights, count: int) -> str:
    flight, vehicle = flights.spec.flight, flights.prepared.vehicle
    if not vehicle.flies:
        return (
            f"{count} times a {vehicle.kind} on this route come nearer to each other than {flight.separation_m:g} m: "
            "they all stay down, and their ways cross or meet. Lessen --separation, or plan an area for each"
        )
    tried = "from the homes that were given" if len(flights.homes) > 1 else "from places beside home, in any direction"
    return (
        f"{count} vehicles cannot be kept {flight.separation_m:g} m apart on this route {tried}: one always climbs or "
        "lands too near to the way of another. Give each vehicle a home of its own, off the route (--home LON LAT, "
        "once a vehicle), lessen --separation, or take fewer --vehicles"
    )
