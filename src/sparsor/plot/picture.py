"""What a mission's picture shows, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class MissionPicture:
    """Everything that `mission_preview` draws; what is None or empty is left out.

    Points are rows of longitude and latitude, degrees; longitudes may be -180..180 or run on across the
    antimeridian. Cells are in the grid's order, row 0 northmost.

    Parameters
    ----------
    title : str
        The headline.
    box_deg : tuple of float
        West, south, east, north; west above east means across the antimeridian.
    east_m, north_m : float
        Width and height of the box, metres: they set the aspect and the scale bar.
    shape : tuple of int
        Rows and columns of the grid.
    prior : array (rows, cols), optional
        The map that the plan expects; NaN where it has no value.
    prior_label, prior_unit : str
        What the prior is, for the colour bar.
    stops : array (n, 2)
        Where the vehicle stops, in flight order.
    route : array (n, 2)
        The path over the stops.
    sorties : tuple of arrays (n, 2)
        Instead of a route, the paths of several flights over their stops.
    transits : tuple of arrays (n, 2)
        The ways from home to the route, or to each sortie's, and back.
    homes : tuple of (longitude, latitude)
    fence : array (n, 2), optional
        Corners of the inclusion fence; closed by the drawing.
    area : tuple of arrays (n, 2)
        Rings of the area's outline, when the area is not the whole box.
    keep_outs : tuple of arrays (n, 2)
        Rings of what is kept out of.
    margins : tuple of arrays (n, 2)
        Lines that neither a stop nor a leg between stops crosses: the margins of keep-outs and of the coast.
    coast : tuple of arrays (n, 2), optional
        The coastline that the mission keeps to one side of; None: the package's, where it has one.
    coast_label : str
        Whose it is.
    outside : array of bool (rows * cols,), optional
        Cells outside the area, greyed out.
    caption : tuple of str
        Lines beneath the map.

    Raises
    ------
    ValueError
        When `prior` or `outside` does not have the grid's shape, or points are not rows of two.
    """

    title: str
    box_deg: tuple[float, float, float, float]
    east_m: float
    north_m: float
    shape: tuple[int, int] = (32, 32)
    prior: NDArray[np.float64] | None = None
    prior_label: str = ""
    prior_unit: str = ""
    stops: NDArray[np.float64] | None = None
    route: NDArray[np.float64] | None = None
    sorties: tuple[NDArray[np.float64], ...] = ()
    transits: tuple[NDArray[np.float64], ...] = ()
    homes: tuple[tuple[float, float], ...] = ()
    fence: NDArray[np.float64] | None = None
    area: tuple[NDArray[np.float64], ...] = ()
    keep_outs: tuple[NDArray[np.float64], ...] = ()
    margins: tuple[NDArray[np.float64], ...] = ()
    coast: tuple[NDArray[np.float64], ...] | None = None
    coast_label: str = "coastline (GSHHG)"
    outside: NDArray[np.bool_] | None = None
    caption: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        rows, columns = self.shape
        if self.prior is not None and self.prior.shape != self.shape:
            raise ValueError(f"the prior has shape {self.prior.shape}, the grid {self.shape}")
        if self.outside is not None and self.outside.shape != (rows * columns,):
            raise ValueError(f"the mask has shape {self.outside.shape}, the grid has {rows * columns} cells")
        around = [(name, line) for name in ("keep_outs", "margins", "coast") for line in getattr(self, name) or ()]
        for name, points in (*self.outlines(), *around):
            if points.ndim != 2 or points.shape[1] != 2:
                raise ValueError(f"{name} has shape {points.shape}; points are rows of longitude and latitude")

    def outlines(self) -> list[tuple[str, NDArray[np.float64]]]:
        """Return the name and the points of everything that the map is made large enough for, homes included.

        Keep-outs, margins and the coast are shown as far as they reach into it.
        """
        named = [("stops", self.stops), ("route", self.route), ("fence", self.fence)]
        named += [("sorties", points) for points in self.sorties]
        named += [("transits", points) for points in self.transits]
        named += [("area", points) for points in self.area]
        named += [("home", np.array([home], dtype=np.float64)) for home in self.homes]
        return [(name, points) for name, points in named if points is not None]
