"""From a route to a plan: take-off, speed, stops, the way home, landing, fence and rally point."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import MissionError
from sparsor.mission.advice import build_warnings
from sparsor.mission.clearance import height_to_return_at
from sparsor.mission.fence import MAX_CORNERS, fence_around
from sparsor.mission.keepouts import exclusion_circles, exclusions
from sparsor.mission.layout import lay_out
from sparsor.mission.plan import Home, MissionPlan, RallyPoint
from sparsor.mission.sequences import BESIDE_STOPS, Visit, flight_items
from sparsor.mission.timing import time_plan
from sparsor.mission.triggers import CAMERA, check_triggers
from sparsor.vehicle import CALM, Autopilot, SteadyWind, Vehicle, autopilot_named, check_wind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from sparsor.geodesy.zones import Zones
    from sparsor.mission.following import Ground
    from sparsor.mission.triggers import Trigger

# An autopilot stores positions as integers of 1e-7 degrees: what is written is what is flown.
DECIMALS = 7
MAX_SPEED_M_S = 200.0
MAX_ALTITUDE_M = 20_000.0


def build_mission(
    stops_lon_deg: ArrayLike,
    stops_lat_deg: ArrayLike,
    *,
    vehicle: Vehicle,
    autopilot: Autopilot | str,
    altitude_m: float,
    home: Home | None = None,
    speed_m_s: float | None = None,
    hold_s: ArrayLike = 0.0,
    fence_margin_m: float = 50.0,
    wind: SteadyWind = CALM,
    zones: Zones | None = None,
    ground: Ground | None = None,
    triggers: Sequence[Trigger] = (),
) -> MissionPlan:
    """Turn a route into a plan that its kind of vehicle flies from take-off to landing.

    Every leg is written out, the one home too: a return-to-launch item would fly straight home from wherever
    it is reached, at a height of the vehicle's own. A first stop at home is a waypoint like any other.

    Parameters
    ----------
    stops_lon_deg, stops_lat_deg : array_like (n,)
        Stops in flight order, degrees; one or more.
    vehicle : Vehicle
    autopilot : Autopilot or str
        ``"ardupilot"`` or ``"px4"``.
    altitude_m : float
        Of the flight, above home, metres; 0 for what drives or swims. Not read with `ground`, which has its own.
    home : Home, optional
        Default: the first stop, its altitude unknown.
    speed_m_s : float, optional
        Along legs, default the vehicle's cruise speed: over the ground, of a plane and a VTOL through the air.
    hold_s : float or array_like (n,)
        Time at all stops, or at each, seconds. ArduPilot keeps whole seconds: a fraction is rounded up.
    fence_margin_m : float
        Least distance between the flight and its fence, metres; of a plane and a VTOL beside the room that it turns in.
    wind : SteadyWind
        A plane and a VTOL take off and land against it.
    zones : Zones, optional
        What is kept out of: the ways from and to home lead past it, and it is written as exclusion fences. The legs
        between stops are the caller's.
    ground : Ground, optional
        What heights are kept above, at the stops and along every leg, by further waypoints where it takes them.
    triggers : sequence of Trigger
        What is switched on at each stop that is waited at, and off after it.

    Returns
    -------
    MissionPlan
        Its `warnings` are sentences for the person who flies it.

    Raises
    ------
    MissionError
        When a stop, the altitude, speed, hold or margin is out of range, or when there are more items than
        the autopilot stores.
    TerrainError
        When the ground is not known under a leg, or is in its way.
    """
    facts = (autopilot if isinstance(autopilot, Autopilot) else autopilot_named(autopilot)).on_board(vehicle)
    lon, lat = _checked_stops(stops_lon_deg, stops_lat_deg)
    home = _rounded(home or Home(float(lon[0]), float(lat[0])))
    speed = _within("speed", vehicle.cruise_m_s if speed_m_s is None else speed_m_s, MAX_SPEED_M_S, "m/s")
    check_wind(vehicle, wind, speed)
    if ground is not None and not vehicle.flies:
        raise MissionError(f"a {vehicle.kind} stays on the ground: leave --terrain out")
    holds = _checked_holds(hold_s, lon.size, facts)
    check_triggers(triggers, facts)
    if any(one.kind != CAMERA for one in triggers) and not any(holds):
        raise MissionError(
            "no stop is waited at, so there is none to switch a trigger on at: give --hold with --planner monte-carlo, "
            "or leave --trigger out"
        )
    altitude = _checked_altitude(altitude_m if ground is None else ground.height_m, vehicle)

    base = home.place
    layout = lay_out(
        [
            Visit(east, north, altitude, hold)
            for east, north, hold in zip(lon.tolist(), lat.tolist(), holds, strict=True)
        ],
        base,
        vehicle=vehicle,
        altitude_m=altitude,
        speed_m_s=speed,
        wind=wind,
        zones=zones,
        ground=ground,
    )
    items, passing = flight_items(
        layout.visits,
        base,
        vehicle=vehicle,
        autopilot=facts,
        ascent=layout.ascent,
        speed_m_s=speed,
        ends=layout.ends,
        triggers=triggers,
    )
    _check_count(lon.size, len(items), facts, vehicle)
    path_lon, path_lat = np.array(layout.path).T
    fence_margin_m += 2.0 * vehicle.turn_radius_m if vehicle.circles else 0.0
    fence = fence_around(path_lon, path_lat, fence_margin_m, min(MAX_CORNERS, facts.max_fence_points))
    rally_m = altitude if ground is None else height_to_return_at(items, base, ground)
    plan = MissionPlan(
        items=items,
        home=home,
        fences=(fence, *exclusions(zones)),
        circles=exclusion_circles(zones),
        passing=passing,
        rally_points=(RallyPoint(home.lon_deg, home.lat_deg, rally_m),),
        firmware_type=facts.firmware_type,
        vehicle_type=vehicle.mav_type,
        cruise_m_s=speed,
        hover_m_s=speed,
    )
    return replace(plan, warnings=build_warnings(plan, vehicle, facts, float(np.max(hold_s)), altitude, ground))


def flight_time_s(plan: MissionPlan, vehicle: Vehicle, wind: SteadyWind = CALM) -> float:
    """Return the time from take-off to landing of a plan, seconds.

    Of a multirotor without wind equal to `sparsor.vehicle.flight_seconds` of its route: take-off, home to the first
    stop, legs, holds, the way home, landing.

    Raises
    ------
    MissionError
        When the plan has no stop.
    """
    if not plan.stops:
        raise MissionError("the plan has no waypoint: there is nothing to time")
    return time_plan(plan, vehicle, wind).seconds


def max_stops(autopilot: Autopilot, kind: str = "quad") -> int:
    """Return how many stops fit beside what a kind of vehicle needs: take-off, speed, way home and landing."""
    return autopilot.max_items - BESIDE_STOPS[kind] - int(autopilot.home_is_item_0)


def _checked_stops(lon_deg: ArrayLike, lat_deg: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    lon = np.asarray(lon_deg, dtype=np.float64)
    lat = np.asarray(lat_deg, dtype=np.float64)
    if lon.ndim != 1 or lon.shape != lat.shape or lon.size == 0:
        raise MissionError(
            f"stops of shapes {lon.shape} and {lat.shape}; give as many longitudes as latitudes, one or more"
        )
    wrong = np.flatnonzero(~((np.abs(lon) <= 180) & (np.abs(lat) <= 90)))
    if wrong.size:
        first = int(wrong[0])
        raise MissionError(
            f"stop {first + 1} lies at longitude {lon[first]:g}, latitude {lat[first]:g}; "
            "allowed are -180..180 and -90..90 degrees"
        )
    return lon.round(DECIMALS), lat.round(DECIMALS)


def _rounded(home: Home) -> Home:
    return replace(home, lon_deg=round(home.lon_deg, DECIMALS), lat_deg=round(home.lat_deg, DECIMALS))


def _within(what: str, value: float, most: float, unit: str) -> float:
    if not (math.isfinite(value) and 0 < value <= most):
        raise MissionError(f"a flight {what} of {value:g} {unit}; it has to be above 0 and at most {most:g}")
    return float(value)


def _checked_altitude(altitude_m: float, vehicle: Vehicle) -> float:
    if vehicle.flies:
        return _within("altitude", altitude_m, MAX_ALTITUDE_M, "m above home")
    if altitude_m != 0:
        raise MissionError(f"an altitude of {altitude_m:g} m for a {vehicle.kind}, which stays down; give 0")
    return 0.0


def _checked_holds(hold_s: ArrayLike, stops: int, autopilot: Autopilot) -> list[float]:
    given = np.asarray(hold_s, dtype=np.float64)
    if given.shape not in ((), (stops,)):
        raise MissionError(f"holds of shape {given.shape} for {stops} stops; give one for all, or one for each")
    for hold in given.ravel():
        if not (math.isfinite(hold) and 0 <= hold <= autopilot.max_hold_s):
            raise MissionError(f"a hold of {hold:g} s; allowed are 0..{autopilot.max_hold_s} seconds at each stop")
    return [autopilot.written_hold_s(float(hold)) for hold in np.broadcast_to(given, (stops,))]


def _check_count(stops: int, items: int, autopilot: Autopilot, vehicle: Vehicle) -> None:
    if items + int(autopilot.home_is_item_0) <= autopilot.max_items:
        return
    beside = items - stops - BESIDE_STOPS[vehicle.kind]
    also = f", with {beside} items beside them (past keep-outs, over terrain, triggers)," if beside else ""
    eased = "; a larger --terrain-tolerance needs fewer of those" if beside else ""
    raise MissionError(
        f"{stops} stops{also} are too many for one mission: {autopilot.title} stores {autopilot.max_items} items, "
        f"which leaves {max_stops(autopilot, vehicle.kind)} stops; plan fewer or split the area{eased}"
    )
