"""What lies under the route: the expected map in its cells, the coast, the area and the fence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.plot import style
from sparsor.plot.coastline import coastline

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from numpy.typing import NDArray

    from sparsor.plot.picture import MissionPicture
    from sparsor.plot.view import View

SPECK_IN = 0.012
CROWDED_M_PER_INCH = 60_000.0
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def draw_prior(
    axes: Axes,
    view: View,
    picture: MissionPicture,
    *,
    colour_map: str = style.COLOUR_MAP,
    lowest: float | None = None,
) -> tuple[ScalarMappable, str, str] | None:
    """Draw the map, a colour to a cell; return what its colour bar needs: colours, label, unit.

    Parameters
    ----------
    axes : Axes
    view : View
    picture : MissionPicture
    colour_map : str
    lowest : float, optional
        Value of the first colour; the map's least by default.
    """
    from matplotlib import colormaps

    if picture.prior is None:
        return None
    values, power = scaled(picture.prior)
    colours = colormaps[colour_map].with_extremes(bad=style.NO_VALUE)
    image = axes.imshow(
        np.ma.masked_invalid(values),
        extent=box_extent(view, picture),
        cmap=colours,
        vmin=lowest,
        interpolation="nearest",
        aspect="auto",
        zorder=1,
    )
    unit = f"{power} {picture.prior_unit}".strip()
    return image, picture.prior_label, f"({unit})" if unit else ""


def scaled(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], str]:
    """Return values of a size that reads well, and the power of ten that was taken out of them, in words.

    Examples
    --------
    >>> import numpy as np
    >>> scaled(np.array([2e15, 8e15]))
    (array([2., 8.]), '10¹⁵')
    >>> scaled(np.array([20.0, 80.0]))
    (array([20., 80.]), '')
    """
    power = power_of_ten(values)
    if power == 0:
        return values, ""
    return values / 10.0**power, "10" + str(power).translate(SUPERSCRIPT)


def power_of_ten(values: NDArray[np.float64]) -> int:
    """Return the power of ten to take out of values; 0 where they read well as they are."""
    finite = np.abs(values[np.isfinite(values)])
    largest = float(finite.max(initial=0.0))
    return 0 if largest == 0.0 or 1e-2 <= largest < 1e5 else int(np.floor(np.log10(largest)))


def draw_outside(axes: Axes, view: View, picture: MissionPicture) -> None:
    """Grey out the cells outside the area."""
    if picture.outside is None:
        return
    veil = np.zeros((*picture.shape, 4))
    veil[picture.outside.reshape(picture.shape)] = style.GREYED_OUT
    axes.imshow(veil, extent=box_extent(view, picture), interpolation="nearest", aspect="auto", zorder=1.5)


def draw_cells(axes: Axes, view: View, picture: MissionPicture) -> None:
    """Draw the lines between the cells, faintly, and the box around them."""
    from matplotlib.collections import LineCollection

    west, east, south, north = box_extent(view, picture)
    rows, columns = picture.shape
    lines = [((lon, south), (lon, north)) for lon in np.linspace(west, east, columns + 1)[1:-1]]
    lines += [((west, lat), (east, lat)) for lat in np.linspace(south, north, rows + 1)[1:-1]]
    axes.add_collection(LineCollection(lines, **style.CELLS), autolim=False)
    axes.plot([west, east, east, west, west], [south, south, north, north, south], **style.BOX)


def draw_coast(axes: Axes, view: View, picture: MissionPicture) -> bool:
    """Draw the coastline, finer where it is crowded, without specks; return whether there is one."""
    from matplotlib.collections import LineCollection

    pieces = coastline(view.west_deg, view.south_deg, view.east_deg, view.north_deg) if picture.coast is None else []
    lines = [np.column_stack(piece) for piece in pieces]
    lines += [view.unwrapped(line) for line in picture.coast or ()]
    lines = [line for line in lines if np.ptp(view.inches(line), axis=0).max() > SPECK_IN]
    crowded = view.m_per_inch > CROWDED_M_PER_INCH
    for how, width in (
        (style.COAST_CASING, 1.1 if crowded else 1.7),
        (style.COAST, 0.5 if crowded else 0.75),
    ):
        axes.add_collection(LineCollection(lines, linewidths=width, **how), autolim=False)
    return bool(lines)


def draw_outlines(axes: Axes, view: View, picture: MissionPicture) -> None:
    """Draw the area's outline, what is kept out of, and the fence."""
    for ring in picture.area:
        lon, lat = view.unwrapped(_closed(ring)).T
        axes.plot(lon, lat, **style.AREA_CASING)
        axes.plot(lon, lat, **style.AREA)
    for ring in picture.keep_outs:
        axes.fill(*view.unwrapped(_closed(ring)).T, **style.KEEP_OUT)
    for line in picture.margins:
        axes.plot(*view.unwrapped(line).T, **style.KEPT_OFF)
    if picture.fence is not None:
        axes.plot(*view.unwrapped(_closed(picture.fence)).T, **style.FENCE)


def box_extent(view: View, picture: MissionPicture) -> tuple[float, float, float, float]:
    """Return the box as west, east, south, north, longitudes running on across the antimeridian."""
    _, south, _, north = picture.box_deg
    return view.box_west_deg, view.box_west_deg + view.box_width_deg, south, north


def _closed(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate((ring, ring[:1]))
