"""Land or sea alone: what is not barred is on the side asked for, and the margin away from the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pyproj import Transformer
from scipy.spatial import cKDTree

from sparsor.geodesy import BoundingBox
from sparsor.geodesy.land import Land, packaged_land
from sparsor.geodesy.lengths import distance_m, offset_deg, wgs84
from sparsor.geodesy.plane import LocalPlane
from sparsor.geodesy.shore import OTHER, Shore, reach_deg, shore_of
from sparsor.geodesy.zones import MOST_BULGE_M, bulge_m

PLACES, LEGS, ALONG = 1500, 150, 30
STEP = 0.05  # of the margin: points along the coast
RIM_M = 0.05
TO_ECEF = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)


def box_of(lon_deg: float, lat_deg: float, side_m: float) -> BoundingBox:
    east, north = (float(one) for one in offset_deg(lon_deg, lat_deg, side_m, side_m))
    return BoundingBox(lon_deg, lat_deg, east, north)


@st.composite
def shores(draw: st.DrawFn) -> tuple[Shore, BoundingBox]:
    """Islands and bays drawn at random over boxes of 2 to 500 km, up to 70 degrees of latitude."""
    side_m = draw(st.sampled_from([2000.0, 12_000.0, 60_000.0, 500_000.0]))
    box = box_of(
        draw(st.sampled_from([51.5, 179.9, -75.0])),
        draw(st.sampled_from([-70.0, 25.0, 70.0]) | st.floats(-70, 70)),
        side_m,
    )
    margin_m = draw(st.sampled_from([0.003, 0.01, 0.03, 0.08])) * side_m
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    west, width, height = box.west_deg, box.width_deg, box.height_deg
    shapes = []
    for _ in range(draw(st.integers(0, 4))):
        count = int(rng.integers(3, 30))
        turn = 2 * np.pi * (np.arange(count) + rng.random()) / count
        radius = rng.uniform(0.01, rng.choice([0.1, 0.6]), count)
        middle = rng.uniform(-0.2, 1.2, 2)
        ring = middle + radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
        shapes.append(shapely.Polygon(ring * (width, height) + (west, box.south_deg)))
    across, up = reach_deg(box, margin_m)
    frame = (west - across, box.south_deg - up, west + width + across, box.north_deg + up)
    land = Land(shapely.union_all(shapely.clip_by_rect(shapes, *frame)) if shapes else shapely.Polygon(), "drawn")
    plane = LocalPlane(box.centre_lon_deg, box.centre_lat_deg)
    return shore_of(land, draw(st.sampled_from(["land", "sea"])), box=box, plane=plane, margin_m=margin_m), box


def ecef_m(lon_deg: np.ndarray, lat_deg: np.ndarray) -> np.ndarray:
    return np.column_stack(TO_ECEF.transform(lon_deg, lat_deg, np.zeros(np.size(lon_deg))))


def away_m(shore: Shore, lon: np.ndarray, lat: np.ndarray) -> np.ndarray:
    """How far places are from the coast, metres through the globe."""
    edge = shapely.segmentize(shore.land.boundary, STEP * shore.margin_m)
    return cKDTree(ecef_m(*shore.plane.degrees(shapely.get_coordinates(edge)).T)).query(ecef_m(lon, lat))[0]


def short_m(shore: Shore) -> float:
    """What the distance from points along a line may exceed that from the line by, and a centimetre."""
    return STEP**2 * shore.margin_m / 8 + 0.01


@settings(max_examples=120, deadline=None)
@given(shores(), st.integers(0, 2**32))
def test_nothing_comes_nearer_to_the_other_side_than_the_margin(drawn: tuple[Shore, BoundingBox], seed: int) -> None:
    shore, box = drawn
    rng = np.random.default_rng(seed)
    lon = (box.west_deg + box.width_deg * rng.random(PLACES) + 180) % 360 - 180
    lat = box.south_deg + box.height_deg * rng.random(PLACES)
    free = ~shore.holds(lon, lat)
    assert shore.asked_for(lon, lat)[free].all()
    start, end = rng.choice(PLACES, (2, LEGS))
    open_legs = ~shore.crossed(lon[start], lat[start], lon[end], lat[end])
    # A geodesic of hundreds of kilometres bulges by more than is allowed for: no flight, a planning study.
    length_m = distance_m(lon[start], lat[start], lon[end], lat[end])
    open_legs &= [bulge_m(one, float(np.abs(lat).max())) < MOST_BULGE_M for one in length_m]
    start, end = start[open_legs], end[open_legs]
    if shore.land.is_empty:
        assert free.all() == (shore.side == "sea")
        return
    far_m = away_m(shore, lon, lat)
    assert far_m[free].min(initial=np.inf) >= shore.margin_m - short_m(shore)
    # The edge of what is barred, in the box: as far as the margin and what a leg may bulge by.
    rim = shapely.get_coordinates(shapely.segmentize(shore.area.boundary, RIM_M * shore.margin_m))
    half = np.abs(shore.plane.metres(box.west_deg, box.south_deg))
    rim = rim[(np.abs(rim) < half).all(axis=1)]
    whole_m = shore.margin_m + bulge_m(float(np.hypot(box.east_m, box.north_m)), shore.plane.lat_deg)
    assert away_m(shore, *shore.plane.degrees(rim).T).min(initial=np.inf) >= whole_m - short_m(shore)
    # Nor is more barred than some of the margin: 5 % for corners, the plane's metres, the bulge of legs.
    far = shore.asked_for(lon, lat) & (far_m > 1.25 * shore.margin_m * stretch(box) + 60)
    assert not (far & ~free).any()
    if start.size:
        flown = [wgs84().npts(lon[a], lat[a], lon[b], lat[b], ALONG) for a, b in zip(start, end, strict=True)]
        assert away_m(shore, *np.concatenate(flown).T).min() >= shore.margin_m - short_m(shore)


def stretch(box: BoundingBox) -> float:
    farthest = max(abs(box.south_deg), abs(box.north_deg))
    return max(1.0, np.cos(np.radians(box.centre_lat_deg)) / np.cos(np.radians(farthest)))


@settings(max_examples=60, deadline=None)
@given(shores(), st.integers(0, 2**32))
def test_the_sides_are_each_other_s_opposite(drawn: tuple[Shore, BoundingBox], seed: int) -> None:
    shore, box = drawn
    rng = np.random.default_rng(seed)
    places = np.column_stack(
        [box.west_deg + box.width_deg * rng.random(50), box.south_deg + box.height_deg * rng.random(50)]
    )
    opposite = replace(shore, side=OTHER[shore.side])
    assert (shore.asked_for(*places.T) != opposite.asked_for(*places.T)).all()
    way = places[:2]
    between = np.linspace(*way, 300)
    if not shore.crosses_other_side(way):
        assert shore.asked_for(*between.T).all()
    assume(not shore.land.is_empty)
    assert shore.crosses_other_side(way) or not opposite.asked_for(*between.T).any()


@pytest.mark.parametrize("side", ["land", "sea"])
def test_the_gulf_has_both(side: str) -> None:
    box = BoundingBox(47.0, 23.0, 57.5, 30.5)
    plane = LocalPlane(box.centre_lon_deg, box.centre_lat_deg)
    land = packaged_land(box, reach_deg(box, 500.0))
    shore = shore_of(land, side, box=box, plane=plane, margin_m=500.0)
    assert shore.holds(51.7, 25.3) == (side == "land")
    assert shore.holds(46.8 + 0.5, 24.7) == (side == "sea")
