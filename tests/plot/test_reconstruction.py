"""The pictures of a map: whatever the box and the values, the same bytes each time, nothing cut off."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from sparsor.geodesy import BoundingBox, Grid
from sparsor.plot import MapPicture, map_png, reconstruction_png, uncertainty_png

BOXES = {
    "doha": (51.50, 25.27, 51.53, 25.30),
    "gulf": (45.5, 22.0, 58.1, 31.0),
    "lane": (30.0, 25.0, 58.0, 25.003),
    "antimeridian": (179.9, -17.0, -179.9, -16.8),
}


def picture_of(box_deg: tuple[float, float, float, float]) -> MapPicture:
    grid = Grid(BoundingBox(*box_deg))
    cells = np.random.default_rng(0).choice(grid.size, 40, replace=False)
    way = np.column_stack(grid.centres_deg(cells))
    values = np.add.outer(np.arange(32.0), np.arange(32.0))
    return MapPicture(
        title="NO2 over a box",
        box_deg=box_deg,
        east_m=grid.box.east_m,
        north_m=grid.box.north_m,
        values=values,
        standard_deviation=1.0 + values / 10,
        label="NO2",
        unit="ug/m3",
        tracks=(way[:20], way[20:]),
        samples=way[:30],
        sample_values=values.ravel()[cells[:30]],
        left_out=way[30:],
        outside=np.arange(1024) % 32 > 28,
        caption=("40 samples",),
    )


def pixels_of(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


@pytest.mark.parametrize("name", BOXES)
def test_every_box_has_a_picture_of_two_maps(name: str) -> None:
    pixels = pixels_of(reconstruction_png(picture_of(BOXES[name])))
    assert pixels.shape[1] == 2800
    assert 700 <= pixels.shape[0] <= 1300
    assert all((edge == 255).all() for edge in (pixels[:6], pixels[-6:], pixels[:, :6], pixels[:, -6:]))


def test_the_same_picture_has_the_same_bytes() -> None:
    picture = picture_of(BOXES["doha"])
    assert reconstruction_png(picture) == reconstruction_png(picture)


def test_one_map_alone_is_as_wide_as_a_preview() -> None:
    picture = picture_of(BOXES["doha"])
    one, other = pixels_of(map_png(picture)), pixels_of(uncertainty_png(picture))
    assert one.shape == other.shape
    assert one.shape[1] == 1400
    assert (one != other).any()


@pytest.mark.parametrize("values", [0.0, 7.0, 3e15, -1e-9])
def test_a_map_may_be_flat_or_huge(values: float) -> None:
    flat = np.full((32, 32), values)
    picture = picture_of(BOXES["doha"])
    made = replace(picture, values=flat, standard_deviation=np.abs(flat), sample_values=np.full(30, values))
    assert pixels_of(reconstruction_png(made)).size


def test_samples_have_the_colours_of_the_map_also_where_it_is_scaled() -> None:
    picture = picture_of(BOXES["doha"])
    big = replace(
        picture,
        values=picture.values * 1e15,
        standard_deviation=picture.standard_deviation * 1e15,
        sample_values=picture.sample_values * 1e15,
    )
    small_page, big_page = pixels_of(map_png(picture)), pixels_of(map_png(big))
    map_only = slice(200, 900), slice(300, 800)
    assert (small_page[map_only] == big_page[map_only]).all()


def test_a_finer_map_and_nothing_left_out() -> None:
    picture = picture_of(BOXES["doha"])
    fine = picture.values.repeat(3, 0).repeat(3, 1)
    made = replace(picture, values=fine, standard_deviation=fine, outside=None, left_out=np.empty((0, 2)))
    assert pixels_of(reconstruction_png(made)).size


def test_words_are_taken_as_they_are() -> None:
    assert reconstruction_png(replace(picture_of(BOXES["doha"]), title="$\\frac" + "W" * 300, label="$x_", unit="$"))
