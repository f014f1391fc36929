"""Hypothesis strategies for routes and plans, shared by the tests of missions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from hypothesis import strategies as st

from sparsor.mission import Home, build_mission
from sparsor.vehicle import CALM, SteadyWind, load_vehicle

if TYPE_CHECKING:
    from sparsor.mission import MissionPlan
    from sparsor.vehicle import Vehicle

QUAD = load_vehicle("quad")
AUTOPILOT_NAMES = ("ardupilot", "px4")
KINDS = ("quad", "plane", "vtol", "rover", "boat")


@dataclass(frozen=True)
class Route:
    lon_deg: list[float]
    lat_deg: list[float]
    home: Home | None


def wrapped(lon_deg: float) -> float:
    return (lon_deg + 180.0) % 360.0 - 180.0


@st.composite
def routes(draw: st.DrawFn, *, across: bool = False, largest_m: float = 1e6, stops: int = 12) -> Route:
    """Routes from a single point to a thousand kilometres, lines along a parallel among them."""
    span_m = math.exp(draw(st.floats(0.0, math.log(largest_m))))
    lat = draw(st.floats(-84.0 + span_m / 1e5, 84.0 - span_m / 1e5))
    lon = 180.0 if across else draw(st.floats(-170.0, 170.0))
    high = span_m / 111e3
    wide = min(high / math.cos(math.radians(abs(lat) + high / 2)), 60.0)
    flat = draw(st.booleans())
    unit = st.floats(-0.5, 0.5)
    points = draw(st.lists(st.tuples(unit, unit), min_size=2 if across else 1, max_size=stops))
    east = [wide * x for x, _ in points]
    if across:
        east[:2] = [-0.4 * wide - 1e-4, 0.4 * wide + 1e-4]
    home_at = draw(st.none() | st.tuples(unit, unit, st.floats(-100, 3000), st.booleans()))
    home = None
    if home_at is not None:
        altitude = (round(home_at[2], 3) or 1.0, True) if home_at[3] else (0.0, False)
        home = Home(wrapped(lon + wide * home_at[0]), lat + high * home_at[1], *altitude)
    north = [lat if flat else lat + high * y for _, y in points]
    return Route([wrapped(lon + value) for value in east], north, home)


@st.composite
def plans(draw: st.DrawFn, *, across: bool = False, largest_m: float = 2e4) -> MissionPlan:
    route = draw(routes(across=across, largest_m=largest_m))
    return build_mission(
        route.lon_deg,
        route.lat_deg,
        home=route.home,
        vehicle=QUAD,
        autopilot=draw(st.sampled_from(AUTOPILOT_NAMES)),
        altitude_m=round(draw(st.floats(1.0, 300.0)), 2),
        speed_m_s=round(draw(st.floats(0.5, 20.0)), 2),
        hold_s=round(draw(st.floats(0.0, 90.0)), 1),
        fence_margin_m=draw(st.floats(1.0, 500.0)),
    )


KNOWN_HOME = Home(51.505, 25.265, 12.5, altitude_known=True)


def example_plan(
    autopilot: str = "ardupilot",
    stops: int = 9,
    home: Home | None = KNOWN_HOME,
    vehicle: Vehicle = QUAD,
    hold_s: float = 4,
    wind: SteadyWind = CALM,
    span_deg: float = 0.03,
) -> MissionPlan:
    """Return one plan near Doha for the tests that need no more."""
    rng = np.random.default_rng(7)
    lon, lat = 51.50 + span_deg * rng.random(stops), 25.27 + span_deg * rng.random(stops)
    return build_mission(
        lon,
        lat,
        home=home,
        vehicle=vehicle,
        autopilot=autopilot,
        altitude_m=60 if vehicle.flies else 0,
        hold_s=hold_s,
        wind=wind,
    )
