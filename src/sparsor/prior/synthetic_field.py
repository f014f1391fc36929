"""The built-in, synthetic NO2 field: its value at any point and for cells of any size."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import FieldError
from sparsor.prior.synthetic_emissions import (
    BACKGROUND,
    LOCAL_FLOOR,
    WAVE_VARIANCE,
    Realisation,
)
from sparsor.prior.synthetic_inventory import roads
from sparsor.prior.synthetic_local import road_puffs
from sparsor.prior.synthetic_puffs import M_PER_DEG, Box, Puffs, join

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

UNIT = "umol m-2"
DOMAIN = (35.0, 14.0, 68.0, 40.0)
FINEST_CELL_M = 1.0
# Points are worked through in blocks of so many cells: small sources are only made where someone asks.
BLOCK_CELLS = 64
LEAST_BLOCK_M = 1000.0


@dataclass(frozen=True)
class SyntheticField:
    """A synthetic field of tropospheric-column-like NO2 over the Gulf region: one realisation.

    Nothing in it was measured. Cities and plants stand where they are; what they emit, the wind, the
    background and every smaller source are drawn from the seed. It has content at every scale from 10 m cells
    to the whole domain. The mean of the values of small cells is the value of the large cell they fill, to
    0.5 % over a window and to 3 % of its mean in a single cell (root mean square): what is below a cell is
    replaced by its expected mean.

    Parameters
    ----------
    seed : int
        0 or above. 0 is the reference realisation, which no training or validation map is taken from.

    Examples
    --------
    >>> field = SyntheticField(0)
    >>> doha, desert = field.values([51.53, 50.0], [25.29, 20.0], 1000.0)
    >>> bool(doha > 2 * desert)
    True
    """

    seed: int

    def values(self, lon_deg: ArrayLike, lat_deg: ArrayLike, cell_m: float) -> NDArray[np.float64]:
        """Return the field at points, each the mean over a square cell round it.

        Parameters
        ----------
        lon_deg, lat_deg : array_like
            Points inside `DOMAIN`; broadcast against each other.
        cell_m : float
            Side of the cells, 1 m to 1000 km.

        Returns
        -------
        array of float64
            In `UNIT`, above 0, in the broadcast shape.

        Raises
        ------
        FieldError
            When a point lies outside `DOMAIN`, or the cell is outside its range.
        """
        lon, lat = np.broadcast_arrays(np.asarray(lon_deg, np.float64), np.asarray(lat_deg, np.float64))
        _check_points(lon, lat, cell_m)
        flat_lon, flat_lat = lon.ravel(), lat.ravel()
        total = np.empty(flat_lon.size)
        for block in _blocks(flat_lon, flat_lat, max(BLOCK_CELLS * cell_m, LEAST_BLOCK_M)):
            total[block] = self._at_points(flat_lon[block], flat_lat[block], cell_m)
        return total.reshape(lon.shape)

    def on_raster(self, box: tuple[float, float, float, float], shape: tuple[int, int]) -> NDArray[np.float64]:
        """Return the field averaged over each cell of a raster that is regular in degrees.

        Parameters
        ----------
        box : tuple of float
            West, south, east, north in degrees, inside `DOMAIN`.
        shape : tuple of int
            Rows and columns.

        Returns
        -------
        array of float64 (rows, columns)
            In `UNIT`, row 0 northmost.

        Raises
        ------
        FieldError
            When the box is not inside `DOMAIN`.
        """
        if not _inside(box):
            raise FieldError(_outside(f"the box {' '.join(f'{side:g}' for side in box)}"))
        west, south, east, north = box
        lon_edges = np.linspace(west, east, shape[1] + 1)
        lat_edges = np.linspace(north, south, shape[0] + 1)
        width = (east - west) / shape[1] * M_PER_DEG * float(np.cos(np.radians((south + north) / 2)))
        cell_m = float(np.sqrt(width * (north - south) / shape[0] * M_PER_DEG))
        puffs = self._puffs(Box(*box), cell_m)
        waves = self._drawn.waves.on_raster(lon_edges, lat_edges)
        return puffs.on_raster(lon_edges, lat_edges) + self._base(waves, cell_m)

    def _at_points(self, lon: NDArray[np.float64], lat: NDArray[np.float64], cell_m: float) -> NDArray[np.float64]:
        around = Box(lon.min(), lat.min(), lon.max(), lat.max()).grown(cell_m)
        puffs = self._puffs(around, cell_m)
        return puffs.at_points(lon, lat, cell_m) + self._base(self._drawn.waves.at_points(lon, lat, cell_m), cell_m)

    def _base(self, waves: NDArray[np.float64], cell_m: float) -> NDArray[np.float64]:
        """Return the background with the mean of the scattered sources too small for the cell."""
        scattered = LOCAL_FLOOR * self._drawn.local.mean_share(cell_m)
        # The exponential keeps the background above 0. It is taken of the cell's mean wave: the waves left
        # inside a cell are too small for that to matter.
        background: NDArray[np.float64] = BACKGROUND * np.exp(waves - WAVE_VARIANCE / 2)
        return background + scattered

    def _puffs(self, box: Box, cell_m: float) -> Puffs:
        """Return all puffs that reach into a box, as finely as cells of `cell_m` can tell."""
        activity = self._drawn.local.activity.near(box)
        share = self._drawn.local.mean_share(cell_m)
        unresolved = Puffs(activity.lon_deg, activity.lat_deg, activity.sigma_m, share * activity.mass)
        roads_near = road_puffs(roads(), self._drawn.traffic, box, cell_m)
        return join([self._drawn.plumes.near(box), unresolved, roads_near, *self._drawn.local.made(box, cell_m)])

    @cached_property
    def _drawn(self) -> Realisation:
        return Realisation(self.seed)


def covers(box: tuple[float, float, float, float]) -> bool:
    """Return whether the synthetic field is defined on the whole box.

    Parameters
    ----------
    box : tuple of float
        West, south, east, north in degrees.

    Examples
    --------
    >>> covers((50.5, 24.4, 51.8, 26.3)), covers((-1.0, 51.0, 1.0, 52.0))
    (True, False)
    """
    return _inside(box)


def _inside(box: tuple[float, float, float, float]) -> bool:
    west, south, east, north = box
    return DOMAIN[0] <= west < east <= DOMAIN[2] and DOMAIN[1] <= south < north <= DOMAIN[3]


def _blocks(lon: NDArray[np.float64], lat: NDArray[np.float64], side_m: float) -> list[NDArray[np.int64]]:
    """Return the points in groups, each within a square of `side_m`."""
    if lon.size == 0:
        return []
    side_deg = side_m / M_PER_DEG
    column = np.floor(lon / side_deg).astype(np.int64)
    row = np.floor(lat / side_deg).astype(np.int64)
    _, group = np.unique(np.column_stack([row, column]), axis=0, return_inverse=True)
    order = np.argsort(group, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(group[order])) + 1)


def _check_points(lon: NDArray[np.float64], lat: NDArray[np.float64], cell_m: float) -> None:
    west, south, east, north = DOMAIN
    inside = (lon >= west) & (lon <= east) & (lat >= south) & (lat <= north)
    if not inside.all():
        first = int(np.argmin(inside))
        raise FieldError(_outside(f"the point {lon.flat[first]:g} {lat.flat[first]:g}"))
    if not FINEST_CELL_M <= cell_m <= 1e6:
        raise FieldError(f"a cell of {cell_m:g} m; the synthetic field knows cells of 1 m to 1000 km")


def _outside(what: str) -> str:
    west, south, east, north = DOMAIN
    return (
        f"{what} (longitude before latitude) is not inside the synthetic field's domain, {west:g} to "
        f"{east:g} E and {south:g} to {north:g} N; elsewhere learn from a field of your own with --field"
    )
