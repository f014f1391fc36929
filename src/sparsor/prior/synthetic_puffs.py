"""Round Gaussian puffs over the ground: what every source of the synthetic field is made of.

A plume is a row of puffs that grow downwind, a road a chain of narrow ones. A round Gaussian is a product of
one in longitude and one in latitude: its mean over a cell is known (two differences of the normal
distribution function) and the sum over all cells of a raster is one matrix product.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

# Metres in a degree of latitude on a sphere of 6371 km: plenty for a made-up field.
M_PER_DEG = 111_194.93
# Beyond this many standard deviations a puff holds less than 1e-6 of its peak.
REACH = 5.5
# Width of a plume over its distance from the source: a month of changing winds, not one hour's plume.
GROWTH = 0.4
# Beyond it the normal distribution function is 0 or 1 to 1e-9.
FLAT = 6.0
PAIRS_AT_ONCE = 500_000


@dataclass(frozen=True)
class Puffs:
    """Round Gaussians over the ground.

    Parameters
    ----------
    lon_deg, lat_deg : array of float64 (puffs,)
        Centres.
    sigma_m : array of float64 (puffs,)
        Standard deviation in every direction, above 0.
    mass : array of float64 (puffs,)
        Integral over the ground, (unit of the field) m2.
    """

    lon_deg: NDArray[np.float64]
    lat_deg: NDArray[np.float64]
    sigma_m: NDArray[np.float64]
    mass: NDArray[np.float64]

    @property
    def m_per_deg_lon(self) -> NDArray[np.float64]:
        """Metres in a degree of longitude at each centre: every puff lies in the plane at its own place."""
        metres: NDArray[np.float64] = M_PER_DEG * np.cos(np.radians(self.lat_deg))
        return metres

    def near(self, box: Box) -> Puffs:
        """Return the puffs that reach into a box."""
        reach = REACH * self.sigma_m
        east = reach / self.m_per_deg_lon
        north = reach / M_PER_DEG
        keep = (
            (self.lon_deg > box.west_deg - east)
            & (self.lon_deg < box.east_deg + east)
            & (self.lat_deg > box.south_deg - north)
            & (self.lat_deg < box.north_deg + north)
        )
        return self._where(keep)

    def on_raster(self, lon_edges: NDArray[np.float64], lat_edges: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sum of all puffs, averaged over each cell of a raster.

        Parameters
        ----------
        lon_edges : array of float64 (columns + 1,)
            Ascending.
        lat_edges : array of float64 (rows + 1,)
            Descending.

        Returns
        -------
        array of float64 (rows, columns)
        """
        side_m = max(
            (lon_edges[1] - lon_edges[0]) * M_PER_DEG * float(np.cos(np.radians(lat_edges.mean()))),
            (lat_edges[0] - lat_edges[1]) * M_PER_DEG,
        )
        wide = self.sigma_m >= side_m
        wide_part = _wide_on_raster(self._where(wide), lon_edges, lat_edges)
        return wide_part + _narrow_on_raster(self._where(~wide), lon_edges, lat_edges)

    def _where(self, keep: NDArray[np.bool_]) -> Puffs:
        return Puffs(self.lon_deg[keep], self.lat_deg[keep], self.sigma_m[keep], self.mass[keep])

    def at_points(
        self, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64], cell_m: float
    ) -> NDArray[np.float64]:
        """Return the sum of all puffs, averaged over a square cell round each point, (points,)."""
        total = np.empty(lon_deg.size)
        step = max(1, PAIRS_AT_ONCE // max(1, self.mass.size))
        for first in range(0, lon_deg.size, step):
            part = slice(first, first + step)
            total[part] = self._some_points(lon_deg[part, None], lat_deg[part, None], cell_m)
        return total

    def _some_points(
        self, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64], cell_m: float
    ) -> NDArray[np.float64]:
        # The cell is square at the point's latitude, so in the puff's plane its width differs a little.
        width = cell_m * np.cos(np.radians(self.lat_deg)) / np.cos(np.radians(lat_deg))
        east = (lon_deg - self.lon_deg) * self.m_per_deg_lon
        north = (lat_deg - self.lat_deg) * M_PER_DEG
        share_east = ndtr((east + width / 2) / self.sigma_m) - ndtr((east - width / 2) / self.sigma_m)
        share_north = ndtr((north + cell_m / 2) / self.sigma_m) - ndtr((north - cell_m / 2) / self.sigma_m)
        total: NDArray[np.float64] = (share_east * share_north * (self.mass / (width * cell_m))).sum(axis=1)
        return total

    def density(self, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sum of all puffs where longitudes and latitudes cross, (latitudes, longitudes)."""
        east = (lon_deg[None, :] - self.lon_deg[:, None]) * (self.m_per_deg_lon / self.sigma_m)[:, None]
        north = (lat_deg[:, None] - self.lat_deg[None, :]) * (M_PER_DEG / self.sigma_m)[None, :]
        peak = self.mass / (2 * np.pi * self.sigma_m**2)
        total: NDArray[np.float64] = (np.exp(-(north**2) / 2) * peak[None, :]) @ np.exp(-(east**2) / 2)
        return total


def _narrow_on_raster(
    puffs: Puffs, lon_edges: NDArray[np.float64], lat_edges: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Average exactly: differences of the normal distribution function between the edges of the cells."""
    east = (lon_edges[None, :] - puffs.lon_deg[:, None]) * (puffs.m_per_deg_lon / puffs.sigma_m)[:, None]
    north = (lat_edges[:, None] - puffs.lat_deg[None, :]) * (M_PER_DEG / puffs.sigma_m)[None, :]
    cell_m2 = (lon_edges[1] - lon_edges[0]) * puffs.m_per_deg_lon * (lat_edges[0] - lat_edges[1]) * M_PER_DEG
    share_east = np.diff(_below(east), axis=1)
    share_north = -np.diff(_below(north), axis=0)
    total: NDArray[np.float64] = (share_north * (puffs.mass / cell_m2)[None, :]) @ share_east
    return total


def _wide_on_raster(
    puffs: Puffs, lon_edges: NDArray[np.float64], lat_edges: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Average to 0.1 % and much faster: wider than the cell, a Gaussian is widened by the cell's variance."""
    width_m = (lon_edges[1] - lon_edges[0]) * puffs.m_per_deg_lon
    high_m = float(lat_edges[0] - lat_edges[1]) * M_PER_DEG
    sigma_east = np.sqrt(puffs.sigma_m**2 + width_m**2 / 12)
    sigma_north = np.sqrt(puffs.sigma_m**2 + high_m**2 / 12)
    lon, lat = (lon_edges[1:] + lon_edges[:-1]) / 2, (lat_edges[1:] + lat_edges[:-1]) / 2
    east = (lon[None, :] - puffs.lon_deg[:, None]) * (puffs.m_per_deg_lon / sigma_east)[:, None]
    north = (lat[:, None] - puffs.lat_deg[None, :]) * (M_PER_DEG / sigma_north)[None, :]
    peak = puffs.mass / (2 * np.pi * sigma_east * sigma_north)
    total: NDArray[np.float64] = (np.exp(-(north**2) / 2) * peak[None, :]) @ np.exp(-(east**2) / 2)
    return total


def _below(deviation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the normal distribution function; most edges are far away, where it is 0 or 1."""
    below = (deviation > 0).astype(np.float64)
    close = np.abs(deviation) < FLAT
    below[close] = ndtr(deviation[close])
    return below


@dataclass(frozen=True)
class Box:
    """Sides of a region in degrees; unlike `geodesy.BoundingBox` it may be as small as a point."""

    west_deg: float
    south_deg: float
    east_deg: float
    north_deg: float

    def grown(self, metres: float) -> Box:
        """Return the box with `metres` more on each side."""
        north = metres / M_PER_DEG
        east = north / float(np.cos(np.radians(max(abs(self.south_deg), abs(self.north_deg)))))
        return Box(self.west_deg - east, self.south_deg - north, self.east_deg + east, self.north_deg + north)


def join(parts: Sequence[Puffs]) -> Puffs:
    """Return the puffs of several parts as one."""
    return Puffs(
        np.concatenate([part.lon_deg for part in parts]),
        np.concatenate([part.lat_deg for part in parts]),
        np.concatenate([part.sigma_m for part in parts]),
        np.concatenate([part.mass for part in parts]),
    )


def plumes(
    sources: Puffs,
    downwind_east: NDArray[np.float64],
    downwind_north: NDArray[np.float64],
    reach_m: float,
    at_reaches: tuple[float, ...],
) -> Puffs:
    """Turn each source into a plume: puffs downwind that grow with distance and lose mass exponentially.

    Parameters
    ----------
    sources : Puffs
        Where and how wide the plumes start; `mass` is the whole plume's.
    downwind_east, downwind_north : array of float64 (sources,)
        Unit vectors the wind blows towards.
    reach_m : float
        Distance after which 1/e of the mass is left (wind speed times life time).
    at_reaches : tuple of float
        Where the puffs are, in units of `reach_m`, ascending from 0.
    """
    at = np.array(at_reaches)
    ends = np.concatenate([[0.0], (at[1:] + at[:-1]) / 2, [np.inf]])
    share = np.exp(-ends[:-1]) - np.exp(-ends[1:])
    distance = at[None, :] * reach_m
    spread = GROWTH * distance
    lat = sources.lat_deg[:, None] + distance * downwind_north[:, None] / M_PER_DEG
    lon = sources.lon_deg[:, None] + distance * downwind_east[:, None] / sources.m_per_deg_lon[:, None]
    sigma = np.hypot(sources.sigma_m[:, None], spread)
    return Puffs(lon.ravel(), lat.ravel(), sigma.ravel(), (sources.mass[:, None] * share[None, :]).ravel())
