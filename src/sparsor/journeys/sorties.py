"""A planned route that is too long for one battery, as plans that are not."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.geodesy.lengths import distance_m, wgs84
from sparsor.mission import FlightTime, MissionPlan, time_plan
from sparsor.mission.sorties import SortieCosts, best_sorties
from sparsor.vehicle import ground_speed_m_s, stop_seconds, turn_seconds, usable_seconds

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from sparsor.journeys.preparing import Prepared

SPARE: Final = (1.0, 0.98, 0.95, 0.9, 0.8)  # of the endurance less its reserve, tried in this order
MARGIN_S: Final = 0.5  # positions are rounded to a centimetre


@dataclass(frozen=True)
class Sorties:
    """Flights that together visit every stop of a route, each from home and back within the endurance less reserve.

    Parameters
    ----------
    plans : tuple of MissionPlan
    times : tuple of FlightTime
    orders : tuple of arrays of int64
        Places on the route of each flight's stops, in flight order.
    """

    plans: tuple[MissionPlan, ...]
    times: tuple[FlightTime, ...]
    orders: tuple[NDArray[np.int64], ...]


def cut_into_sorties(
    prepared: Prepared,
    stops: NDArray[np.int64],
    holds_s: NDArray[np.float64],
    build: Callable[..., MissionPlan],
    seed: int,
) -> Sorties | str:
    """Return the flights of a route, or a sentence that says why there are none.

    Parameters
    ----------
    prepared : Prepared
    stops : array of int64 (n,)
        Cells in the order of the route.
    holds_s : array of float64 (n,)
        At each stop, as written.
    build : callable
        Returns the plan over some of the stops, by their places on the route.
    seed : int
    """
    alone = [time_plan(build(np.array([place])), prepared.vehicle, prepared.wind).used_s for place in range(stops.size)]
    usable_s = usable_seconds(prepared.vehicle)
    far = np.flatnonzero(np.array(alone) > usable_s - MARGIN_S)
    if far.size:
        return (
            f"It is not cut into sorties: {far.size} of {stops.size} stops are farther from home than one battery "
            "reaches and comes back from. Take off nearer (--home LON LAT), or take a vehicle of longer endurance."
        )
    costs = _costs(prepared, stops, holds_s, build(np.array([0])), np.array(alone))
    for spare in SPARE:
        limited = replace(costs, limit_s=spare * usable_s - MARGIN_S)
        if limited.beyond_reach.size:
            break
        orders = tuple(np.array(one, dtype=np.int64) for one in best_sorties(limited, seed=seed))
        plans = tuple(build(order) for order in orders)
        times = tuple(time_plan(plan, prepared.vehicle, prepared.wind) for plan in plans)
        if all(time.used_s <= usable_s for time in times):
            return Sorties(plans, times, orders)
    return "It is not cut into sorties: what its flights take beside their stops leaves no room for any."


def _costs(
    prepared: Prepared,
    stops: NDArray[np.int64],
    holds_s: NDArray[np.float64],
    example: MissionPlan,
    alone_s: NDArray[np.float64],
) -> SortieCosts:
    vehicle, speed_m_s, zones = prepared.vehicle, prepared.speed_m_s, prepared.place.zones
    lon, lat = prepared.place.grid.centres_deg(stops)
    home = (example.home.lon_deg, example.home.lat_deg)
    turning_s = turn_seconds(vehicle, np.pi, speed_m_s)

    def seconds(lon0: ArrayLike, lat0: ArrayLike, lon1: ArrayLike, lat1: ArrayLike) -> NDArray[np.float64]:
        start_lon, start_lat, end_lon, end_lat = np.broadcast_arrays(lon0, lat0, lon1, lat1)
        course_deg, _, length_m = wgs84().inv(
            start_lon.astype(np.float64).ravel(),
            start_lat.astype(np.float64).ravel(),
            end_lon.astype(np.float64).ravel(),
            end_lat.astype(np.float64).ravel(),
        )
        flown = np.asarray(length_m) / ground_speed_m_s(vehicle, speed_m_s, course_deg, prepared.wind) + turning_s
        return np.asarray(flown, dtype=np.float64).reshape(start_lon.shape)

    out_s, back_s = seconds(*home, lon, lat), seconds(lon, lat, *home)
    if zones is not None:
        # A way past a keep-out counts as if it were flown against the wind.
        way_m, straight_m = zones.lengths_m(home, lon, lat), distance_m(*home, lon, lat)
        against_m_s = speed_m_s - (prepared.wind.speed_m_s if vehicle.flies else 0.0)
        longer = way_m > 1.001 * straight_m
        past_s = way_m / against_m_s + 4.0 * turning_s
        out_s, back_s = np.where(longer, past_s, out_s), np.where(longer, past_s, back_s)
    leg_s = seconds(lon[:, None], lat[:, None], lon, lat)
    leg_s[prepared.legs.length[np.ix_(stops, stops)] > prepared.legs.longest] = np.inf
    load = 1.0 if vehicle.circles else vehicle.load("hover")
    stop_s = load * np.array([stop_seconds(vehicle, float(hold), speed_m_s) for hold in holds_s])
    fixed_s = max(float((alone_s - out_s - back_s - stop_s).max()), 0.0)
    return SortieCosts(leg_s, out_s, back_s, stop_s, fixed_s, usable_seconds(vehicle))
