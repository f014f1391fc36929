"""A bounding box is either right or refused with a sentence that helps."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given

from sparsor.errors import BoxError, InputError
from sparsor.geodesy import BoundingBox
from sparsor.geodesy.box import wrap_longitude
from strategies import boxes

DOHA = (51.50, 25.27, 51.53, 25.30)


@given(boxes())
def test_sides_are_in_range_and_add_up(box: BoundingBox) -> None:
    assert 200 <= box.east_m <= 3e6
    assert 200 <= box.north_m <= 3e6
    assert 0 < box.width_deg < 180
    assert math.isclose(box.south_deg + box.height_deg, box.north_deg, abs_tol=1e-12)
    assert math.isclose(wrap_longitude(box.west_deg + box.width_deg), box.east_deg, abs_tol=1e-12)
    assert -180 <= box.centre_lon_deg <= 180


@given(boxes(across=True))
def test_a_box_across_the_antimeridian_says_so(box: BoundingBox) -> None:
    assert box.crosses_antimeridian
    half = (box.centre_lon_deg - box.west_deg) % 360
    assert math.isclose(half, box.width_deg / 2, abs_tol=1e-9)


@given(boxes())
def test_mirror_images_have_the_same_size(box: BoundingBox) -> None:
    west, south, east, north = box.as_tuple()
    mirrored = BoundingBox(-east, -north, -west, -south)
    assert math.isclose(mirrored.east_m, box.east_m, rel_tol=1e-9)
    assert math.isclose(mirrored.north_m, box.north_m, rel_tol=1e-9)


def test_width_is_that_of_the_parallel_not_of_the_great_circle() -> None:
    box = BoundingBox(0.0, 59.5, 50.0, 60.5)
    assert box.east_m == pytest.approx(50 * 55_800, rel=2e-3)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ((51.53, 25.27, 51.50, 25.30), "swapped?"),
        ((51.53, 25.27, 51.50, 25.30), "west and east"),
        ((51.50, 25.30, 51.53, 25.27), "swapped?"),
        ((-180.0, 0.0, 180.0, 1.0), "nearly round the world"),
        ((-170.0, 0.0, 170.0, 1.0), "spans 340 degrees"),
        ((51.50, 95.0, 51.53, 96.0), "south latitude 95 is outside -90..90"),
        ((51.50, 25.27, 51.53, 92.0), "north latitude 92 is outside -90..90"),
        ((25.27, 151.50, 25.30, 151.53), "latitudes and longitudes swapped?"),
        ((0.0, 86.0, 1.0, 87.0), "beyond 85 degrees"),
        ((181.0, 0.0, 182.0, 1.0), "west longitude 181 is outside -180..180"),
        ((179.0, 0.0, 190.0, 1.0), "east longitude 190 is outside -180..180"),
        ((math.nan, 25.27, 51.53, 25.30), "not a number"),
        ((51.50, 25.27, math.inf, 25.30), "not a number"),
        ((51.50, 25.27, 51.50, 25.30), "no size"),
        ((51.50, 25.27, 51.53, 25.27), "no size"),
        ((51.50, 25.27, 51.501, 25.30), "100.7 m wide; the least is 200 m"),
        ((51.50, 25.27, 51.53, 25.271), "110.8 m high; the least is 200 m"),
        ((0.0, 0.0, 28.0, 1.0), "3117 km wide; the most is 3000 km"),
        ((0.0, 0.0, 1.0, 28.0), "high; the most is 3000 km"),
    ],
)
def test_what_is_no_box_is_refused_with_the_reason(values: tuple[float, ...], words: str) -> None:
    with pytest.raises(BoxError, match=re.escape(words)) as raised:
        BoundingBox(*values)
    assert isinstance(raised.value, InputError)
    assert raised.value.exit_code == 2


@given(boxes())
def test_swapped_sides_are_refused(box: BoundingBox) -> None:
    west, south, east, north = box.as_tuple()
    with pytest.raises(BoxError, match="swapped"):
        BoundingBox(east, south, west, north)
    with pytest.raises(BoxError, match="swapped"):
        BoundingBox(west, north, east, south)


def test_boxes_are_values() -> None:
    assert BoundingBox(*DOHA) == BoundingBox(*DOHA)
    assert BoundingBox(*DOHA).as_tuple() == DOHA
