"""The picture of a flight over the ground: how high it is, and how high the ground, along the way."""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.plot import style
from sparsor.plot.layout import DPI, WIDTH_IN

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

_HEIGHT_IN = 3.9
_ROOM = 0.06  # of the heights, above and below them
_GROUND = "#b8a78a"
_CAPTION = (
    "Heights above home's ground, by the elevation model: no trees, buildings, wires. Nothing here says that a flight "
    "is legal or safe."
)


@dataclass(frozen=True, eq=False)
class HeightProfile:
    """A flight over the ground, from the end of its take-off to the beginning of its landing.

    Parameters
    ----------
    title : str
    along_km : array of float64 (n,)
        Way flown.
    ground_m, least_m, flown_m : arrays of float64 (n,)
        Above the ground at home: the ground below, the lowest that may be flown, what is flown.
    stops_km, stops_m : arrays of float64 (k,)
        The stops.
    turns_km, turns_m : arrays of float64 (j,)
        The waypoints that are there for the heights only.
    height_m : float
        Wanted above the ground.
    """

    title: str
    along_km: NDArray[np.float64]
    ground_m: NDArray[np.float64]
    least_m: NDArray[np.float64]
    flown_m: NDArray[np.float64]
    stops_km: NDArray[np.float64]
    stops_m: NDArray[np.float64]
    turns_km: NDArray[np.float64]
    turns_m: NDArray[np.float64]
    height_m: float


def height_profile_png(profile: HeightProfile) -> bytes:
    """Draw heights along a flight; the same profile gives the same bytes.

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
        axes = figure.add_axes((0.07, 0.29, 0.915, 0.61))
        _draw(axes, profile)
        figure.text(
            0.07,
            0.94,
            f"{profile.title}: {profile.height_m:g} m above the ground, along the flight",
            fontsize=10,
            color=style.INK,
        )
        figure.text(0.07, 0.03, _CAPTION, fontsize=7, color=style.INK)
        stream = io.BytesIO()
        FigureCanvasAgg(figure)
        figure.savefig(stream, format="png", metadata={"Software": "sparsor", "Title": profile.title})
    return stream.getvalue()


def _draw(axes: Axes, profile: HeightProfile) -> None:
    low, high = float(profile.ground_m.min()), float(profile.flown_m.max())
    spare = _ROOM * (high - low)
    axes.set(xlim=(profile.along_km[0], profile.along_km[-1]), ylim=(low - 2 * spare, high + spare))
    axes.fill_between(profile.along_km, low - 2 * spare, profile.ground_m, color=_GROUND, linewidth=0, label="ground")
    axes.plot(
        profile.along_km,
        profile.least_m,
        color=style.VERMILLION,
        linewidth=0.7,
        linestyle=(0, (4, 3)),
        label="lowest allowed",
    )
    axes.plot(profile.along_km, profile.flown_m, color=style.INK, linewidth=1.2, label="flown")
    axes.plot(
        profile.turns_km, profile.turns_m, "|", color=style.INK, markersize=6, label="waypoints for the height only"
    )
    axes.plot(profile.stops_km, profile.stops_m, label="stops", **style.STOP)
    axes.set_xlabel("way flown, km", fontsize=8)
    axes.set_ylabel("above home, m", fontsize=8)
    axes.tick_params(labelsize=7, width=0.6)
    axes.grid(visible=True, color=style.INK, alpha=0.12, linewidth=0.5)
    axes.legend(
        fontsize=7,
        frameon=False,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.17),
        ncols=5,
    )
