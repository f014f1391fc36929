"""The legend's entries: what is on the map, drawn as it is there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.plot import style
from sparsor.plot.route import HOUSE, numbered_stops, sortie_style
from sparsor.plot.scales import length_label

if TYPE_CHECKING:
    from matplotlib.artist import Artist

    from sparsor.plot.picture import MissionPicture
    from sparsor.plot.view import View

    Handle = Artist | tuple[Artist, ...]

SAME_PLACE_IN = 0.02
WINDS = ("N", "NE", "E", "SE", "S", "SW", "W", "NW")


def legend_entries(
    view: View, picture: MissionPicture, *, coast: bool, outside: str = "not flown"
) -> tuple[list[Handle], list[str]]:
    """Return handles and labels of everything that the map of a picture shows; `outside` names greyed-out cells."""
    from matplotlib.patches import Patch

    entries: list[tuple[Handle, str]] = []
    if picture.route is not None:
        entries.append((_line(style.ROUTE_CASING, style.ROUTE), "route"))
    entries += _sortie_entries(len(picture.sorties))
    if picture.stops is not None:
        entries.append((_line(style.NUMBERED_STOP), _stops_label(view, picture)))
    if picture.transits:
        entries.append((_line(style.TRANSIT), "from and to home"))
    if picture.homes:
        entries.append((_home_handle(), _home_label(view, picture)))
    if picture.fence is not None:
        entries.append((_line(style.FENCE), "fence"))
    if picture.area:
        entries.append((_line(style.AREA), "area"))
    if picture.keep_outs:
        entries.append((Patch(**style.KEEP_OUT), "kept out of"))
    if picture.margins:
        entries.append((_line(style.KEPT_OFF), "its margin" if picture.coast is None else "margin"))
    if picture.outside is not None and picture.outside.any():
        entries.append((Patch(facecolor=style.GREYED_OUT, edgecolor=style.FAINT_INK, linewidth=0.4), outside))
    if coast:
        entries.append((_line({**style.COAST, "linewidth": 0.75}), picture.coast_label))
    return [handle for handle, _ in entries], [label for _, label in entries]


def _sortie_entries(count: int) -> list[tuple[Handle, str]]:
    """Return one entry a sortie, or a colour, where there are more sorties than colours."""
    colours = len(style.SORTIES)
    entries: list[tuple[Handle, str]] = []
    for first in range(min(count, colours)):
        numbers = [str(number + 1) for number in range(first, count, colours)]
        words = "sortie" if len(numbers) == 1 else "sorties"
        entries.append((_line(style.ROUTE_CASING, sortie_style(first)), f"{words} {', '.join(numbers)}"))
    return entries


def _line(*layers: style.Style) -> Handle:
    from matplotlib.lines import Line2D

    return tuple(Line2D([], [], **layer) for layer in layers)  # drawn one over the other


def _home_handle() -> Artist:
    from matplotlib.lines import Line2D
    from matplotlib.markers import MarkerStyle
    from matplotlib.path import Path

    return Line2D([], [], linestyle="none", marker=MarkerStyle(Path(HOUSE)), **style.HOME)


def _stops_label(view: View, picture: MissionPicture) -> str:
    count = 0 if picture.stops is None else len(picture.stops)
    every = picture.stops is None or len(numbered_stops(view.inches(picture.stops))) == count
    return f"{count} stops, in order" if every else f"{count} stops, some numbered"


def _home_label(view: View, picture: MissionPicture) -> str:
    """Say where home is when its symbol does not: at a stop, or off the map; of several how many there are."""
    if len(picture.homes) > 1:
        off = sum(not view.shows(np.array([one]))[0] for one in picture.homes)
        return f"{len(picture.homes)} homes" + (f", {off} off the map" if off else "")
    home = np.array(picture.homes, dtype=np.float64)
    place = view.inches(home)[0]
    if picture.stops is not None and len(picture.stops):
        apart = np.hypot(*(view.inches(picture.stops) - place).T)
        if apart.min() < SAME_PLACE_IN:
            return f"home, at stop {int(apart.argmin()) + 1}"
    if view.shows(home)[0]:
        return "home"
    east, north = place - np.array([view.width_in, view.height_in]) / 2
    length_m = float(np.hypot(east, north)) * view.m_per_inch
    wind = WINDS[round(float(np.degrees(np.arctan2(east, north))) / 45) % 8]
    return f"home: {length_label(float(f'{length_m:.2g}'))} {wind}, off the map"
