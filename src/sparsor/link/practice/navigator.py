"""Following an uploaded mission, item by item.

Flown: take-offs, waypoints, loiters, delays, landings, return to launch, jumps and changes of the ground speed. A
loiter of some turns is waited out at its centre, as long as ArduPilot circles (CIRCLE_RATE). A leg between two heights
is a straight line, on which a multirotor goes no faster than it climbs or sinks. From the ground, a
waypoint begins with a vertical take-off to its height, as in PX4. Everything else (CONDITION_*, cameras, servos, a
delay until a time of the day) is passed over at once.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sparsor.link.practice.motion import Aim
from sparsor.mission.items import (
    DO_CHANGE_SPEED,
    FLOWN_TO,
    FRAME_GLOBAL,
    LANDINGS,
    NAV_DELAY,
    NAV_LOITER_TIME,
    NAV_LOITER_TURNS,
    NAV_LOITER_UNLIM,
    NAV_RETURN_TO_LAUNCH,
    NAV_WAYPOINT,
    TAKE_OFFS,
)

if TYPE_CHECKING:
    from sparsor.link.practice.motion import Motion
    from sparsor.link.practice.place import FlatMap
    from sparsor.link.practice.storage import StoredItem
    from sparsor.vehicle import Vehicle

DO_JUMP = 177
AIRSPEED, GROUND_SPEED = 0, 1  # SPEED_TYPE; the others are of climbing and sinking
TURN_S = 360.0 / 20.0
LEAST_TAKE_OFF_M = 2.5  # PX4's MIS_TAKEOFF_ALT
STRAIGHT_RAD = math.radians(15.0)
HEIGHT_M = 1.0


class Navigator:
    """Where the mission wants the vehicle, from one moment to the next.

    Parameters
    ----------
    items : list of StoredItem
        As stored, ArduPilot's home among them.
    first : int
        Sequence number of the first item to fly: 1 where item 0 is home.
    place : FlatMap
        Round home.
    home_amsl_m : float
        For items above sea level.
    vehicle : Vehicle
    radius_in_item : bool
        Whether parameter 2 of a waypoint is its radius.
    """

    def __init__(
        self,
        items: list[StoredItem],
        first: int,
        place: FlatMap,
        home_amsl_m: float,
        vehicle: Vehicle,
        *,
        radius_in_item: bool,
    ) -> None:
        self.items = items
        self.current = first
        self.speed_m_s = vehicle.cruise_m_s
        self.returning = False
        """Whether the mission has handed over to return-to-launch."""
        self._place = place
        self._home_amsl_m = home_amsl_m
        self._vehicle = vehicle
        self._radius_in_item = radius_in_item
        self._arrived_s: float | None = None
        self._jumps: dict[int, int] = {}
        self._start: tuple[float, float] | None = None
        self._start_up_m = 0.0
        self._lift_m: float | None = None

    @property
    def finished(self) -> bool:
        """Whether there is nothing left to fly."""
        return self.current >= len(self.items)

    def jump_to(self, seq: int) -> None:
        """Go on with another item."""
        self.current = seq
        self._arrived_s = None
        self._start = None

    def step(self, motion: Motion, now_s: float, *, landed: bool) -> tuple[Aim, list[int]]:
        """Return where to fly now, and the sequence numbers reached since the last step."""
        reached: list[int] = []
        for _ in range(2 * len(self.items) + 2):  # a mission of nothing but jumps ends nowhere
            if self.finished:
                break
            item = self.items[self.current]
            if item.command == NAV_RETURN_TO_LAUNCH:
                self.returning = True
                break
            if item.command not in FLOWN_TO and item.command != NAV_DELAY:
                self._do(item)
                continue
            if self._start is None:
                self._start, self._start_up_m = (motion.east_m, motion.north_m), motion.up_m
                self._lift_m = self._height_to_lift_to(item) if landed and self._vehicle.flies else None
            if self._lift_m is not None and motion.up_m < self._lift_m - 0.5 * HEIGHT_M:
                return Aim(*self._start, self._lift_m, self.speed_m_s), reached
            self._lift_m = None
            if not self._done(item, motion, now_s, landed=landed):
                return self._aim(item, motion), reached
            reached.append(self.current)
            self.jump_to(self.current + 1)
        return motion.here(), reached

    def target(self, seq: int) -> tuple[float, float, float] | None:
        """Return metres east, north and up of an item, None for one without a position."""
        return target_of(self.items[seq], self._place, self._home_amsl_m)

    def radius_m(self, item: StoredItem) -> float:
        """Return how near to an item counts as reached."""
        own = item.params[1] if self._radius_in_item and item.command == NAV_WAYPOINT else 0.0
        return own if own > 0 else self._vehicle.acceptance_radius_m

    def _do(self, item: StoredItem) -> None:
        seq = self.current
        self.jump_to(seq + 1)
        if item.command == DO_CHANGE_SPEED and item.params[0] in (AIRSPEED, GROUND_SPEED) and item.params[1] > 0:
            self.speed_m_s = item.params[1]
        if item.command == DO_JUMP and 0 <= int(item.params[0]) < len(self.items):
            done = self._jumps.get(seq, 0)
            if item.params[1] < 0 or done < item.params[1]:
                self._jumps[seq] = done + 1
                self.jump_to(int(item.params[0]))

    def _height_to_lift_to(self, item: StoredItem) -> float | None:
        target = self.target(self.current)
        if target is None or item.command in TAKE_OFFS | LANDINGS:
            return None
        return max(target[2], LEAST_TAKE_OFF_M)

    def _aim(self, item: StoredItem, motion: Motion) -> Aim:
        target = self.target(self.current)
        assert self._start is not None  # set by step
        if item.command in TAKE_OFFS:
            up = target[2] if target else item.z
            return Aim(*self._start, up, self.speed_m_s)
        if target is None:
            target = (*self._start, motion.up_m)
        if item.command in LANDINGS:
            over = motion.distance_m(*target[:2]) < HEIGHT_M and motion.ground_speed_m_s < 0.5
            self._arrived_s = 0.0 if over or self._arrived_s is not None else None
            return Aim(target[0], target[1], motion.up_m, self.speed_m_s, landing=self._arrived_s is not None)
        up_m, most_m_s = self._on_the_line(target, motion)
        passing_m_s = min(self._passing_m_s(item, target, motion), most_m_s)
        return Aim(*target[:2], up_m, most_m_s, passing_m_s)

    def _on_the_line(self, target: tuple[float, float, float], motion: Motion) -> tuple[float, float]:
        """Return the height on the straight line to a target, and the speed at which a multirotor keeps to it."""
        assert self._start is not None
        length_m = math.dist(self._start, target[:2])
        rise_m = target[2] - self._start_up_m
        if length_m < HEIGHT_M or abs(rise_m) < HEIGHT_M:
            return target[2], self.speed_m_s
        share = 1.0 - min(motion.distance_m(*target[:2]) / length_m, 1.0)
        rate_m_s = self._vehicle.climb_m_s if rise_m > 0 else self._vehicle.descent_m_s
        keeps_m_s = self.speed_m_s if self._vehicle.circles else rate_m_s * length_m / abs(rise_m)
        return self._start_up_m + share * rise_m, min(self.speed_m_s, keeps_m_s)

    def _done(self, item: StoredItem, motion: Motion, now_s: float, *, landed: bool) -> bool:
        if item.command in LANDINGS:
            return landed and self._arrived_s is not None
        target = self.target(self.current)
        if item.command in TAKE_OFFS:
            return motion.up_m >= (target[2] if target else item.z) - 0.5 * HEIGHT_M
        if item.command == NAV_LOITER_UNLIM:
            return False
        if self._arrived_s is None and self._near(item, target, motion):
            self._arrived_s = now_s
        return self._arrived_s is not None and now_s - self._arrived_s >= waits_s(item)

    def _near(self, item: StoredItem, target: tuple[float, float, float] | None, motion: Motion) -> bool:
        if target is None or item.command == NAV_DELAY:
            return True
        radius = self.radius_m(item)
        return motion.distance_m(*target[:2]) <= radius and abs(motion.up_m - target[2]) <= max(radius, HEIGHT_M)

    def _passing_m_s(self, item: StoredItem, target: tuple[float, float, float], motion: Motion) -> float:
        """Return the speed at a waypoint: none to wait there, all of it straight on, little round a corner."""
        after = next((seq for seq in range(self.current + 1, len(self.items)) if self.target(seq)), None)
        if waits_s(item) > 0 or after is None or item.command != NAV_WAYPOINT:
            return 0.0
        following = self.target(after)
        if following is None or self.items[after].command != NAV_WAYPOINT:
            return 0.0
        if math.dist(following[:2], target[:2]) < HEIGHT_M:  # it waits in the same place
            return 0.0
        course = math.atan2(target[0] - motion.east_m, target[1] - motion.north_m)
        turn = math.atan2(following[0] - target[0], following[1] - target[1]) - course
        if abs((turn + math.pi) % (2 * math.pi) - math.pi) < STRAIGHT_RAD:
            return self.speed_m_s
        return min(self.speed_m_s, math.sqrt(self._vehicle.acceleration_m_s2 * self.radius_m(item)))


def target_of(item: StoredItem, place: FlatMap, home_amsl_m: float) -> tuple[float, float, float] | None:
    """Return metres east, north and above home of an item, None for one that is not flown to."""
    if item.command not in FLOWN_TO or (item.x, item.y) == (0, 0):
        return None
    up = item.z - home_amsl_m if item.frame == FRAME_GLOBAL else item.z
    return (*place.metres(item.lon_deg, item.lat_deg), up)


def waits_s(item: StoredItem) -> float:
    """Return how long the vehicle stays at an item, seconds."""
    first = item.params[0]
    if not first > 0:
        return 0.0
    if item.command == NAV_LOITER_TURNS:
        return first * TURN_S
    return first if item.command in (NAV_WAYPOINT, NAV_LOITER_TIME, NAV_DELAY) else 0.0
