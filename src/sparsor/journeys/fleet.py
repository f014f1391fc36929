"""A planned route for several vehicles at once."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import MissionError
from sparsor.journeys.sorties import MARGIN_S, Sorties, alone_seconds, sortie_costs, within_reach
from sparsor.mission.apart import flights_apart
from sparsor.mission.fleet import balanced_flights, cut_evenly, longest_s
from sparsor.vehicle import usable_seconds

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.journeys.flights import Flights
    from sparsor.journeys.sorties import OrderError
    from sparsor.mission import Home, MissionPlan
    from sparsor.mission.fleet import Cut
    from sparsor.mission.sorties import SortieCosts

FAILSAFE = (
    "A failsafe return flies straight home at the vehicle's own return height, through the others' heights: set "
    "RTL_ALT (PX4: RTL_RETURN_ALT) of each vehicle to the height of its own plan, and expect less distance when one "
    "returns."
)


def cut_for_vehicles(flights: Flights, error: OrderError | None = None) -> Sorties | str:
    """Return one flight a vehicle, all at once, or a sentence that says why there are none; parameters as for sorties.

    Raises
    ------
    MissionError
        When they cannot be kept apart.
    """
    flight, vehicle = flights.spec.flight, flights.prepared.vehicle
    highest_m = _highest_m(flights)
    alone_s = alone_seconds(flights, flights.homes, highest_m)
    kept, said = within_reach(flights, alone_s)
    if said:
        return said
    costs = sortie_costs(flights, flights.homes, kept, alone_s[:, kept])
    cut = _balanced(flights, costs, kept, error)
    sorties = _apart(flights, [(home, kept[stops].tolist()) for home, stops in cut])
    usable_s = usable_seconds(vehicle)
    longest_used_s = max(time.used_s for time in sorties.times)
    if longest_used_s > usable_s:
        return (
            f"{flight.vehicles} vehicles at once are not enough for the route: the longest flight would take "
            f"{longest_used_s / 60:.1f} of {usable_s / 60:.1f} min. Take more --vehicles, or leave them out and fly "
            "one sortie after the other."
        )
    return replace(sorties, dropped=np.setdiff1d(np.arange(flights.stops.size), kept))


def _balanced(flights: Flights, costs: SortieCosts, kept: NDArray[np.int64], error: OrderError | None) -> Cut:
    """Return flights whose longest is short; in another order than the route's where the map does not lose by it."""
    vehicles = min(flights.spec.flight.vehicles, kept.size)
    found = balanced_flights(costs, vehicles, seed=flights.spec.search.seed)
    even = cut_evenly(costs, vehicles)
    if error is None or found == even or longest_s(costs, even) > costs.limit_s - MARGIN_S:
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


def _apart(flights: Flights, cut: Cut) -> Sorties:
    flight, vehicle = flights.spec.flight, flights.prepared.vehicle
    orders = [np.array(stops, dtype=np.int64) for _, stops in cut]
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
    own = [flights.homes[home] for home, _ in cut] if len(flights.homes) > 1 else flights.homes[:1]
    found = flights_apart(
        build, ends, own, vehicle=vehicle, lowest_m=flight.altitude_m, separation_m=flight.separation_m
    )
    if found is None:
        raise MissionError(_not_apart(flights, len(cut)))
    plans = tuple(found.plans)
    apart_m = found.nearest.distance_m if len(plans) > 1 else None
    return Sorties(
        plans,
        tuple(flights.time(plan) for plan in plans),
        tuple(orders),
        np.empty(0, dtype=np.int64),
        apart_m=apart_m,
        heights_m=found.heights_m,
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
