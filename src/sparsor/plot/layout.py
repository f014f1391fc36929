"""Where on the page the map, the column beside it and the words stand, in inches from its lower left."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.plot.view import MAP_WIDTH_IN

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sparsor.plot.picture import MissionPicture
    from sparsor.plot.view import View

DPI = 200
WIDTH_IN = 7.0
LABELS_IN = 0.72  # room for latitudes left of the map
COLUMN_IN = 1.5  # room for colour bar and legend right of it
LINE_IN = 0.142
LEGEND_LINE_IN = 0.155
HEAD_IN = 0.66  # of the column: north arrow and scale bar
TITLE_LINE_IN = 0.2
MAX_TITLE_LINES = 2
MAX_CAPTION_LINES = 10
TITLE_CHARACTERS = 68
CAPTION_CHARACTERS = 130


@dataclass(frozen=True)
class Layout:
    """The page: its size, the map's corners, the column, and the words cut into lines."""

    width_in: float
    height_in: float
    left_in: float
    map_left_in: float
    map_bottom_in: float
    map_width_in: float
    map_height_in: float
    title: tuple[str, ...]
    caption: tuple[str, ...]

    @property
    def map_top_in(self) -> float:
        """The map's upper edge."""
        return self.map_bottom_in + self.map_height_in

    @property
    def column_in(self) -> float:
        """The left edge of the column beside the map."""
        return self.map_left_in + self.map_width_in + 0.14

    def colour_bar_in(self, legend_entries: int) -> float:
        """Return the height that north arrow and legend leave to the colour bar, within reason."""
        legend_in = LEGEND_LINE_IN * legend_entries + 0.2
        return min(2.2, self.map_height_in - HEAD_IN - legend_in)

    def share(self, x_in: float, y_in: float) -> tuple[float, float]:
        """Return a place as shares of the page, as matplotlib wants it."""
        return x_in / self.width_in, y_in / self.height_in

    def axes_in(self, figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
        """Return new axes of a given place and size, with inches as units and nothing drawn."""
        axes = figure.add_axes((*self.share(left, bottom), *self.share(width, height)))
        axes.set(xlim=(0, width), ylim=(0, height))
        axes.axis("off")
        return axes


def layout_of(picture: MissionPicture, view: View, *, maps: int = 1, place: int = 0) -> Layout:
    """Return the layout for a view and the words around it; a narrow map stands in the middle of its room.

    Parameters
    ----------
    picture : MissionPicture
    view : View
    maps : int
        How many maps, each with its column, stand side by side on the page.
    place : int
        Which of them this is, from 0 at the left.
    """
    title = _lines((picture.title,), TITLE_CHARACTERS * maps, MAX_TITLE_LINES)
    caption = _lines(picture.caption, CAPTION_CHARACTERS * maps, MAX_CAPTION_LINES)
    bottom = 0.34 + (0.1 + LINE_IN * len(caption) if caption else 0.0)
    top = 0.22 + TITLE_LINE_IN * len(title)
    spare_in = MAP_WIDTH_IN - view.width_in
    return Layout(
        width_in=maps * WIDTH_IN,
        height_in=bottom + view.height_in + top,
        left_in=0.22,
        map_left_in=place * WIDTH_IN + LABELS_IN + spare_in / 2,
        map_bottom_in=bottom,
        map_width_in=view.width_in,
        map_height_in=view.height_in,
        title=title,
        caption=caption,
    )


def _lines(paragraphs: tuple[str, ...], characters: int, at_most: int) -> tuple[str, ...]:
    wrapped = [line for text in paragraphs for line in (textwrap.wrap(text, characters) or [""])]
    if len(wrapped) > at_most:
        wrapped = [*wrapped[: at_most - 1], textwrap.shorten(wrapped[at_most - 1] + " ...", characters)]
    return tuple(wrapped)
