"""A page of a picture: its figure, the axes of its maps, its bytes."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from sparsor.plot import style
from sparsor.plot.layout import DPI

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sparsor.plot.layout import Layout
    from sparsor.plot.view import View


def page_png(layout: Layout, title: str, draw: Callable[[Figure], None]) -> bytes:
    """Return a page as PNG, whatever the user's own settings of matplotlib are."""
    from matplotlib import style as matplotlib_style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib_style.context("default"):
        figure = Figure(figsize=(layout.width_in, layout.height_in), dpi=DPI, facecolor="white")
        draw(figure)
        stream = io.BytesIO()
        FigureCanvasAgg(figure)
        figure.savefig(stream, format="png", metadata={"Software": "sparsor", "Title": title})
    return stream.getvalue()


def map_axes(figure: Figure, layout: Layout, view: View) -> Axes:
    """Return the axes of a page's map, in degrees."""
    axes = layout.axes_in(figure, layout.map_left_in, layout.map_bottom_in, layout.map_width_in, layout.map_height_in)
    axes.axis("on")
    axes.set_facecolor(style.PAPER)
    axes.set(xlim=(view.west_deg, view.east_deg), ylim=(view.south_deg, view.north_deg))
    for edge in axes.spines.values():
        edge.set(linewidth=0.6, color=style.INK)
    return axes
