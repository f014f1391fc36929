"""Pictures of the study: the same bytes for the same curves, readable sizes, colours told apart by all."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

from sparsor.plot.curves import _COLOURS, _MARKERS, Panel, Series, curves_png
from sparsor.plot.example import ExampleMap, example_png

SERIES = (Series("one", (1.0, 2.0, 3.0), (0.3, 0.2, 0.1), (0.05, 0.02, 0.0)), Series("two", (1.0, 3.0), (0.4, 0.05)))
PANEL = Panel("t", "length, cell units", "error", SERIES)


def size(png):
    return Image.open(io.BytesIO(png)).size


def test_the_same_curves_give_the_same_bytes_on_any_scale():
    for panel in (PANEL, Panel("t", "x", "y", SERIES, logarithmic=True), Panel("t", "x", "y", SERIES, stretched=True)):
        assert curves_png("T", (panel,), "words") == curves_png("T", (panel,), "words")


def test_panels_go_two_a_line_and_long_captions_make_room_for_themselves():
    one, two, four = (size(curves_png("T", (PANEL,) * count)) for count in (1, 2, 4))
    assert one[0] < two[0] == four[0]
    assert four[1] > 1.5 * two[1]
    assert size(curves_png("T", (PANEL,), "many words " * 80))[1] > one[1]


def test_a_panel_without_lines_is_drawn_too():
    assert curves_png("T", (Panel("t", "x", "y", ()),)).startswith(b"\x89PNG")


def test_no_two_of_the_first_lines_share_colour_or_marker():
    assert len(set(_COLOURS)) == len(_COLOURS) == len(set(_MARKERS)) == len(_MARKERS)


def test_an_example_is_the_same_again_with_and_without_routes():
    values = np.arange(64.0).reshape(8, 8)
    maps = (ExampleMap("truth", values), ExampleMap("found", values[::-1], np.array([0, 63, 7])))
    assert example_png("T", maps, "ppb") == example_png("T", maps, "ppb")
    assert size(example_png("T", maps, "ppb"))[0] > size(example_png("T", maps[:1], "ppb"))[0]
