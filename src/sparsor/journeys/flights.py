"""What builds plans over some or all of a planned route's stops, from one of the mission's homes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.geodesy.lengths import distance_m
from sparsor.mission import Home, MissionPlan, build_mission, time_plan
from sparsor.mission.triggers import CAMERA

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design import Candidate
    from sparsor.journeys.preparing import Prepared
    from sparsor.mission import FlightTime
    from sparsor.mission.specification import MissionSpecification


@dataclass(frozen=True)
class Flights:
    """A route's stops, and where flights over them may begin.

    Parameters
    ----------
    spec : MissionSpecification
    prepared : Prepared
    candidate : Candidate
        Its route.
    homes : tuple of Home
    """

    spec: MissionSpecification
    prepared: Prepared
    candidate: Candidate
    homes: tuple[Home, ...]

    @property
    def stops(self) -> NDArray[np.int64]:
        """Cells in the order of the route, (n,)."""
        return self.candidate.stops

    @property
    def holds_s(self) -> NDArray[np.float64]:
        """The hold at each stop, seconds, (n,)."""
        hold_s, dwells = self.spec.flight.hold_s, self.candidate.dwells
        if dwells is None:
            return np.full(self.stops.size, hold_s)
        return np.asarray(self.prepared.autopilot.written_hold_s(hold_s) * dwells, dtype=np.float64)

    def build(self, order: NDArray[np.int64], home: Home | None = None, altitude_m: float | None = None) -> MissionPlan:
        """Return the plan over some of the stops, by their places on the route.

        Parameters
        ----------
        order : array of int64
        home : Home, optional
            Default: the first of the homes.
        altitude_m : float, optional
            Default: the mission's.
        """
        flight, prepared = self.spec.flight, self.prepared
        lon, lat = prepared.place.grid.centres_deg(self.stops[order])
        # One of several flights may dwell nowhere, which of the whole route is an error.
        switches = bool(self.holds_s[order].any()) or not self.holds_s.any()
        return build_mission(
            lon,
            lat,
            vehicle=prepared.vehicle,
            autopilot=prepared.autopilot,
            altitude_m=flight.altitude_m if altitude_m is None else altitude_m,
            home=self.homes[0] if home is None else home,
            speed_m_s=flight.speed_m_s,
            hold_s=self.holds_s[order],
            fence_margin_m=flight.fence_margin_m,
            wind=prepared.wind,
            zones=prepared.place.zones,
            ground=prepared.ground,
            triggers=[one for one in flight.triggers if one.kind == CAMERA or switches],
        )

    def time(self, plan: MissionPlan) -> FlightTime:
        """Return how long a plan takes, in the wind that is planned for."""
        return time_plan(plan, self.prepared.vehicle, self.prepared.wind)

    def tour(self, order: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the cells of a flight in order; one that follows itself is dwelt at, see `Task.readings`."""
        dwells = self.candidate.dwells
        return np.repeat(self.stops[order], 1 if dwells is None else dwells[order] + 1)


def whole_flight(spec: MissionSpecification, prepared: Prepared, candidate: Candidate) -> tuple[Flights, MissionPlan]:
    """Return a route as one flight from the home that makes it shortest, begun at the end nearer that home.

    The flights' candidate is turned accordingly; that home is the first of the homes.
    """
    homes = _homes(spec, prepared, candidate)
    ways = []
    for place, home in enumerate(homes):
        turned = _nearer_end_first(home, prepared, candidate) if spec.flight.given_homes else candidate
        others = (home, *homes[:place], *homes[place + 1 :])
        flights = Flights(spec, prepared, turned, others)
        plan = flights.build(np.arange(turned.stops.size))
        ways.append((flights.time(plan).seconds if len(homes) > 1 else 0.0, place, flights, plan))
    _, _, flights, plan = min(ways, key=lambda way: way[:2])
    return flights, plan


def _homes(spec: MissionSpecification, prepared: Prepared, candidate: Candidate) -> tuple[Home, ...]:
    """Return the homes that were given, else the route's first stop."""
    lon, lat = prepared.place.grid.centres_deg(candidate.stops[:1])
    places = spec.flight.given_homes or ((float(lon[0]), float(lat[0])),)
    return tuple(_home(spec, prepared, place) for place in places)


def _home(spec: MissionSpecification, prepared: Prepared, place: tuple[float, float]) -> Home:
    altitude = spec.flight.home_altitude_m
    if altitude is None and prepared.ground is not None:
        altitude = round(prepared.ground.home_m(place), 1)
    return Home(*place, altitude or 0.0, altitude_known=altitude is not None)


def _nearer_end_first(home: Home, prepared: Prepared, candidate: Candidate) -> Candidate:
    """Return the candidate with its path turned so that it begins at the end nearer home."""
    ends = prepared.place.grid.centres_deg(candidate.stops[[0, -1]])
    first_m, last_m = distance_m(home.lon_deg, home.lat_deg, *ends)
    if last_m >= first_m:
        return candidate
    dwells = None if candidate.dwells is None else candidate.dwells[::-1].copy()
    return replace(candidate, stops=candidate.stops[::-1].copy(), dwells=dwells)
