"""Curves of the study: several panels of one quantity against another."""

from __future__ import annotations

import io
import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.plot import style
from sparsor.plot.layout import DPI

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito's; with the markers no line is told by its colour alone.
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#1a1a1a", "#e69f00", "#56b4e9", "#7f7f7f")
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
_LINES = ("-", "--", ":")
_PANEL_IN, _PANEL_HEIGHT_IN, _LEAST_WIDTH_IN = 4.4, 3.9, 6.0
_LEFT_IN, _BELOW_IN, _ABOVE_IN, _HEAD_IN = 0.75, 0.55, 0.3, 0.45
_LEGEND_LINE_IN, _LINE_IN = 0.19, 0.14
_CHARACTERS_AN_IN, _LEGEND_CHARACTERS_AN_IN = 18, 15
_ACROSS = 2


@dataclass(frozen=True)
class Series:
    """One line.

    Parameters
    ----------
    label : str
        Lines of one label look alike in all panels.
    across, up : tuple of float
    spread : tuple of float, optional
        Standard deviation of `up`, shaded.
    """

    label: str
    across: tuple[float, ...]
    up: tuple[float, ...]
    spread: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Panel:
    """Lines over common axes.

    Parameters
    ----------
    title, across, up : str
        And what the axes are, with their units.
    series : tuple of Series
    logarithmic : bool
        Of the axis that goes up.
    stretched : bool
        Whether the axis across is linear near zero and logarithmic beyond.
    """

    title: str
    across: str
    up: str
    series: tuple[Series, ...]
    logarithmic: bool = False
    stretched: bool = False


def curves_png(title: str, panels: tuple[Panel, ...], caption: str = "") -> bytes:
    """Draw panels, two a line; the same ones give the same bytes.

    Returns
    -------
    bytes
        A PNG.
    """
    from matplotlib import style as matplotlib_style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    labels = list(dict.fromkeys(one.label for panel in panels for one in panel.series))
    across = min(len(panels), _ACROSS)
    width = max(_PANEL_IN * across, _LEAST_WIDTH_IN)
    words = textwrap.wrap(caption, int(width * _CHARACTERS_AN_IN))
    entries = max(1, int((width - 0.3) / (max(map(len, labels), default=1) / _LEGEND_CHARACTERS_AN_IN + 0.55)))
    foot = 0.15 + _LINE_IN * len(words) + _LEGEND_LINE_IN * -(-len(labels) // entries)
    lines = -(-len(panels) // across)
    height = _HEAD_IN + lines * _PANEL_HEIGHT_IN + foot
    with matplotlib_style.context("default"):
        figure = Figure(figsize=(width, height), dpi=DPI, facecolor="white")
        figure.text(0.15 / width, 1 - 0.2 / height, title, fontsize=11, fontweight="bold", color=style.INK, va="center")
        for k, panel in enumerate(panels):
            left = (k % across) * width / across + _LEFT_IN
            bottom = foot + (lines - 1 - k // across) * _PANEL_HEIGHT_IN + _BELOW_IN
            size = (width / across - _LEFT_IN - 0.2, _PANEL_HEIGHT_IN - _BELOW_IN - _ABOVE_IN)
            place = (left / width, bottom / height, size[0] / width, size[1] / height)
            _draw(figure.add_axes(place), panel, labels)
        handles = {one.get_label(): one for axes in figure.axes for one in axes.get_lines()}
        figure.legend(
            [handles[label] for label in labels],
            labels,
            loc="lower left",
            bbox_to_anchor=(0.05 / width, (0.06 + _LINE_IN * len(words)) / height),
            ncols=entries,
            fontsize=7.5,
            frameon=False,
        )
        for k, line in enumerate(reversed(words)):
            figure.text(0.15 / width, (0.08 + _LINE_IN * k) / height, line, fontsize=6.5, color=style.FAINT_INK)
        stream = io.BytesIO()
        FigureCanvasAgg(figure)
        figure.savefig(stream, format="png", metadata={"Software": "sparsor", "Title": title})
    return stream.getvalue()


def _draw(axes: Axes, panel: Panel, labels: list[str]) -> None:
    for one in panel.series:
        look = labels.index(one.label)
        colour = _COLOURS[look % len(_COLOURS)]
        marker = _MARKERS[look % len(_MARKERS)]
        again = look // len(_COLOURS)  # after the last colour from the first one, dashed and with open markers
        axes.plot(
            one.across,
            one.up,
            color=colour,
            linestyle=_LINES[again % len(_LINES)],
            marker=marker,
            markersize=4.5,
            markerfacecolor="white" if again else colour,
            linewidth=1.3,
            label=one.label,
        )
        if one.spread is not None:
            low = [up - by for up, by in zip(one.up, one.spread, strict=True)]
            high = [up + by for up, by in zip(one.up, one.spread, strict=True)]
            axes.fill_between(one.across, low, high, color=colour, alpha=0.18, linewidth=0)
    axes.set_title(panel.title, fontsize=9, loc="left", color=style.INK)
    axes.set_xlabel(panel.across, fontsize=8)
    axes.set_ylabel(panel.up, fontsize=8)
    _scale(axes, panel)
    axes.tick_params(which="both", labelsize=7, width=0.6)
    axes.grid(visible=True, which="both", color=style.INK, alpha=0.12, linewidth=0.5)


def _scale(axes: Axes, panel: Panel) -> None:
    from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator

    plain = FuncFormatter(lambda value, _place: f"{value:g}")
    if panel.logarithmic:
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)))
        axes.yaxis.set_major_formatter(plain)
        axes.yaxis.set_minor_formatter(NullFormatter())
    else:
        axes.set_ylim(bottom=0)
    if panel.stretched:
        values = sorted({x for one in panel.series for x in one.across})
        least = min((x for x in values if x > 0), default=1.0)
        axes.set_xscale("symlog", linthresh=least)
        axes.set_xlim(-0.3 * least, 1.3 * max(values[-1], least))
        axes.xaxis.set_major_locator(FixedLocator(values))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(plain)
