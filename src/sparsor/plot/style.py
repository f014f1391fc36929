"""Colours and line styles of the pictures, for matplotlib's keyword arguments.

The colour map is perceptually uniform and safe for colour-blind readers; lines over it are white in a dark
casing, or dark in a white one, so that they stand out at both of its ends. Accents are Okabe and Ito's.
"""

from __future__ import annotations

from typing import Any

Style = dict[str, Any]

COLOUR_MAP = "viridis"
UNCERTAINTY_MAP = "magma"
PAPER = "#f3f3f0"
INK = "#1a1a1a"
FAINT_INK = "#5a5a5a"
VERMILLION = "#d55e00"
GREYED_OUT = (0.87, 0.87, 0.86, 0.93)
NO_VALUE = "#c8c8c8"

ROUTE_CASING: Style = {"color": INK, "linewidth": 2.3, "solid_joinstyle": "round", "zorder": 5}
ROUTE: Style = {"color": "white", "linewidth": 1.2, "solid_joinstyle": "round", "zorder": 5.1}
# Of sorties, in turn: Okabe and Ito's that stand out on the colour map, white first.
SORTIES = ("white", "#e69f00", "#cc79a7", "#56b4e9")
ARROW: Style = {
    "markersize": 7,
    "markerfacecolor": "white",
    "markeredgecolor": INK,
    "markeredgewidth": 0.6,
    "zorder": 5.2,
}
TRANSIT_CASING: Style = {"color": "white", "linewidth": 1.9, "zorder": 4}
TRANSIT: Style = {"color": INK, "linewidth": 0.9, "dashes": (1.2, 1.6), "zorder": 4.1}
STOP: Style = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 3.2,
    "markerfacecolor": "white",
    "markeredgecolor": INK,
    "markeredgewidth": 0.7,
    "zorder": 6,
}
NUMBERED_STOP: Style = {**STOP, "markersize": 8.3, "zorder": 6.1}
NUMBER: Style = {"ha": "center", "va": "center", "color": INK, "zorder": 6.2, "annotation_clip": True}
HOME: Style = {
    "markersize": 10,
    "markerfacecolor": VERMILLION,
    "markeredgecolor": "white",
    "markeredgewidth": 0.8,
    "zorder": 7,
}
TRACK_CASING: Style = {"color": INK, "linewidth": 2.2, "solid_joinstyle": "round", "zorder": 5}
TRACK: Style = {"color": "white", "linewidth": 1.2, "solid_joinstyle": "round", "zorder": 5.1}
SAMPLE: Style = {"s": 9, "edgecolors": "white", "linewidths": 0.5, "zorder": 6}
SAMPLE_ENTRY: Style = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 3.4,
    "markerfacecolor": FAINT_INK,
    "markeredgecolor": "white",
    "markeredgewidth": 0.5,
}
LEFT_OUT: Style = {
    "linestyle": "none",
    "marker": "x",
    "markersize": 4.2,
    "markeredgecolor": VERMILLION,
    "markeredgewidth": 1.1,
    "zorder": 6.1,
}
FENCE: Style = {"color": VERMILLION, "linewidth": 1.1, "dashes": (5, 2.5), "zorder": 3.5}
KEEP_OUT: Style = {
    "facecolor": (0.84, 0.37, 0.0, 0.22),
    "edgecolor": VERMILLION,
    "linewidth": 1.1,
    "hatch": "//",
    "zorder": 3.3,
}
KEPT_OFF: Style = {"color": VERMILLION, "linewidth": 0.7, "dashes": (1.5, 1.5), "zorder": 3.4}
AREA_CASING: Style = {"color": "white", "linewidth": 2.0, "zorder": 3}
AREA: Style = {"color": INK, "linewidth": 1.0, "zorder": 3.1}
BOX: Style = {"color": INK, "linewidth": 0.7, "zorder": 2.9}
COAST_CASING: Style = {"color": "white", "alpha": 0.5, "zorder": 2.5}
COAST: Style = {"color": "#12263a", "zorder": 2.6}
CELLS: Style = {"colors": "white", "linewidths": 0.3, "alpha": 0.22, "zorder": 2}
GRATICULE: Style = {"color": INK, "linewidth": 0.35, "alpha": 0.3, "linestyle": (0, (1, 2)), "zorder": 2.2}
