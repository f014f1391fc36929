"""The picture of the curve that a user chooses a budget by."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.plot import style
from sparsor.plot.layout import DPI, WIDTH_IN

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HEIGHT_IN = 4.6
_ROOM = 1.12  # above and to the right of the points
_CAPTION = (
    "Error: |s - s'| / |s - mean(s)|, mean over validation maps; 0 is perfect, 1 no better than the map's mean. "
    "Nothing here says that a flight is legal or safe."
)


@dataclass(frozen=True)
class BudgetCurve:
    """Flights of several lengths over one box.

    Parameters
    ----------
    title : str
    path_km, error, minutes : tuple of float
        Of each flight, the shortest first: path over the stops, expected error, time in the air.
    flyable : tuple of bool
        Whether the vehicle's endurance, less its reserve, allows it.
    chosen : int
        Which of them was planned.
    full_coverage_km : float
    vehicle : str
        Its name.
    usable_min : float
        Its endurance less the reserve.
    """

    title: str
    path_km: tuple[float, ...]
    error: tuple[float, ...]
    minutes: tuple[float, ...]
    flyable: tuple[bool, ...]
    chosen: int
    full_coverage_km: float
    vehicle: str
    usable_min: float


def budget_curve_png(curve: BudgetCurve) -> bytes:
    """Draw expected error against path length; the same curve gives the same bytes.

    Returns
    -------
    bytes
        A PNG, 1400 pixels wide.
    """
    from matplotlib import style as matplotlib_style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib_style.context("default"):
        figure = Figure(figsize=(WIDTH_IN, _HEIGHT_IN), dpi=DPI, facecolor="white")
        axes = figure.add_axes((0.1, 0.16, 0.86, 0.66))
        figure.text(0.03, 0.95, curve.title, fontsize=11, fontweight="bold", color=style.INK, va="center")
        figure.text(0.03, 0.025, _CAPTION, fontsize=6, color=style.FAINT_INK)
        _draw(axes, curve)
        stream = io.BytesIO()
        FigureCanvasAgg(figure)
        figure.savefig(stream, format="png", metadata={"Software": "sparsor", "Title": curve.title})
    return stream.getvalue()


def _draw(axes: Axes, curve: BudgetCurve) -> None:
    axes.set(xlim=(0, _ROOM * max(curve.path_km)), ylim=(0, _ROOM * max(curve.error)))
    axes.plot(curve.path_km, curve.error, color=style.FAINT_INK, linewidth=1.0, zorder=2)
    kinds = (
        (True, "o", "white", f"within {curve.usable_min:.0f} min, the {curve.vehicle}'s endurance less its reserve"),
        (False, "X", style.FAINT_INK, "longer: a planning study"),
    )
    for flyable, marker, face, label in kinds:
        rows = [row for row, one in enumerate(curve.flyable) if one == flyable]
        if rows:
            axes.plot(
                [curve.path_km[row] for row in rows],
                [curve.error[row] for row in rows],
                marker,
                markersize=6.5,
                markerfacecolor=face,
                markeredgecolor=style.INK,
                label=label,
                zorder=3,
            )
    chosen = (curve.path_km[curve.chosen], curve.error[curve.chosen])
    axes.plot(*chosen, "o", markersize=13, fillstyle="none", color=style.VERMILLION, label="planned", zorder=4)
    for length, error, minutes in zip(curve.path_km, curve.error, curve.minutes, strict=True):
        axes.annotate(
            f"{minutes:.0f} min", (length, error), (6, 8), textcoords="offset points", fontsize=7, color=style.INK
        )
    axes.set_xlabel("path over the stops, km", fontsize=8)
    axes.set_ylabel("expected error, share of the map's contrast", fontsize=8)
    share = axes.twiny()
    share.set_xlim(0, 100 * axes.get_xlim()[1] / curve.full_coverage_km)
    share.set_xlabel("of full coverage, %", fontsize=8)
    for one in (axes, share):
        one.tick_params(labelsize=7, width=0.6)
    axes.grid(visible=True, color=style.INK, alpha=0.12, linewidth=0.5)
    axes.legend(fontsize=7, frameon=False, loc="upper right")
