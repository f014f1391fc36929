"""A plan in words, for `sparsor inspect`."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.geodesy.lengths import distance_m, path_length_m
from sparsor.mission.faults import plan_faults
from sparsor.mission.items import DO_CHANGE_SPEED, FRAME_GLOBAL, FRAME_RELATIVE, FRAME_TERRAIN

if TYPE_CHECKING:
    from sparsor.mission.items import MissionItem
    from sparsor.mission.plan import MissionPlan

VEHICLES = {
    1: "plane", 2: "quadrotor", 3: "coaxial rotor", 4: "helicopter", 10: "rover", 11: "boat", 12: "submarine",
    13: "hexarotor", 14: "octorotor", 15: "tricopter",
} | dict.fromkeys(range(19, 26), "VTOL")  # fmt: skip
ABOVE = {FRAME_RELATIVE: "home", FRAME_GLOBAL: "sea level", FRAME_TERRAIN: "terrain"}


@dataclass(frozen=True)
class PlanDescription:
    """What a plan holds, in SI units; `lines` says it in words.

    Parameters
    ----------
    autopilot, vehicle : str
    home_lon_deg, home_lat_deg : float
    home_alt_amsl_m : float or None
        None when it is not known (0 in the file).
    items : dict of str to int
        Number of items by command name.
    first_item, last_item : str
        Command names.
    stops : int
    path_length_m : float
        Over the stops; geodesic, as the distances below.
    home_to_first_m, last_to_home_m : float
        0 when there is no stop.
    hold_s : float
        All holds together.
    altitudes_m : dict of str to list
        Lowest and highest stop, by what they are above.
    speeds_m_s : list of float
        Ground and air speeds that items ask for, in order.
    fence_points, fence_circles, rally_points : int
    complex_items : dict of str to int
        Patterns of QGroundControl and the flight items that the file holds for them.
    warnings : list of str
        What making or reading the plan had to say.
    faults : list of str
        What is wrong with it, in sentences.
    """

    autopilot: str
    vehicle: str
    home_lon_deg: float
    home_lat_deg: float
    home_alt_amsl_m: float | None
    items: dict[str, int]
    first_item: str
    last_item: str
    stops: int
    path_length_m: float
    home_to_first_m: float
    last_to_home_m: float
    hold_s: float
    altitudes_m: dict[str, list[float]]
    speeds_m_s: list[float]
    fence_points: int
    fence_circles: int
    rally_points: int
    complex_items: dict[str, int]
    warnings: list[str]
    faults: list[str]

    @property
    def lines(self) -> list[str]:
        """The description as lines of text."""
        amsl = self.home_alt_amsl_m
        height = "altitude not known" if amsl is None else f"{amsl:g} m above sea level"
        lines = [
            f"Plan for {self.autopilot}, {self.vehicle}",
            f"Home {self.home_lon_deg:.7f} E {self.home_lat_deg:.7f} N, {height}",
            "Items: " + (", ".join(f"{count} {name}" for name, count in self.items.items()) or "none"),
            f"First {self.first_item}, last {self.last_item}",
            f"{self.stops} stops over {self.path_length_m:.0f} m",
            f"Home to first stop {self.home_to_first_m:.0f} m, last stop to home {self.last_to_home_m:.0f} m",
            f"Holds {self.hold_s:g} s in all",
        ]
        lines += [
            f"Stops {low:g} m above {what}" if low == high else f"Stops {low:g} to {high:g} m above {what}"
            for what, (low, high) in self.altitudes_m.items()
        ]
        if self.speeds_m_s:
            lines.append("Speed " + ", ".join(f"{speed:g}" for speed in self.speeds_m_s) + " m/s")
        lines.append(f"Fence of {self.fence_points} points and {self.fence_circles} circles")
        lines.append(f"Rally points: {self.rally_points}")
        lines += [_pattern_line(kind, count) for kind, count in self.complex_items.items()]
        lines += [f"Note: {warning}" for warning in self.warnings]
        return lines + [f"Fault: {fault}" for fault in self.faults]


def describe_plan(plan: MissionPlan) -> PlanDescription:
    """Return what a plan holds, in words and numbers."""
    names = [command_name(item.command) for item in plan.items]
    stops = plan.stops
    to_first_m, to_home_m = _ends_m(plan, stops)
    return PlanDescription(
        autopilot=plan.autopilot_title,
        vehicle=VEHICLES.get(plan.vehicle_type, f"vehicle type {plan.vehicle_type}"),
        home_lon_deg=plan.home.lon_deg,
        home_lat_deg=plan.home.lat_deg,
        home_alt_amsl_m=plan.home.alt_amsl_m if plan.home.altitude_known else None,
        items=dict(Counter(names)),
        first_item=names[0] if names else "none",
        last_item=names[-1] if names else "none",
        stops=len(stops),
        path_length_m=path_length_m([stop.lon_deg for stop in stops], [stop.lat_deg for stop in stops]),
        home_to_first_m=to_first_m,
        last_to_home_m=to_home_m,
        hold_s=sum(item.hold_s for item in plan.items),
        altitudes_m=_altitudes(stops),
        speeds_m_s=[item.params[1] for item in plan.items if item.command == DO_CHANGE_SPEED and item.params[1] > 0],
        fence_points=sum(len(fence.lon_deg) for fence in plan.fences),
        fence_circles=len(plan.circles),
        rally_points=len(plan.rally_points),
        complex_items={pattern.kind: pattern.items for pattern in plan.complex_items},
        warnings=list(plan.warnings),
        faults=list(plan_faults(plan)),
    )


def command_name(command: int) -> str:
    """Return a MAV_CMD's name without the prefix, or its number when MAVLink has no name for it.

    Examples
    --------
    >>> command_name(16), command_name(60000)
    ('NAV_WAYPOINT', 'command 60000')
    """
    from pymavlink.dialects.v20 import ardupilotmega

    entry = ardupilotmega.enums["MAV_CMD"].get(command)
    return f"command {command}" if entry is None else str(entry.name).removeprefix("MAV_CMD_")


def _ends_m(plan: MissionPlan, stops: tuple[MissionItem, ...]) -> tuple[float, float]:
    if not stops:
        return 0.0, 0.0
    ends = (stops[0], stops[-1])
    lengths = distance_m(
        plan.home.lon_deg, plan.home.lat_deg, [end.lon_deg for end in ends], [end.lat_deg for end in ends]
    )
    return float(lengths[0]), float(lengths[1])


def _altitudes(stops: tuple[MissionItem, ...]) -> dict[str, list[float]]:
    by_frame: dict[str, list[float]] = {}
    for stop in stops:
        by_frame.setdefault(ABOVE.get(stop.frame, f"frame {stop.frame}"), []).append(stop.altitude_m)
    return {what: [min(values), max(values)] for what, values in by_frame.items()}


def _pattern_line(kind: str, items: int) -> str:
    if items:
        return f"Pattern '{kind}': {items} of the items above"
    return f"Pattern '{kind}': only QGroundControl can work out its items; nothing above counts them"
