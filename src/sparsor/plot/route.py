"""The route on the map: its lines, arrows, stops, their numbers, and home."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.plot import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from sparsor.plot.picture import MissionPicture
    from sparsor.plot.view import View

ALL_NUMBERED = 30  # up to so many stops each shows its number
ARROW_EVERY_IN = 0.28
SHORTEST_LEG_IN = 0.09
NUMBER_IN = 0.1  # numbers nearer to each other than this would touch
ASIDE_IN = 0.17
HOUSE = (
    (-0.5, -0.5),
    (-0.5, 0.1),
    (-0.68, 0.1),
    (0.0, 0.75),
    (0.68, 0.1),
    (0.5, 0.1),
    (0.5, -0.5),
    (-0.5, -0.5),
)
ARROW = ((0.0, 0.6), (0.42, -0.45), (0.0, -0.22), (-0.42, -0.45), (0.0, 0.6))


def draw_route(axes: Axes, view: View, route: NDArray[np.float64], how: style.Style = style.ROUTE) -> None:
    """Draw the path over the stops, with arrows in its direction."""
    lon, lat = view.unwrapped(route).T
    axes.plot(lon, lat, **style.ROUTE_CASING)
    axes.plot(lon, lat, **how)
    for place, angle_deg in arrows(view.inches(route)):
        draw_symbol(axes, view, place, ARROW, style.ARROW, turned_deg=angle_deg)


def sortie_style(number: int) -> style.Style:
    """Return how the path of a sortie is drawn, counted from 0."""
    return {**style.ROUTE, "color": style.SORTIES[number % len(style.SORTIES)]}


def draw_transit(axes: Axes, view: View, transit: NDArray[np.float64]) -> None:
    """Draw a way to or from home."""
    lon, lat = view.unwrapped(transit).T
    axes.plot(lon, lat, **style.TRANSIT_CASING)
    axes.plot(lon, lat, **style.TRANSIT)


def draw_stops(axes: Axes, view: View, stops: NDArray[np.float64]) -> None:
    """Draw every stop, and the numbers for which there is room."""
    lon, lat = view.unwrapped(stops).T
    axes.plot(lon, lat, **style.STOP)
    numbered = numbered_stops(view.inches(stops))
    axes.plot(lon[numbered], lat[numbered], **style.NUMBERED_STOP)
    for index in numbered:
        number = str(index + 1)
        axes.annotate(
            number,
            (lon[index], lat[index]),
            xytext=(0, -0.3),
            textcoords="offset points",
            fontsize=5.4 if len(number) < 3 else 4.3,
            **style.NUMBER,
        )


def draw_home(axes: Axes, view: View, picture: MissionPicture, home: tuple[float, float]) -> None:
    """Draw home; an only one beside a stop that is in its place, clear of all lines and inside the fence."""
    place = view.inches([home])[0]
    stops = np.empty((0, 2)) if picture.stops is None else view.inches(picture.stops)
    if len(picture.homes) == 1 and len(stops) and np.hypot(*(stops - place).T).min() < ASIDE_IN * 0.7:
        lines = [
            view.inches(np.vstack((points, points[:1])) if name in ("fence", "area") else points)
            for name, points in picture.outlines()
        ]
        place = _aside(place, lines, None if picture.fence is None else view.inches(picture.fence))
    draw_symbol(axes, view, place, HOUSE, style.HOME)


def draw_symbol(
    axes: Axes,
    view: View,
    place_in: NDArray[np.float64],
    outline: tuple[tuple[float, float], ...],
    how: style.Style,
    *,
    turned_deg: float = 0.0,
) -> None:
    """Draw a small closed outline at a place on the map, turned clockwise from north."""
    from matplotlib.markers import MarkerStyle
    from matplotlib.path import Path
    from matplotlib.transforms import Affine2D

    lon, lat = view.degrees(place_in)
    marker = MarkerStyle(Path(outline), transform=Affine2D().rotate_deg(-turned_deg))
    axes.plot([lon], [lat], marker=marker, **how)


def arrows(path_in: NDArray[np.float64]) -> list[tuple[NDArray[np.float64], float]]:
    """Return where along a path arrows go, and their direction in degrees clockwise from north.

    Parameters
    ----------
    path_in : array (n, 2)
        The path, inches on the map.
    """
    found = []
    since = ARROW_EVERY_IN  # so that the first leg has one
    for start, step in zip(path_in[:-1], np.diff(path_in, axis=0), strict=True):
        length = float(np.hypot(*step))
        if length >= SHORTEST_LEG_IN and since + length / 2 >= ARROW_EVERY_IN:
            found.append((start + 0.5 * step, float(np.degrees(np.arctan2(step[0], step[1])))))
            since = length / 2
        else:
            since += length
    return found


def numbered_stops(stops_in: NDArray[np.float64]) -> list[int]:
    """Return the indices of the stops that show their number: first and last, then whichever fit.

    Up to 30 stops all of them are candidates, then every 5th, from 150 on every 10th.

    Parameters
    ----------
    stops_in : array (n, 2)
        The stops in flight order, inches on the map.
    """
    count = len(stops_in)
    every = 1 if count <= ALL_NUMBERED else 5 if count < 150 else 10
    wanted = [0, count - 1, *range(every - 1, count, every)]
    kept: list[int] = []
    for index in dict.fromkeys(wanted):
        apart = np.hypot(*(stops_in[kept] - stops_in[index]).T)
        if not np.any(apart < NUMBER_IN):
            kept.append(index)
    return sorted(kept)


def _aside(
    place: NDArray[np.float64], lines: list[NDArray[np.float64]], fence: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Return the place, of eight around one, with most room between the lines; inside the fence if any is."""
    from matplotlib.path import Path

    angles = np.arange(8) * np.pi / 4
    around = place + ASIDE_IN * np.column_stack((np.sin(angles), np.cos(angles)))
    share = np.linspace(0, 1, 65)[:, None, None]  # many points on each leg, since a long one may pass close by
    points = np.concatenate([(line[:-1] + share * np.diff(line, axis=0)).reshape(-1, 2) for line in lines])
    apart = around[:, None] - points[None]
    room = np.hypot(apart[..., 0], apart[..., 1]).min(axis=1, initial=np.inf)
    inside = np.ones(8, dtype=bool) if fence is None else Path(fence).contains_points(around)
    best = int(np.argmax(np.where(inside | ~inside.any(), room, -1.0)))
    return np.asarray(around[best], dtype=np.float64)
