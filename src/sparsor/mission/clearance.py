"""How far above the ground a plan flies, ours or anybody's, leg by leg."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from sparsor.geodesy.lengths import line_deg
from sparsor.mission.fault import Fault
from sparsor.mission.items import (
    DO_LAND_START,
    FLOWN_TO,
    FRAME_GLOBAL,
    FRAME_RELATIVE,
    FRAME_TERRAIN,
    LANDINGS,
    NAV_LOITER_TO_ALT,
    NAV_RETURN_TO_LAUNCH,
    NAV_TAKEOFF,
    TAKE_OFFS,
)
from sparsor.vehicle import approach_up_m

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from sparsor.geodesy.terrain import Terrain
    from sparsor.mission.following import Ground
    from sparsor.mission.items import MissionItem
    from sparsor.mission.plan import MissionPlan
    from sparsor.mission.sequences import Ends, Point
    from sparsor.vehicle import Vehicle

# From the ground and back to it a flight is as high above home as it is far on: half of that has to be free, but for
# what an elevation model does not know of the ground round home.
FREE_SHARE = 0.5
NEAR_HOME_M = 2.0
ROUNDING_M = 0.05  # heights are stored in centimetres, positions to 1e-7 degrees
WHOLE_FRAMES = {5: FRAME_GLOBAL, 6: FRAME_RELATIVE, 11: FRAME_TERRAIN}
PLANE = 1
Kind = Literal["level", "ends"]


@dataclass(frozen=True, eq=False)
class Leg:
    """A leg of a flight over the ground.

    Parameters
    ----------
    name : str
        "from item 3 to item 4".
    kind : {"level", "ends"}
        "ends" where it climbs out of home or comes in to land.
    to : tuple of float
        Longitude and latitude of its end.
    along_m : array of float64 (n,)
        From its beginning.
    lon_deg, lat_deg : arrays of float64 (n,)
    base_m : float
        Where it takes off or lands.
    flown_m, ground_m, highest_m : arrays of float64 (n,)
        Above the elevation model's zero: the straight line between its ends, the ground below, the highest ground near.
        NaN and infinite where the ground is not known.
    """

    name: str
    kind: Kind
    to: Point
    along_m: NDArray[np.float64]
    lon_deg: NDArray[np.float64]
    lat_deg: NDArray[np.float64]
    base_m: float
    flown_m: NDArray[np.float64]
    ground_m: NDArray[np.float64]
    highest_m: NDArray[np.float64]

    @property
    def least_m(self) -> float:
        """The least height above the highest ground near; minus infinity where some ground is not known."""
        return float((self.flown_m - self.highest_m).min())


def legs_over(plan: MissionPlan, terrain: Terrain, home_m: float, reach_m: float = 0.0) -> Iterator[Leg]:
    """Yield the legs of a plan over the ground, in flight order.

    Straight lines in height as in place. A vertical take-off and a vertical landing are no legs, a return to launch
    none either: its height is the vehicle's own. Nor is a leg to an item above terrain, which the autopilot follows
    by data of its own. Jumps are not followed.

    Parameters
    ----------
    plan : MissionPlan
    terrain : Terrain
    home_m : float
        Height of the ground at home.
    reach_m : float
        How far beside its legs the vehicle may come.

    Notes
    -----
    The highest ground near is that within the reach and half a step, so that nothing between points is missed. Plans
    are made with more (`following.heights_along`): wherever the points of a leg lie, they hold here.
    """
    at, up_m, name = plan.home.place, home_m, "home"
    kind: Kind = "level"
    for number, item in enumerate(plan.items, start=1):
        if item.command == NAV_RETURN_TO_LAUNCH:
            return
        if item.command == DO_LAND_START:
            kind = "ends"
        if item.command not in FLOWN_TO:
            continue
        to = (item.lon_deg, item.lat_deg) if item.has_position and item.params[4:6] != (0.0, 0.0) else at
        runs = plan.vehicle_type == PLANE and item.command == NAV_TAKEOFF
        if item.command in TAKE_OFFS and not runs:
            at, up_m, name = to, _height_m(item, home_m, terrain, up_m), f"item {number}"
            continue
        sinks = plan.vehicle_type == PLANE and item.command in LANDINGS
        if item.command == NAV_LOITER_TO_ALT or sinks:
            kind = "ends"  # the way in
        end_m = _height_m(item, home_m, terrain, up_m)
        if item.command in LANDINGS:
            end_m = _landing_m(plan, terrain, home_m) if sinks else up_m
        if _frame(item) != FRAME_TERRAIN and (to != at or end_m != up_m):
            base_m = home_m if runs or kind == "level" else _landing_m(plan, terrain, home_m)
            named, ends = f"from {name} to item {number}", "ends" if runs else kind
            yield _leg(named, ends, at, to, (up_m, end_m), terrain, reach_m, base_m)
        at, up_m, name = to, end_m, f"item {number}"


def terrain_faults(
    plan: MissionPlan, terrain: Terrain, least_m: float, *, home_m: float, reach_m: float = 0.0, ceiling_m: float
) -> Iterator[Fault]:
    """Yield what is wrong between a plan and the ground.

    Parameters
    ----------
    plan : MissionPlan
    terrain : Terrain
    least_m : float
        Least height above the ground along legs.
    home_m : float
        Height of the ground at home.
    reach_m : float
        How far beside its legs the vehicle may come.
    ceiling_m : float
        Above the ground; a flight beyond it is a warning.
    """
    highest_m = -math.inf
    for leg in legs_over(plan, terrain, home_m, reach_m):
        unknown = ~np.isfinite(leg.highest_m) | np.isnan(leg.ground_m)
        if unknown.any():
            first = int(np.argmax(unknown))
            yield Fault(
                f"The ground under the leg {leg.name} is not known to '{terrain.path.name}', at "
                f"{leg.lon_deg[first]:.5f} {leg.lat_deg[first]:.5f}.",
                wrong=True,
            )
            continue
        highest_m = max(highest_m, float((leg.flown_m - leg.ground_m).max()))
        if leg.kind == "ends":
            short = _short_m(leg)
            worst = int(np.argmax(short))
            if short[worst] > ROUNDING_M:
                yield Fault(
                    f"The leg {leg.name}, which climbs out or comes in, passes "
                    f"{leg.flown_m[worst] - leg.ground_m[worst]:.0f} m above the ground at {leg.lon_deg[worst]:.5f} "
                    f"{leg.lat_deg[worst]:.5f}: less than half of its height above where it takes off or lands.",
                    wrong=True,
                )
        elif leg.least_m < least_m - ROUNDING_M:
            worst = int(np.argmin(leg.flown_m - leg.highest_m))
            does = "meets the ground" if leg.least_m <= 0 else f"comes within {leg.least_m:.0f} m of the ground"
            yield Fault(
                f"The leg {leg.name} {does}, at {leg.lon_deg[worst]:.5f} {leg.lat_deg[worst]:.5f}; {least_m:g} m "
                "above it are the least asked for.",
                wrong=True,
            )
    if any(_frame(item) == FRAME_TERRAIN for item in plan.items if item.command in FLOWN_TO):
        yield Fault("Legs to items above terrain (frame 10) are not checked: the autopilot has ground data of its own.")
    if highest_m > ceiling_m + ROUNDING_M:
        yield Fault(f"The flight is up to {highest_m:.0f} m above the ground, beyond the ceiling of {ceiling_m:g} m.")


def pattern_fault(ends: Ends, home: Point, vehicle: Vehicle, take_off_m: float, ground: Ground, home_m: float) -> str:
    """Say what ground is in the way of the climb out, the circle or the last approach of what circles; "" for none."""
    terrain, low_m = ground.terrain, approach_up_m(take_off_m)
    over_circle_m = float(terrain.highest_m(*ends.circle, vehicle.turn_radius_m)) - home_m
    if not over_circle_m <= low_m - min(ground.least_m, FREE_SHARE * low_m):
        return f"the circle before the landing, {low_m:g} m above home, is over ground {over_circle_m:.0f} m above it"
    sinks = (low_m, low_m) if vehicle.lifts else (low_m, 0.0)
    legs = [("approach", ends.circle, home, sinks)]
    if not vehicle.lifts:
        legs.append(("climb out", home, ends.climb_out, (0.0, take_off_m)))
    for what, start, end, (from_m, to_m) in legs:
        leg = _leg(what, "ends", start, end, (home_m + from_m, home_m + to_m), terrain, 0.0, home_m)
        if not _short_m(leg).max() <= 0:
            return f"the ground under the {what} is not known, or rises to more than half of its height above home"
    return ""


def height_to_return_at(items: Sequence[MissionItem], home: Point, ground: Ground) -> float:
    """Return the height above home, whole metres, at which the straight way home from anywhere on a flight is free."""
    home_m = ground.home_m(home)
    return float(
        math.ceil(max(highest_way_home_m(items, home, ground.terrain, home_m) + ground.least_m, ground.height_m))
    )


def highest_way_home_m(items: Sequence[MissionItem], home: Point, terrain: Terrain, home_m: float) -> float:
    """Return how far above home the ground rises at most between the places of a flight and home, where it is known."""
    places = {(item.lon_deg, item.lat_deg) for item in items if item.has_position}
    highest_m = home_m
    for place in sorted(places):
        _, lon, lat = line_deg(place, home, terrain.step_m)
        peaks = terrain.highest_m(lon, lat, terrain.step_m / 2)
        highest_m = max(highest_m, float(peaks[np.isfinite(peaks)].max(initial=-math.inf)))
    return highest_m - home_m


def _short_m(leg: Leg) -> NDArray[np.float64]:
    """Return how much higher the ground under a way up or down is than what has to be free, metres."""
    free_to = leg.base_m + FREE_SHARE * (leg.flown_m - leg.base_m) + NEAR_HOME_M
    return np.asarray(leg.ground_m - free_to)


def _landing_m(plan: MissionPlan, terrain: Terrain, home_m: float) -> float:
    """Return the height of the ground where a plan lands; home's where that is not said or not known."""
    lands = [item for item in plan.items if item.command in LANDINGS and item.has_position]
    found = float(terrain.ground_m(lands[-1].lon_deg, lands[-1].lat_deg)) if lands else math.nan
    return home_m if math.isnan(found) else found


def _leg(
    name: str,
    kind: Kind,
    start: Point,
    end: Point,
    heights_m: tuple[float, float],
    terrain: Terrain,
    reach_m: float,
    base_m: float,
) -> Leg:
    along, lon, lat = line_deg(start, end, terrain.step_m)
    share = along / along[-1] if along[-1] > 0 else np.linspace(0.0, 1.0, along.size)
    flown = heights_m[0] + share * (heights_m[1] - heights_m[0])
    return Leg(
        name,
        kind,
        end,
        along,
        lon,
        lat,
        base_m,
        flown,
        terrain.ground_m(lon, lat),
        terrain.highest_m(lon, lat, reach_m + terrain.step_m / 2),
    )


def _height_m(item: MissionItem, home_m: float, terrain: Terrain, before_m: float) -> float:
    """Return the height of an item above the elevation model's zero; as before where it gives none."""
    if math.isnan(item.altitude_m):
        return before_m
    frame = _frame(item)
    if frame == FRAME_TERRAIN:
        below = float(terrain.ground_m(item.lon_deg, item.lat_deg))
        return before_m if math.isnan(below) else below + item.altitude_m
    return item.altitude_m + (home_m if frame == FRAME_RELATIVE else 0.0)


def _frame(item: MissionItem) -> int:
    return WHOLE_FRAMES.get(item.frame, item.frame)
