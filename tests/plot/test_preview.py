"""The picture of a mission: a PNG whatever the box, the same bytes each time, true to scale."""

from __future__ import annotations

import io
import struct
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from pyproj import Geod

from sparsor.geodesy import BoundingBox, Grid
from sparsor.plot import MissionPicture, mission_preview
from sparsor.plot.furniture import graticule_lines, scale_bar
from sparsor.plot.legend import legend_entries
from sparsor.plot.view import MAP_HEIGHT_IN, MAP_WIDTH_IN, view_of

GEOD = Geod(ellps="WGS84")
BOXES = {
    "doha": (51.50, 25.27, 51.53, 25.30),
    "gulf": (45.5, 22.0, 58.1, 31.0),
    "200 m": (51.50, 25.27, 51.5021, 25.2719),
    "3000 km": (30.0, 5.0, 56.0, 31.0),
    "strip": (51.50, 10.0, 51.503, 35.0),
    "lane": (30.0, 25.0, 58.0, 25.003),
    "antimeridian": (179.9, -17.0, -179.9, -16.8),
    "far north": (-170.0, 70.0, -110.0, 84.5),
}


def picture_of(box_deg: tuple[float, float, float, float], stops: int = 12) -> MissionPicture:
    box = BoundingBox(*box_deg)
    grid = Grid(box)
    rng = np.random.default_rng(0)
    route = np.column_stack(grid.centres_deg(rng.choice(grid.size, stops, replace=False)))
    west, south, east, north = box_deg
    corners = np.array([[west, south], [east, south], [east, north], [west, north]])
    return MissionPicture(
        title="A box on the map",
        box_deg=box_deg,
        east_m=box.east_m,
        north_m=box.north_m,
        prior=np.add.outer(np.arange(32.0), np.arange(32.0)),
        prior_label="expected NO₂",
        prior_unit="µmol/m²",
        stops=route,
        route=route,
        transits=(route[[-1, 0]],),
        homes=((float(route[0, 0]), float(route[0, 1])),),
        fence=corners,
        area=(corners[:3],),
        outside=np.arange(1024) % 32 > 28,
        caption=("12 stops", "flyable"),
    )


def nothing_is_cut_off(png: bytes) -> bool:
    """Whether the outermost pixels are white all around."""
    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("L"))
    return all(bool(np.all(edge == 255)) for edge in (pixels[:6], pixels[-6:], pixels[:, :6], pixels[:, -6:]))


def size_of(png: bytes) -> tuple[int, int]:
    width, height = struct.unpack(">II", png[16:24])
    return width, height


@pytest.mark.parametrize("name", BOXES)
def test_every_box_has_a_picture(name: str) -> None:
    png = mission_preview(picture_of(BOXES[name]))
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = size_of(png)
    assert width == 1400
    assert 800 <= height <= 1250
    assert len(png) < 500_000
    assert nothing_is_cut_off(png)


def test_the_same_picture_has_the_same_bytes() -> None:
    assert mission_preview(picture_of(BOXES["doha"])) == mission_preview(picture_of(BOXES["doha"]))


def test_settings_of_the_user_make_no_difference() -> None:
    import matplotlib as mpl

    picture = picture_of(BOXES["doha"])
    before = mission_preview(picture)
    with mpl.rc_context({"font.size": 20, "axes.grid": True, "savefig.dpi": 50, "lines.linewidth": 9}):
        assert mission_preview(picture) == before


def test_what_is_not_given_is_not_needed() -> None:
    full = picture_of(BOXES["doha"])
    bare = MissionPicture(title="", box_deg=full.box_deg, east_m=full.east_m, north_m=full.north_m)
    assert size_of(mission_preview(bare))[0] == 1400
    for missing in (
        {"prior": None},
        {"route": None},
        {"stops": None},
        {"homes": ()},
        {"stops": full.stops[:1]},
    ):
        assert size_of(mission_preview(replace(full, **missing)))[0] == 1400


@pytest.mark.parametrize("values", [np.nan, 0.0, 7.0, 1e15, -1e-9])
def test_a_prior_may_be_flat_huge_or_missing(values: float) -> None:
    prior = np.full((32, 32), values)
    assert mission_preview(replace(picture_of(BOXES["doha"]), prior=prior))


def test_words_are_taken_as_they_are_and_never_leave_the_page() -> None:
    picture = replace(
        picture_of(BOXES["doha"]),
        title="$\\frac" + "W" * 300,
        caption=("100 % of $x_1$ " * 40,) * 20,
        prior_unit="$",
    )
    png = mission_preview(picture)
    assert size_of(png)[1] < 1400
    assert nothing_is_cut_off(png)


def test_many_stops_and_a_home_far_away() -> None:
    picture = replace(picture_of(BOXES["doha"], 400), homes=((-70.0, 10.0),))
    assert view_of(picture) == view_of(replace(picture, homes=()))
    assert nothing_is_cut_off(mission_preview(picture))


@given(st.sampled_from(sorted(BOXES)))
def test_the_view_holds_the_box_and_is_true_to_scale(name: str) -> None:
    picture = picture_of(BOXES[name])
    view = view_of(picture)
    assert view.shows(picture.fence).all()
    assert view.width_in <= MAP_WIDTH_IN + 1e-9
    assert view.height_in <= MAP_HEIGHT_IN + 1e-9
    height_m = (view.north_deg - view.south_deg) * picture.north_m / (picture.box_deg[3] - picture.box_deg[1])
    assert height_m / view.height_in == pytest.approx(view.m_per_inch, rel=1e-9)


@pytest.mark.parametrize("name", BOXES)
def test_the_scale_bar_is_right_to_one_per_cent(name: str) -> None:
    picture = picture_of(BOXES[name])
    view = view_of(picture)
    length_m, length_in = scale_bar(view)
    _, south, _, north = picture.box_deg
    lat = (south + north) / 2
    ends = view.degrees([[0.0, 0.0], [length_in, 0.0]])[:, 0]
    along = np.linspace(*ends, 100)  # along the parallel, in short steps
    assert GEOD.line_length(along, np.full(100, lat)) == pytest.approx(length_m, rel=0.01)
    assert 0.3 < length_in < 1.0


@pytest.mark.parametrize("name", BOXES)
def test_the_graticule_has_enough_lines_and_room_for_its_labels(name: str) -> None:
    view = view_of(picture_of(BOXES[name]))
    lon, lat, lon_step, lat_step = graticule_lines(view)
    assert 2 <= len(lon) <= 10
    assert 2 <= len(lat) <= 12
    assert lon_step / (view.east_deg - view.west_deg) * view.width_in > 0.4
    assert lat_step / (view.north_deg - view.south_deg) * view.height_in > 0.25


def test_arrays_that_do_not_fit_the_grid_are_refused() -> None:
    picture = picture_of(BOXES["doha"])
    with pytest.raises(ValueError, match=r"the prior has shape \(8, 8\), the grid \(32, 32\)"):
        replace(picture, prior=np.zeros((8, 8)))
    with pytest.raises(ValueError, match="the grid has 1024 cells"):
        replace(picture, outside=np.zeros(5, dtype=bool))
    with pytest.raises(ValueError, match="stops has shape"):
        replace(picture, stops=np.zeros((2, 5)))


def test_importing_plot_does_not_import_matplotlib() -> None:
    code = "import sys, sparsor.plot; print([m for m in ('matplotlib', 'shapely') if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


@pytest.mark.parametrize("name", ["doha", "antimeridian"])
def test_what_is_kept_out_of_is_drawn_with_its_margin_and_the_coast_that_was_given(name: str) -> None:
    plain = picture_of(BOXES[name])
    west, south, _, north = BOXES[name]
    inch = (north - south) / 8
    ring = np.array([[west + inch, south + inch], [west + 2 * inch, south + inch], [west + inch, south + 2 * inch]])
    coast = np.array([[west + 3 * inch, south], [west + 4 * inch, north]])
    kept = replace(
        plain, keep_outs=(ring,), margins=(ring + 0.1 * inch,), coast=(coast,), coast_label="coastline (mine)"
    )
    assert mission_preview(kept) != mission_preview(plain) != mission_preview(replace(plain, coast=(coast,)))
    view = view_of(kept)
    far = replace(kept, keep_outs=(ring, ring * 1.001))  # what reaches out of the map does not make it smaller
    assert view_of(far) == view == view_of(plain)
    with pytest.raises(ValueError, match="keep_outs has shape"):
        replace(kept, keep_outs=(ring.ravel(),))
    _, labels = legend_entries(view, kept, coast=True)
    assert {"kept out of", "margin", "coastline (mine)"} <= set(labels)
    _, labels = legend_entries(view, replace(kept, coast=None), coast=False)
    assert "its margin" in labels
    assert not {"kept out of", "margin"} & set(legend_entries(view, plain, coast=False)[1])
