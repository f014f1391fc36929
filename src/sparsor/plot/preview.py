"""The picture of a mission, for a report: the map it expects, the route over it, and where that is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.plot import furniture, ground
from sparsor.plot.layout import layout_of
from sparsor.plot.legend import legend_entries
from sparsor.plot.page import map_axes, page_png
from sparsor.plot.route import draw_home, draw_route, draw_stops, draw_transit, sortie_style
from sparsor.plot.view import view_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sparsor.plot.layout import Layout
    from sparsor.plot.picture import MissionPicture
    from sparsor.plot.view import View


def mission_preview(picture: MissionPicture) -> bytes:
    """Draw a mission; the same picture gives the same bytes.

    Parameters
    ----------
    picture : MissionPicture
        What is drawn.

    Returns
    -------
    bytes
        A PNG, 1400 pixels wide and about 1200 high.
    """
    view = view_of(picture)
    layout = layout_of(picture, view)
    return page_png(layout, picture.title, lambda figure: _draw(figure, layout, view, picture))


def _draw(figure: Figure, layout: Layout, view: View, picture: MissionPicture) -> None:
    axes = map_axes(figure, layout, view)
    prior = ground.draw_prior(axes, view, picture)
    ground.draw_outside(axes, view, picture)
    ground.draw_cells(axes, view, picture)
    coast = ground.draw_coast(axes, view, picture)
    ground.draw_outlines(axes, view, picture)
    _draw_flight(axes, view, picture)
    furniture.draw_graticule(axes, view)
    furniture.draw_north_and_scale(figure, layout, view)
    handles, labels = legend_entries(view, picture, coast=coast)
    furniture.draw_legend(figure, layout, handles, labels)
    if prior is not None:
        furniture.draw_colour_bar(figure, layout, prior, layout.colour_bar_in(len(labels)))
    furniture.draw_words(figure, layout)
    # imshow and plot move the limits; the view decides.
    axes.set(xlim=(view.west_deg, view.east_deg), ylim=(view.south_deg, view.north_deg))


def _draw_flight(axes: Axes, view: View, picture: MissionPicture) -> None:
    for transit in picture.transits:
        draw_transit(axes, view, transit)
    if picture.route is not None and len(picture.route):
        draw_route(axes, view, picture.route)
    for number, sortie in enumerate(picture.sorties):
        draw_route(axes, view, sortie, sortie_style(number))
    if picture.stops is not None and len(picture.stops):
        draw_stops(axes, view, picture.stops)
    for home in picture.homes:
        draw_home(axes, view, picture, home)
