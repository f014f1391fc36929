"""The picture of a reconstructed map: the map, the way flown and the samples, and beside it how sure it is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.plot import furniture, ground, style
from sparsor.plot.layout import Layout, layout_of
from sparsor.plot.legend import legend_entries
from sparsor.plot.page import map_axes, page_png
from sparsor.plot.picture import MissionPicture
from sparsor.plot.view import view_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from sparsor.plot.legend import Handle
    from sparsor.plot.view import View

SAMPLE_APART_IN = 0.07  # of samples nearer to each other one is drawn
TRACK_APART_IN = 0.01
MOST_CELL_LINES = 64


@dataclass(frozen=True, eq=False)
class MapPicture:
    """A reconstructed map with what was flown for it.

    Points are rows of longitude and latitude, degrees. Cells are in the grid's order, row 0 northmost.

    Parameters
    ----------
    title : str
        The headline.
    box_deg : tuple of float
        West, south, east, north; west above east means across the antimeridian.
    east_m, north_m : float
        Width and height of the box, metres.
    values, standard_deviation : array of float64 (rows, cols)
        NaN where there is no value.
    label, unit : str
        What was measured, for the colour bars.
    tracks : tuple of arrays (n, 2)
        The ways flown, one a flight.
    samples : array (n, 2)
        Where the samples that the map is made from were taken.
    sample_values : array of float64 (n,)
        In the map's unit.
    left_out : array (n, 2)
        Where samples were taken that were not used.
    outside : array of bool (rows * cols,), optional
        Cells outside the area, greyed out.
    caption : tuple of str
        Lines beneath the maps.
    """

    title: str
    box_deg: tuple[float, float, float, float]
    east_m: float
    north_m: float
    values: NDArray[np.float64]
    standard_deviation: NDArray[np.float64]
    label: str
    unit: str
    tracks: tuple[NDArray[np.float64], ...]
    samples: NDArray[np.float64]
    sample_values: NDArray[np.float64]
    left_out: NDArray[np.float64]
    outside: NDArray[np.bool_] | None = None
    caption: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Panel:
    """One of the maps: what lies on the ground, how it is coloured, and whether the samples are on it."""

    ground: MissionPicture
    colour_map: str
    lowest: float | None
    samples: bool


def reconstruction_png(picture: MapPicture) -> bytes:
    """Draw the map and, beside it, its standard deviation; the same picture gives the same bytes.

    Returns
    -------
    bytes
        A PNG, 2800 pixels wide.
    """
    return _png(picture, (_map_panel(picture), _uncertainty_panel(picture)))


def map_png(picture: MapPicture) -> bytes:
    """Draw the map alone, 1400 pixels wide."""
    return _png(picture, (_map_panel(picture),))


def uncertainty_png(picture: MapPicture) -> bytes:
    """Draw the standard deviation alone, 1400 pixels wide."""
    return _png(picture, (_uncertainty_panel(picture),))


def _map_panel(picture: MapPicture) -> _Panel:
    return _Panel(_ground(picture, picture.values, picture.label), style.COLOUR_MAP, None, samples=True)


def _uncertainty_panel(picture: MapPicture) -> _Panel:
    spread = _ground(picture, picture.standard_deviation, "Standard deviation")
    return _Panel(spread, style.UNCERTAINTY_MAP, 0.0, samples=False)


def _ground(picture: MapPicture, values: NDArray[np.float64], label: str) -> MissionPicture:
    rows, columns = values.shape
    return MissionPicture(
        title=picture.title,
        box_deg=picture.box_deg,
        east_m=picture.east_m,
        north_m=picture.north_m,
        shape=(rows, columns),
        prior=values,
        prior_label=label,
        prior_unit=picture.unit,
        outside=picture.outside,
        caption=picture.caption,
    )


def _png(picture: MapPicture, panels: tuple[_Panel, ...]) -> bytes:
    # What was flown belongs on the map where it is near the box, as in the picture of a mission.
    flown = np.concatenate((*picture.tracks, picture.samples))
    view = view_of(replace(panels[0].ground, route=flown))
    layouts = [layout_of(panel.ground, view, maps=len(panels), place=place) for place, panel in enumerate(panels)]

    def draw(figure: Figure) -> None:
        for panel, layout in zip(panels, layouts, strict=True):
            _draw_panel(figure, layout, view, picture, panel)
        furniture.draw_words(figure, layouts[0])

    return page_png(layouts[0], picture.title, draw)


def _draw_panel(figure: Figure, layout: Layout, view: View, picture: MapPicture, panel: _Panel) -> None:
    axes = map_axes(figure, layout, view)
    coloured = ground.draw_prior(axes, view, panel.ground, colour_map=panel.colour_map, lowest=panel.lowest)
    assert coloured is not None
    ground.draw_outside(axes, view, panel.ground)
    if max(panel.ground.shape) <= MOST_CELL_LINES:
        ground.draw_cells(axes, view, panel.ground)
    coast = ground.draw_coast(axes, view, panel.ground)
    _draw_flown(axes, view, picture, panel, coloured[0])
    furniture.draw_graticule(axes, view)
    furniture.draw_north_and_scale(figure, layout, view)
    handles, labels = legend_entries(view, panel.ground, coast=coast, outside="outside the area")
    flown = _flown_entries(picture, panel)
    handles, labels = [*(handle for handle, _ in flown), *handles], [*(label for _, label in flown), *labels]
    furniture.draw_legend(figure, layout, handles, labels)
    furniture.draw_colour_bar(figure, layout, coloured, layout.colour_bar_in(len(labels)))
    axes.set(xlim=(view.west_deg, view.east_deg), ylim=(view.south_deg, view.north_deg))


def _draw_flown(axes: Axes, view: View, picture: MapPicture, panel: _Panel, coloured: ScalarMappable) -> None:
    for track in picture.tracks:
        lon, lat = view.unwrapped(track[_apart(view.inches(track), TRACK_APART_IN)]).T
        axes.plot(lon, lat, **style.TRACK_CASING)
        axes.plot(lon, lat, **style.TRACK)
    if panel.samples:
        _draw_samples(axes, view, picture, coloured)


def _draw_samples(axes: Axes, view: View, picture: MapPicture, coloured: ScalarMappable) -> None:
    shown = _apart(view.inches(picture.samples), SAMPLE_APART_IN)
    if shown.size:
        lon, lat = view.unwrapped(picture.samples[shown]).T
        values = picture.sample_values[shown] / 10.0 ** ground.power_of_ten(picture.values)
        axes.scatter(lon, lat, c=coloured.to_rgba(values), **style.SAMPLE)
    if len(picture.left_out):
        axes.plot(*view.unwrapped(picture.left_out).T, **style.LEFT_OUT)


def _apart(places_in: NDArray[np.float64], apart_in: float) -> NDArray[np.intp]:
    """Return the rows that are first in their square of a raster of that width, in order."""
    if not len(places_in):
        return np.zeros(0, dtype=np.intp)
    squares = np.floor(places_in / apart_in).astype(np.int64)
    moved = np.concatenate(([True], np.any(np.diff(squares, axis=0) != 0, axis=1)))
    return np.flatnonzero(moved)


def _flown_entries(picture: MapPicture, panel: _Panel) -> list[tuple[Handle, str]]:
    from matplotlib.lines import Line2D

    entries: list[tuple[Handle, str]] = []
    if picture.tracks:
        entries.append(((Line2D([], [], **style.TRACK_CASING), Line2D([], [], **style.TRACK)), "way flown"))
    if panel.samples:
        entries.append((Line2D([], [], **style.SAMPLE_ENTRY), f"{len(picture.samples)} samples"))
        if len(picture.left_out):
            entries.append((Line2D([], [], **style.LEFT_OUT), f"{len(picture.left_out)} left out"))
    return entries
