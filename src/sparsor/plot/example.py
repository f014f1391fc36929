"""A map, the routes over it and what is reconstructed from them, side by side."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.plot import style
from sparsor.plot.layout import DPI

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

_SIDE_IN, _GAP_IN, _HEAD_IN, _FOOT_IN, _BAR_IN = 2.9, 0.35, 0.95, 0.45, 0.9


@dataclass(frozen=True)
class ExampleMap:
    """One map on the grid.

    Parameters
    ----------
    title : str
    values : array of float64 (rows, columns)
    stops : array of int64 (n,), optional
        Of a route over it, in order.
    """

    title: str
    values: NDArray[np.float64]
    stops: NDArray[np.int64] | None = None


def example_png(title: str, maps: tuple[ExampleMap, ...], label: str) -> bytes:
    """Draw maps side by side in one range of colours, routes over them; the same ones give the same bytes.

    Parameters
    ----------
    title : str
    maps : tuple of ExampleMap
    label : str
        Of the values, with their unit.
    """
    from matplotlib import style as matplotlib_style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    width = len(maps) * (_SIDE_IN + _GAP_IN) + _GAP_IN + _BAR_IN
    height = _SIDE_IN + _HEAD_IN + _FOOT_IN
    low, high = (float(f([f(one.values) for one in maps])) for f in (np.min, np.max))
    with matplotlib_style.context("default"):
        figure = Figure(figsize=(width, height), dpi=DPI, facecolor="white")
        figure.text(
            0.35 / width, 1 - 0.22 / height, title, fontsize=11, fontweight="bold", color=style.INK, va="center"
        )
        image = None
        for k, one in enumerate(maps):
            left = _GAP_IN + k * (_SIDE_IN + _GAP_IN)
            axes = figure.add_axes((left / width, _FOOT_IN / height, _SIDE_IN / width, _SIDE_IN / height))
            image = axes.imshow(one.values, cmap=style.COLOUR_MAP, vmin=low, vmax=high, interpolation="nearest")
            _dress(axes, one)
        assert image is not None
        bar = (len(maps) * (_SIDE_IN + _GAP_IN) + _GAP_IN) / width
        legend = figure.add_axes((bar, _FOOT_IN / height, 0.14 / width, _SIDE_IN / height))
        figure.colorbar(image, cax=legend).set_label(label, fontsize=8)
        legend.tick_params(labelsize=7)
        stream = io.BytesIO()
        FigureCanvasAgg(figure)
        figure.savefig(stream, format="png", metadata={"Software": "sparsor", "Title": title})
    return stream.getvalue()


def _dress(axes: Axes, one: ExampleMap) -> None:
    axes.set_title(one.title, fontsize=8, loc="left", color=style.INK)
    axes.tick_params(labelsize=6.5, width=0.6)
    axes.set_xlabel("column", fontsize=7)
    axes.set_ylabel("row", fontsize=7, labelpad=1)
    if one.stops is not None:
        row, column = np.divmod(one.stops, one.values.shape[1])
        axes.plot(column, row, **style.ROUTE_CASING)
        axes.plot(column, row, **style.ROUTE)
        axes.plot(column, row, **style.STOP)
