"""Thousands of random keep-outs, boxes, homes and routes: no leg within the margin, no fence smaller than drawn.

One example of hypothesis is a seed for a batch, each planned as `generate-mission` does it: zones of the box and the
autopilot, stops on the cells of a grid, legs between them that are not barred, the ways from and to home, the ends of
planes. Legs are flown as geodesics and measured against what was drawn, not against what was made of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Transformer

from mission_strategies import AUTOPILOT_NAMES, KINDS
from sparsor.errors import MissionError
from sparsor.geodesy import BoundingBox, Grid
from sparsor.geodesy.keepouts import KeepOut
from sparsor.geodesy.lengths import distance_m, offset_deg, wgs84
from sparsor.geodesy.plane import LocalPlane
from sparsor.geodesy.zones import Zones, zones_of
from sparsor.mission import Home, MissionPlan, build_mission, judged_faults
from sparsor.mission.fence import MAX_CORNERS
from sparsor.vehicle import CALM, SteadyWind, autopilot_named, load_vehicle

if TYPE_CHECKING:
    from collections.abc import Iterator

ZONES, MISSIONS = 5, 4  # of an example, and over each
FENCES, LEGS = 10, 200  # of an example, and past each
ALONG = 24  # places on a leg
TO_ECEF = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
VEHICLES = {kind: load_vehicle(kind) for kind in KINDS}


@dataclass(frozen=True)
class Drawn:
    """Keep-outs as somebody drew them over a box."""

    box: BoundingBox
    keep_outs: list[KeepOut]

    @property
    def plane(self) -> LocalPlane:
        return LocalPlane(self.box.centre_lon_deg, self.box.centre_lat_deg)

    def zones(self, margin_m: float, most_points: int) -> Zones:
        diagonal_m = float(np.hypot(self.box.east_m, self.box.north_m))
        return zones_of(
            self.keep_outs, margin_m=margin_m, plane=self.plane, most_points=most_points, longest_leg_m=diagonal_m
        )

    def nearest_m(self, legs: np.ndarray) -> float:
        """The least distance of legs, (n, places, 2), from what was drawn; 0 inside."""
        return min((circle_distance_m if one.is_circle else polygon_distance_m)(one, legs) for one in self.keep_outs)


def circle_distance_m(one: KeepOut, legs: np.ndarray) -> float:
    """Through the globe, to the straight pieces between places on the legs: a centimetre off over a kilometre."""
    middle = ecef_m(np.array([[one.lon_deg[0], one.lat_deg[0]]]))[0]
    places = ecef_m(legs.reshape(-1, 2)).reshape(*legs.shape[:2], 3)
    start, piece = places[:, :-1], np.diff(places, axis=1)
    share = ((middle - start) * piece).sum(axis=2) / np.maximum((piece**2).sum(axis=2), 1e-9)
    nearest = start + np.clip(share, 0, 1)[..., None] * piece
    return float(np.linalg.norm(nearest - middle, axis=2).min()) - one.radius_m


def polygon_distance_m(one: KeepOut, legs: np.ndarray) -> float:
    """On a plane at the place of the polygon that the legs come nearest to."""
    plane, least = LocalPlane(one.lon_deg[0], one.lat_deg[0]), np.inf
    for _ in range(3):
        area = shapely.Polygon(plane.metres(one.lon_deg, one.lat_deg))
        shapely.prepare(area)
        lines = shapely.linestrings(plane.metres(legs[..., 0], legs[..., 1]))
        away = shapely.distance(area, lines)
        least = float(away.min())
        place = shapely.shortest_line(area, lines[away.argmin()])
        plane = LocalPlane(*(float(value) for value in plane.degrees(shapely.get_coordinates(place)[0])))
    return least


def ecef_m(places: np.ndarray) -> np.ndarray:
    return np.column_stack(TO_ECEF.transform(places[:, 0], places[:, 1], np.zeros(len(places))))


def flown_legs(starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Places along geodesics, (n, places, 2)."""
    course_deg, _, length_m = wgs84().inv(*starts.T, *ends.T)
    along_m = np.linspace(0.0, 1.0, ALONG) * np.asarray(length_m)[:, None]
    columns = [np.broadcast_to(np.asarray(one)[:, None], along_m.shape).ravel() for one in (*starts.T, course_deg)]
    lon, lat, _ = wgs84().fwd(*columns, along_m.ravel())
    return np.stack([np.reshape(lon, along_m.shape), np.reshape(lat, along_m.shape)], axis=-1)


def drawn(rng: np.random.Generator) -> Drawn:
    side_m = float(np.exp(rng.uniform(np.log(1000), np.log(20_000))))
    lat = float(rng.uniform(-70, 70))
    lon = float(rng.choice([-179.99, -75.0, 0.0, 51.5, 179.97]) + rng.uniform(0, 0.01))
    east, north = (float(one) for one in offset_deg(lon, lat, side_m * rng.uniform(0.6, 1.0), side_m))
    box = BoundingBox(lon, lat, east, north)
    plane = LocalPlane(box.centre_lon_deg, box.centre_lat_deg)
    found = []
    for number in range(int(rng.integers(1, 6))):
        middle, size_m = rng.uniform(-0.6, 0.6, 2) * side_m, float(rng.uniform(0.01, 0.15)) * side_m
        if rng.random() < 0.4:
            lon_deg, lat_deg = plane.degrees(middle)
            found.append(KeepOut(f"c{number}", (float(lon_deg),), (float(lat_deg),), size_m))
        else:
            count = int(rng.integers(3, 30))
            turn = 2 * np.pi * (np.arange(count) + rng.random()) / count
            ring = rng.uniform(0.15, 1.0, count)[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
            places = plane.degrees(middle + size_m * ring)
            found.append(KeepOut(f"p{number}", tuple(places[:, 0].tolist()), tuple(places[:, 1].tolist())))
    return Drawn(box, found)


def route(rng: np.random.Generator, zones: Zones, box: BoundingBox) -> tuple[np.ndarray, np.ndarray]:
    """A few stops on cells that are allowed, joined by legs that are not barred."""
    lon, lat = Grid(box, (10, 10)).centres_deg()
    free = ~zones.holds(lon, lat)
    lon, lat = lon[free], lat[free]
    stops = [int(rng.integers(lon.size))] if lon.size else []
    while stops and len(stops) < 5:
        here = stops[-1]
        barred = zones.crossed(np.full(lon.size, lon[here]), np.full(lat.size, lat[here]), lon, lat)
        onward = np.setdiff1d(np.flatnonzero(~barred), stops)
        if not onward.size:
            break
        stops.append(int(rng.choice(onward)))
    return lon[stops], lat[stops]


def planned(rng: np.random.Generator) -> Iterator[tuple[Drawn, MissionPlan, float]]:
    """Yield missions past random keep-outs, and their margin; none where there cannot be one, for a reason given."""
    what = drawn(rng)
    vehicle = VEHICLES[str(rng.choice(KINDS))]
    autopilot = autopilot_named(str(rng.choice(AUTOPILOT_NAMES)))
    margin_m = float(rng.uniform(5, 80)) + (2.0 * vehicle.turn_radius_m if vehicle.circles else 0.0)
    zones = what.zones(margin_m, autopilot.on_board(vehicle).max_fence_points - MAX_CORNERS)
    for _ in range(MISSIONS):
        lon, lat = route(rng, zones, what.box)
        size = np.array([what.box.east_m, what.box.north_m])
        home = what.plane.degrees(rng.uniform(-0.8, 0.8, 2) * size)
        wind = SteadyWind(4.0, rng.uniform(0, 360)) if rng.random() < 0.5 else CALM
        if not lon.size or zones.holds(*home):
            continue
        try:
            plan = build_mission(
                lon, lat, home=Home(float(home[0]), float(home[1])), vehicle=vehicle, autopilot=autopilot,
                altitude_m=50 if vehicle.flies else 0, wind=wind, zones=zones,
            )  # fmt: skip
        except MissionError as error:
            assert "no direction is free" in str(error) or "there is no way" in str(error), error
            continue
        yield what, plan, margin_m


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**48))
def test_no_leg_of_any_mission_comes_within_the_margin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(ZONES):
        for what, plan, margin_m in planned(rng):
            flown = [(plan.home.lon_deg, plan.home.lat_deg)]
            flown += [(item.lon_deg, item.lat_deg) for item in plan.items if item.has_position]
            assert what.nearest_m(flown_legs(np.array(flown[:-1]), np.array(flown[1:]))) >= margin_m
            assert [fault.sentence for fault in judged_faults(plan) if fault.fails] == []
            assert_fences_hold(what, plan.fences[1:], plan.circles)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**48), st.integers(30, 90))
def test_no_fence_is_smaller_than_what_was_drawn_and_no_leg_that_is_not_barred_is_near(
    seed: int, most_points: int
) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(FENCES):
        what, margin_m = drawn(rng), float(rng.uniform(5, 300))
        zones = what.zones(margin_m, most_points)
        assert zones.fence_points <= most_points
        assert_hold(what, [np.array(one) for one in zones.polygons], list(zones.circles))
        size = np.array([what.box.east_m, what.box.north_m])
        starts, ends = what.plane.degrees(rng.uniform(-0.5, 0.5, (2, LEGS, 2)) * size)
        open_legs = ~zones.crossed(*starts.T, *ends.T)
        if open_legs.any():
            assert what.nearest_m(flown_legs(starts[open_legs], ends[open_legs])) >= margin_m


def assert_fences_hold(what: Drawn, fences, circles) -> None:
    rings = [np.column_stack([fence.lon_deg, fence.lat_deg]) for fence in fences]
    assert_hold(what, rings, [(one.lon_deg, one.lat_deg, one.radius_m) for one in circles])


def assert_hold(what: Drawn, rings: list[np.ndarray], circles: list[tuple[float, float, float]]) -> None:
    fences = [shapely.Polygon(what.plane.metres(*ring.T)) for ring in rings]
    for one in what.keep_outs:
        if one.is_circle:
            aside_m = [
                float(distance_m(lon, lat, one.lon_deg[0], one.lat_deg[0])) + one.radius_m - radius_m
                for lon, lat, radius_m in circles
            ]
            assert min(aside_m) <= 0
        else:
            area = shapely.Polygon(what.plane.metres(one.lon_deg, one.lat_deg))
            assert any(fence.covers(area) for fence in fences)
