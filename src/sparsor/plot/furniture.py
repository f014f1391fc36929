"""What stands around the map: degrees along its edges, north arrow, scale bar, colour bar, legend, words."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, cast

import numpy as np

from sparsor.plot import style
from sparsor.plot.layout import DPI, HEAD_IN
from sparsor.plot.scales import degree_label, graticule, length_label, multiples, scale_bar_m

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure
    from matplotlib.text import Text
    from numpy.typing import NDArray

    from sparsor.plot.layout import Layout
    from sparsor.plot.legend import Handle
    from sparsor.plot.view import View

    Degrees = NDArray[np.float64]

CHARACTER_IN = 0.06  # of the labels along the map's edges, with the gap between two labels and the least room
LABEL_GAP_IN = 0.16
NO_BREAK = "\N{NO-BREAK SPACE}"
LATITUDE_ROOM_IN = 0.42
FEWEST = 3  # intervals along a side
LONGEST_BAR_IN = 0.85


def draw_graticule(axes: Axes, view: View) -> None:
    """Draw meridians and parallels at round degrees, with their labels outside the map."""
    lon, lat, lon_step, lat_step = graticule_lines(view)
    axes.set_xticks(lon, [degree_label(value, lon_step, "lon") for value in lon])
    axes.set_yticks(lat, [degree_label(value, lat_step, "lat") for value in lat])
    axes.tick_params(labelsize=6.5, length=2.5, width=0.6, pad=2, colors=style.INK)
    axes.grid(visible=True, **style.GRATICULE)


def graticule_lines(view: View) -> tuple[Degrees, Degrees, float, float]:
    """Return round longitudes and latitudes whose labels fit, and their steps; one for both if it will do."""
    lon, lon_step = _longitudes(view)
    most = max(2, int(view.height_in / LATITUDE_ROOM_IN))
    lat, lat_step = graticule(view.south_deg, view.north_deg, most)
    if lat_step < lon_step and (view.north_deg - view.south_deg) / lon_step >= FEWEST:
        lat, lat_step = multiples(view.south_deg, view.north_deg, lon_step), lon_step
    return lon, lat[np.abs(lat) <= 90.0], lon_step, lat_step


def _longitudes(view: View) -> tuple[Degrees, float]:
    """Return the finest round longitudes whose labels, side by side, do not touch."""
    span = view.east_deg - view.west_deg
    for most in range(10, 2, -1):
        lon, step = graticule(view.west_deg, view.east_deg, most)
        longest = max((len(degree_label(value, step, "lon")) for value in lon), default=0)
        if step / span * view.width_in >= longest * CHARACTER_IN + LABEL_GAP_IN:
            return lon, step
    return graticule(view.west_deg, view.east_deg, 2)


def draw_north_and_scale(figure: Figure, layout: Layout, view: View) -> None:
    """Draw the north arrow and the scale bar at the head of the column beside the map."""
    axes = layout.axes_in(figure, layout.column_in, layout.map_top_in - 0.42, 1.5, 0.42)
    axes.annotate(
        "",
        (0.07, 0.42),
        xytext=(0.07, 0.02),
        arrowprops={
            "arrowstyle": "-|>,head_width=0.28,head_length=0.5",
            "color": style.INK,
            "linewidth": 1.0,
            "shrinkA": 0,
            "shrinkB": 0,
        },
    )
    axes.text(0.16, 0.3, "N", fontsize=8, fontweight="bold", color=style.INK, va="center")
    length_m, length_in = scale_bar(view)
    left, middle, right = 0.42, 0.42 + length_in / 2, 0.42 + length_in
    axes.fill_between((left, middle), 0.06, 0.11, facecolor=style.INK, edgecolor=style.INK, linewidth=0.6)
    axes.fill_between((middle, right), 0.06, 0.11, facecolor="white", edgecolor=style.INK, linewidth=0.6)
    axes.text(left, 0.15, "0", fontsize=6.5, ha="center", color=style.INK)
    axes.text(right, 0.15, length_label(length_m), fontsize=6.5, ha="center", color=style.INK)


def scale_bar(view: View) -> tuple[float, float]:
    """Return the length of the scale bar on the ground, metres, and on the picture, inches."""
    length_m = scale_bar_m(LONGEST_BAR_IN * view.m_per_inch)
    return length_m, length_m / view.m_per_inch


def draw_colour_bar(figure: Figure, layout: Layout, prior: tuple[ScalarMappable, str, str], height_in: float) -> None:
    """Draw the colour bar of a prior's colours with its label and unit along it."""
    from matplotlib.ticker import ScalarFormatter

    mappable, label, unit = prior
    axes = layout.axes_in(figure, layout.column_in, layout.map_top_in - HEAD_IN - height_in, 0.14, height_in)
    axes.axis("on")
    bar = figure.colorbar(mappable, cax=axes, format=ScalarFormatter(useOffset=False))
    bar.outline.set_linewidth(0.5)
    axes.tick_params(labelsize=6.5, length=2.5, width=0.6, pad=2, colors=style.INK)
    room = int(height_in / CHARACTER_IN)
    words = textwrap.fill(f"{label} {unit.replace(' ', NO_BREAK)}".strip(), room)
    axes.set_ylabel(words, fontsize=7, color=style.INK, parse_math=False, labelpad=4)


def draw_legend(figure: Figure, layout: Layout, handles: list[Handle], labels: list[str]) -> None:
    """Draw the legend at the foot of the column beside the map."""
    legend = figure.legend(
        cast("list[Artist]", handles),  # tuples are drawn one over the other, which the stubs do not know
        labels,
        loc="lower left",
        bbox_to_anchor=layout.share(layout.column_in, layout.map_bottom_in),
        borderaxespad=0,
        borderpad=0,
        frameon=False,
        fontsize=6.5,
        labelcolor=style.INK,
        handlelength=2.2,
        labelspacing=0.65,
    )
    for text in legend.get_texts():
        text.set_parse_math(False)


def draw_words(figure: Figure, layout: Layout) -> None:
    """Write the headline above the map and the caption beneath it."""
    top = layout.share(layout.left_in, layout.height_in - 0.12)
    title = figure.text(*top, "\n".join(layout.title), fontsize=11, fontweight="bold", va="top")
    beneath = layout.share(layout.left_in, layout.map_bottom_in - 0.34)
    caption = figure.text(*beneath, "\n".join(layout.caption), fontsize=7, va="top", linespacing=1.45)
    for text in (title, caption):
        text.set(color=style.INK, parse_math=False)
        _fit(text, layout.width_in - 2 * layout.left_in)


def _fit(text: Text, width_in: float) -> None:
    """Make the letters smaller when a line of wide ones would leave the page."""
    needed_in = text.get_window_extent().width / DPI
    if needed_in > width_in:
        text.set_fontsize(float(text.get_fontsize()) * width_in / needed_in)
