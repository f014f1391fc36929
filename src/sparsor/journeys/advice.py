"""Sentences about a planned mission, for the person who asked for it."""

from __future__ import annotations

from math import floor
from typing import TYPE_CHECKING

import numpy as np

from sparsor.geodesy.lengths import distance_m
from sparsor.vehicle import flight_seconds

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sparsor.journeys.planning import PlannedMission
    from sparsor.journeys.sorties import Sorties

_HARDLY_BETTER = 0.9
_FAR_HOME = 3.0  # diagonals of the box


def advice(mission: PlannedMission) -> tuple[str, ...]:
    """Return what has to be said about a mission: what would make it fly, or worth flying, and likely slips."""
    said = (_what_would_fly(mission), _what_would_help(mission), _far_home(mission))
    return tuple(sentence for sentence in said if sentence)


def said_of(mission: PlannedMission, whole: PlannedMission) -> str:
    """Return what has to be said about sorties, beside the same mission as one flight.

    Parameters
    ----------
    mission, whole : PlannedMission
    """
    cut = mission.sorties
    assert cut is not None
    said = [*_dropped(mission), _cut_into(mission)]
    if cut.dropped.size or mission.expected_relative_error != whole.expected_relative_error:
        said.append(
            f"The expected error is {mission.expected_relative_error:.3f}, that of the legs that are flown; the whole "
            f"route in one flight would have {whole.expected_relative_error:.3f}."
        )
    return " ".join(said)


def _dropped(mission: PlannedMission) -> tuple[str, ...]:
    assert mission.sorties is not None
    count, all_of_them = mission.sorties.dropped.size, mission.candidate.stops.size
    if not count:
        return ()
    are = "stop is" if count == 1 else "stops are"
    return (f"{count} of {all_of_them} {are} beyond reach of one battery and left out (--drop-unreachable).",)


def _cut_into(mission: PlannedMission) -> str:
    cut = mission.sorties
    assert cut is not None
    usable_min = mission.usable_s / 60
    if cut.apart_m is not None:
        level = ", if the homes lie level" if mission.vehicle.flies else ""
        return (
            f"{_at_once(cut)}, none above {max(time.used_s for time in cut.times) / 60:.1f} of {usable_min:.1f} min. "
            f"{' '.join(_each_vehicle(mission, cut))} See whether these places can be used. Planned paths are never "
            f"nearer than {_tenth_down(cut.apart_m)} m, whenever each starts{level}; what vehicles drift off their "
            "paths comes off that."
        )
    alone = "One vehicle flies it all. " if mission.specification.flight.vehicles > 1 else ""
    if len(cut.plans) > 1:
        return alone + (
            f"One battery is not enough for the route: it is cut into {len(cut.plans)} sorties, "
            f"{sum(time.seconds for time in cut.times) / 60:.0f} min in all, none above "
            f"{max(time.used_s for time in cut.times) / 60:.1f} of {usable_min:.1f} min."
        )
    used = f"{cut.times[0].used_s / 60:.1f} of {usable_min:.1f} min"
    if alone:
        return f"{alone}It takes {used}."
    if cut.dropped.size:
        return f"The others are one flight of {used}."
    return f"The route as it was found takes more than one battery; its stops in another order take {used}."


def _at_once(cut: Sorties) -> str:
    """Return how many fly at once, and how often."""
    if max(cut.rounds) == 1:
        return f"{len(cut.plans)} vehicles at once"
    return (
        f"One battery each is not enough: {max(cut.vehicles)} vehicles at once, {len(cut.plans)} flights in "
        f"{max(cut.rounds)} rounds (nobody takes off before all of the round before have landed)"
    )


def _each_vehicle(mission: PlannedMission, cut: Sorties) -> Iterator[str]:
    """Yield where each vehicle stands, how high it flies, and what."""
    each = list(zip(cut.vehicles, cut.heights_m, cut.plans, mission.plan_files, strict=True))
    for number in sorted({*cut.vehicles}):
        height_m, plan = next((height_m, plan) for its, height_m, plan, _ in each if its == number)
        files = ", ".join(file for its, _, _, file in each if its == number)
        up = f", at {height_m:g} m" if mission.vehicle.flies else ""
        yield f"Vehicle {number} from {plan.home.lon_deg:.5f} {plan.home.lat_deg:.5f}{up}: {files}."


def _tenth_down(metres: float) -> str:
    return f"{floor(metres * 10 + 1e-3) / 10:.1f}"


def _what_would_fly(mission: PlannedMission) -> str:
    if mission.flyable:
        return ""
    start = (
        f"A planning study, not a flight: it takes {mission.used_s / 60:.0f} min {_of_what(mission)}, the "
        f"{mission.vehicle.name} has {mission.usable_s / 60:.0f} min less its reserve. "
    )
    fixed_s = _seconds_at_any_size(mission)
    left_s = mission.usable_s - fixed_s
    if left_s <= 0:
        return start + (
            "Climbing, dwelling, landing and the way from and to home alone take longer: shorten --hold, take off "
            "nearer, or take a vehicle of longer endurance (--vehicle FILE.toml)."
        )
    shrink = left_s / max(mission.used_s - fixed_s, 1.0)
    box = mission.place.grid.box
    return start + (
        f"The same route over a box of {_down(shrink * box.east_m)} x {_down(shrink * box.north_m)} km would fit, or "
        f"a budget of {floor(mission.usable_s / 60)}min where a route that short exists, or a vehicle of longer "
        "endurance (--vehicle FILE.toml)."
    )


def _of_what(mission: PlannedMission) -> str:
    same = mission.used_s == mission.flight_time_s
    place = "in the air" if mission.vehicle.flies else "under way"
    return place if same else f"of the endurance at cruise ({mission.flight_time_s / 60:.0f} min {place})"


def _seconds_at_any_size(mission: PlannedMission) -> float:
    """Return the part of the flight that a smaller box would not shorten."""
    flight, plan = mission.specification.flight, mission.plan
    # A home of its own stays where it is; one at the first stop comes nearer with the rest.
    transit_m = mission.flown_length_m - mission.path_length_m if flight.given_homes else 0.0
    beside_s = mission.used_s - mission.flight_time_s  # hovering takes more out of the battery than cruising
    return beside_s + flight_seconds(
        mission.vehicle,
        path_length_m=0.0,
        transit_m=transit_m,
        stops=len(plan.stops),
        hold_s=[stop.hold_s for stop in plan.stops],
        altitude_m=flight.altitude_m,
        speed_m_s=flight.speed_m_s,
    )


def _down(metres: float) -> str:
    """Return kilometres with two digits, rounded down: what is advised has to fit."""
    km = metres / 1000
    step = 10.0 ** (floor(np.log10(km)) - 1)
    return f"{floor(km / step) * step:.3g}"


def _what_would_help(mission: PlannedMission) -> str:
    error = mission.expected_relative_error
    if error < _HARDLY_BETTER:
        return ""
    compared = "hardly better" if error <= 1.0 else "worse"
    return (
        f"The expected error, {error:.2f} of the map's contrast, is {compared} than knowing the map's mean (1): allow "
        "a larger --budget, or learn the prior from more or larger fields."
    )


def _far_home(mission: PlannedMission) -> str:
    box, home = mission.place.grid.box, mission.plan.home
    away_m = float(distance_m(home.lon_deg, home.lat_deg, box.centre_lon_deg, box.centre_lat_deg))
    if away_m < _FAR_HOME * np.hypot(box.east_m, box.north_m):
        return ""
    return (
        f"Home, {home.lon_deg:g} {home.lat_deg:g}, lies {away_m / 1000:.0f} km from the middle of the box: are "
        "longitude and latitude swapped? The order is longitude, latitude."
    )
