"""The fence holds its margin everywhere, in metres, and stays a shape that autopilots take."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon

from mission_strategies import Route, routes
from sparsor.errors import MissionError
from sparsor.geodesy.lengths import distance_m, wgs84
from sparsor.mission import Fence, fence_around

MARGINS = st.floats(1.0, 500.0)


def unwrapped(values: list[float], reference: float) -> np.ndarray:
    return reference + (np.asarray(values) - reference + 180.0) % 360.0 - 180.0


def plane(fence: Fence, reference: float) -> Polygon:
    return Polygon(np.column_stack([unwrapped(list(fence.lon_deg), reference), fence.lat_deg]))


def points_of(route: Route) -> tuple[list[float], list[float]]:
    home = route.home
    if home is None:
        return route.lon_deg, route.lat_deg
    return [home.lon_deg, *route.lon_deg, home.lon_deg], [home.lat_deg, *route.lat_deg, home.lat_deg]


def nearest_m(fence: Fence, lon: float, lat: float) -> float:
    """Geodesic distance to the fence, whose sides are straight in the longitude-latitude plane."""
    side_lon = unwrapped(list(fence.lon_deg), lon)
    side_lat = np.asarray(fence.lat_deg)
    share = np.linspace(0.0, 1.0, 257)[:, None]
    best = np.inf
    for _ in range(3):  # look closer around the nearest sample
        sample_lon = side_lon + share * (np.roll(side_lon, -1) - side_lon)
        sample_lat = side_lat + share * (np.roll(side_lat, -1) - side_lat)
        lengths = distance_m(lon, lat, sample_lon, sample_lat)
        best = min(best, float(lengths.min()))
        nearest = np.take_along_axis(np.broadcast_to(share, lengths.shape), lengths.argmin(axis=0)[None], axis=0)
        width = (share[1] - share[0]).max()
        share = np.clip(nearest + np.linspace(-width, width, 65)[:, None], 0.0, 1.0)
    return best


@settings(max_examples=60, deadline=None)
@given(st.booleans().flatmap(lambda across: routes(across=across)), MARGINS)
def test_every_stop_and_home_is_inside_by_the_margin(route: Route, margin_m: float) -> None:
    lon, lat = points_of(route)
    fence = fence_around(lon, lat, margin_m)
    area = plane(fence, lon[0])
    assert len(fence.lon_deg) <= 16
    assert area.is_valid
    assert area.exterior.is_ccw
    for east, north in zip(lon, lat, strict=True):
        assert area.contains(Point(unwrapped([east], lon[0])[0], north))
        assert nearest_m(fence, east, north) >= margin_m


@settings(max_examples=40, deadline=None)
@given(routes(largest_m=5e5), MARGINS)
def test_every_leg_is_inside_by_nearly_the_margin(route: Route, margin_m: float) -> None:
    lon, lat = points_of(route)
    fence = fence_around(lon, lat, margin_m)
    for start in range(len(lon) - 1):
        ends = (lon[start], lat[start], lon[start + 1], lat[start + 1])
        for east, north in wgs84().npts(*ends, 7):
            # A leg of 2 km bulges by less than 1 m below 84 degrees of latitude.
            assert nearest_m(fence, east, north) >= margin_m - 1.0


@settings(max_examples=40, deadline=None)
@given(routes(largest_m=1e5), MARGINS, st.integers(5, 15))
def test_fewer_corners_only_grow_the_fence(route: Route, margin_m: float, most: int) -> None:
    lon, lat = points_of(route)
    fine, coarse = fence_around(lon, lat, margin_m), fence_around(lon, lat, margin_m, most)
    assert len(coarse.lon_deg) <= most
    grown = plane(coarse, lon[0]).buffer(2e-7)  # corners are rounded to 1e-7 degrees
    assert grown.contains(plane(fine, lon[0]))


@settings(max_examples=40, deadline=None)
@given(routes(largest_m=2e4), st.floats(20.0, 100.0))
def test_the_fence_is_not_much_larger_than_it_has_to_be(route: Route, margin_m: float) -> None:
    lon, lat = points_of(route)
    east, north = unwrapped(lon, lon[0]), np.asarray(lat)
    fence = plane(fence_around(lon, lat, margin_m), lon[0])
    degree = 111_000.0
    scale = np.cos(np.radians(np.abs(north).max()))
    hull = Polygon(np.column_stack([fence.exterior.xy[0], fence.exterior.xy[1]]) * [scale, 1] * degree)
    snug = Polygon()
    for x, y in zip(east * scale * degree, north * degree, strict=True):
        snug = snug.union(Point(x, y)).convex_hull
    assert hull.area <= 1.25 * snug.buffer(margin_m * 1.02 + 1).area


def test_one_point_makes_an_octagon() -> None:
    fence = fence_around([51.5], [25.3], 50)
    lengths = distance_m(51.5, 25.3, fence.lon_deg, fence.lat_deg)
    assert len(fence.lon_deg) == 8
    assert lengths.max() < 56


def test_a_fence_across_the_antimeridian_has_corners_on_both_sides() -> None:
    fence = fence_around([179.99, -179.99], [-17.0, -17.0], 50)
    assert -179.99 < max(lon for lon in fence.lon_deg if lon < 0) < -179.98
    assert 179.98 < min(lon for lon in fence.lon_deg if lon > 0) < 179.99
    assert plane(fence, 180.0).contains(Point(180.0, -17.0))


@pytest.mark.parametrize("margin", [0.0, -5.0, float("nan"), float("inf")])
def test_a_margin_that_is_none_is_refused(margin: float) -> None:
    with pytest.raises(MissionError, match=r"fence margin of .*; allowed is 1 m or more"):
        fence_around([51.5], [25.3], margin)


def test_a_fence_over_the_pole_is_refused() -> None:
    with pytest.raises(MissionError, match="pole"):
        fence_around([0.0], [89.999], 500)
