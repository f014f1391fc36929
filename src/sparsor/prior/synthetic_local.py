"""Small synthetic sources, made up where people are: stacks, streets, and the roads between cities.

The ground is cut into square tiles, at every level half as large as before. Each tile holds a stack and a street
at a place drawn from a hash of its address, so that the field can be asked anywhere, at any scale, and is always
the same; how much they emit follows the city around. Levels below the cell, or far below the mixing length, are not
made at all: their mean stands for them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.prior.synthetic_puffs import M_PER_DEG, REACH, Box, Puffs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.prior.synthetic_inventory import Roads

WIDEST_TILE_M = 32_000.0
LEVELS = 12  # down to 16 m
# Tiles are regular in degrees, square at this latitude.
TILE_LAT_DEG = 26.0
STACK_WIDTH = 0.22  # standard deviation of a stack's near puff over its tile's side
STREET_LENGTH = 1.3  # length of a street over its tile's side
STREET_WIDTH = 0.03
TAIL_CUT = 0.02
ROAD_WIDTH_M = 80.0
# The field stands for a mean of about an hour: meandering wind and mixing leave no feature narrower than this
# (standard deviation). Without it a map of a few kilometres is noise that no sample foretells.
MIXED_M = 300.0
ROAD_BEND = 0.06  # how far a road swings from the straight line, over its length
FAINT = 0.25  # a line narrower than this part of a cell is drawn this wide: the cell cannot tell


@dataclass(frozen=True)
class LocalSources:
    """The recipe for stacks and streets of one realisation.

    Parameters
    ----------
    salt : int
        Names the realisation in the hash.
    activity : Puffs
        Density of emission that is spread over small sources, unit of the field.
    floor : float
        The same far from any city: wells, farms, lone houses.
    stack_share, street_share : array of float64 (levels,)
        Part of the activity that each level's stacks and streets emit; all together 1.
    downwind : tuple of float
        Unit vector east, north.
    """

    salt: int
    activity: Puffs
    floor: float
    stack_share: NDArray[np.float64]
    street_share: NDArray[np.float64]
    downwind: tuple[float, float]

    def made(self, box: Box, cell_m: float) -> list[Puffs]:
        """Return the stacks and streets that show in cells of `cell_m` inside a box."""
        parts = []
        for level in range(LEVELS):
            tile_m = WIDEST_TILE_M / 2**level
            if tile_m >= _least_tile_m(cell_m):
                parts.append(self._stacks(level, box, self.stack_share[level]))
            if tile_m >= 8 * _least_tile_m(cell_m):
                parts.append(self._streets(level, box, cell_m, self.street_share[level]))
        return parts

    def mean_share(self, cell_m: float) -> float:
        """Return the part of the activity that is below cells of `cell_m` and shows as its mean."""
        tile_m = WIDEST_TILE_M / 2.0 ** np.arange(LEVELS)
        stacks = self.stack_share[tile_m < _least_tile_m(cell_m)].sum()
        streets = self.street_share[tile_m < 8 * _least_tile_m(cell_m)].sum()
        return float(stacks + streets)

    def _stacks(self, level: int, box: Box, share: float) -> Puffs:
        tiles = self._tiles(level, box, margin=4.4)
        side = WIDEST_TILE_M / 2**level
        strength = tiles.mass * share * _heavy_tail(self._draw(tiles, 3))
        width = side * STACK_WIDTH * (0.6 + 0.8 * self._draw(tiles, 4))
        lon, lat = self._placed(tiles)
        away = 0.9 * side
        lon_down = lon + away * self.downwind[0] / (M_PER_DEG * np.cos(np.radians(lat)))
        lat_down = lat + away * self.downwind[1] / M_PER_DEG
        return Puffs(
            np.concatenate([lon, lon_down]),
            np.concatenate([lat, lat_down]),
            np.hypot(np.concatenate([width, 2 * width]), MIXED_M),
            np.concatenate([0.6 * strength, 0.4 * strength]),
        ).near(box)

    def _streets(self, level: int, box: Box, cell_m: float, share: float) -> Puffs:
        tiles = self._tiles(level, box, margin=1.0)
        side = WIDEST_TILE_M / 2**level
        width = float(np.hypot(max(STREET_WIDTH * side, FAINT * cell_m), MIXED_M))
        nodes = int(np.ceil(STREET_LENGTH * side / (1.6 * width)))
        # Streets of a quarter run along two directions, with some spread.
        turn = (self._draw(tiles, 5) < 0.5) * np.pi / 2 + 0.5 * (self._draw(tiles, 6) - 0.5)
        angle = self._draw_scalar(7) * np.pi + turn
        along = ((np.arange(nodes) + 0.5) / nodes - 0.5) * STREET_LENGTH * side
        lon, lat = self._placed(tiles)
        metres_lon = M_PER_DEG * np.cos(np.radians(lat))
        strength = tiles.mass * share * _heavy_tail(self._draw(tiles, 8))
        return Puffs(
            (lon[:, None] + np.cos(angle)[:, None] * along[None, :] / metres_lon[:, None]).ravel(),
            (lat[:, None] + np.sin(angle)[:, None] * along[None, :] / M_PER_DEG).ravel(),
            np.full(lon.size * nodes, width),
            np.repeat(strength / nodes, nodes),
        ).near(box)

    def _tiles(self, level: int, box: Box, margin: float) -> _Tiles:
        side = WIDEST_TILE_M / 2**level
        north_deg = side / M_PER_DEG
        east_deg = north_deg / float(np.cos(np.radians(TILE_LAT_DEG)))
        wide = box.grown(margin * side + 4 * MIXED_M)
        column = np.arange(np.floor(wide.west_deg / east_deg), np.ceil(wide.east_deg / east_deg)).astype(np.int64)
        row = np.arange(np.floor(wide.south_deg / north_deg), np.ceil(wide.north_deg / north_deg)).astype(np.int64)
        lon, lat = (column + 0.5) * east_deg, (row + 0.5) * north_deg
        density = self.activity.near(wide).density(lon, lat) + self.floor
        area = (side * east_deg * M_PER_DEG) * np.cos(np.radians(lat))
        columns, rows = np.meshgrid(column, row)
        return _Tiles(level, columns.ravel(), rows.ravel(), east_deg, north_deg, (density * area[:, None]).ravel())

    def _placed(self, tiles: _Tiles) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        lon = (tiles.column + self._draw(tiles, 1)) * tiles.east_deg
        lat = (tiles.row + self._draw(tiles, 2)) * tiles.north_deg
        return lon, lat

    def _draw(self, tiles: _Tiles, what: int) -> NDArray[np.float64]:
        return hashed(tiles.column, tiles.row, self.salt + 64 * tiles.level + what)

    def _draw_scalar(self, what: int) -> float:
        return float(hashed(np.zeros(1, np.int64), np.zeros(1, np.int64), self.salt + what)[0])


@dataclass(frozen=True)
class _Tiles:
    level: int
    column: NDArray[np.int64]
    row: NDArray[np.int64]
    east_deg: float
    north_deg: float
    mass: NDArray[np.float64]


def _least_tile_m(cell_m: float) -> float:
    """Return the side of the smallest tiles that show: smaller ones are lost in the cell or in the mixing."""
    return max(cell_m, MIXED_M / 4)


def _heavy_tail(uniform: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn uniform numbers into strengths of mean 1, 0.65 to 3.1: many weak sources, a few strong ones.

    The tail is cut: one extreme map among a thousand would set the scale for all of them.
    """
    mean = ((1 + TAIL_CUT) ** 0.6 - TAIL_CUT**0.6) / 0.6
    strength: NDArray[np.float64] = (uniform + TAIL_CUT) ** -0.4 / mean
    return strength


def road_puffs(roads: Roads, strength: NDArray[np.float64], box: Box, cell_m: float) -> Puffs:
    """Draw the roads that cross a box as chains of narrow puffs.

    A road is halved again and again, pieces far from the box dropped on the way, until a piece is short enough
    for one puff.

    Parameters
    ----------
    roads : Roads
    strength : array of float64 (roads,)
        Emission a metre, (unit of the field) m.
    box : Box
    cell_m : float
    """
    width = float(np.hypot(max(ROAD_WIDTH_M, FAINT * cell_m), MIXED_M))
    halvings = np.ceil(np.log2(np.maximum(roads.length_m / (1.6 * width), 1.0))).astype(np.int64)
    road = np.arange(roads.length_m.size)
    piece = np.zeros(road.size, dtype=np.int64)
    for step in range(int(halvings.max()) + 1):
        depth = np.minimum(step, halvings[road])
        lon, lat = _on_road(roads, road, (piece + 0.5) / 2.0**depth)
        # A piece bends away from its middle by less than its own length.
        close = _close(lon, lat, box, roads.length_m[road] / 2.0**depth + REACH * width)
        road, piece, depth, lon, lat = road[close], piece[close], depth[close], lon[close], lat[close]
        split = step < halvings[road]
        if not split.any():
            break
        road = np.concatenate([road[~split], np.repeat(road[split], 2)])
        piece = np.concatenate([piece[~split], (2 * piece[split][:, None] + np.array([0, 1])[None, :]).ravel()])
    mass = strength[road] * roads.length_m[road] / 2.0 ** halvings[road]
    return Puffs(lon, lat, np.full(lon.size, width), mass)


def _on_road(
    roads: Roads, road: NDArray[np.int64], at: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    start, end = roads.from_deg[road], roads.to_deg[road]
    side = np.where(road % 2 == 0, ROAD_BEND, -ROAD_BEND) * np.sin(np.pi * at)
    wiggle = 0.3 * ROAD_BEND * np.sin(5 * np.pi * at)
    swing = side + wiggle
    lon = start[:, 0] + at * (end[:, 0] - start[:, 0]) - swing * (end[:, 1] - start[:, 1])
    lat = start[:, 1] + at * (end[:, 1] - start[:, 1]) + swing * (end[:, 0] - start[:, 0])
    return lon, lat


def _close(
    lon: NDArray[np.float64], lat: NDArray[np.float64], box: Box, reach_m: NDArray[np.float64]
) -> NDArray[np.bool_]:
    north = reach_m / M_PER_DEG
    east = north / np.cos(np.radians(lat))
    close: NDArray[np.bool_] = (
        (lon > box.west_deg - east)
        & (lon < box.east_deg + east)
        & (lat > box.south_deg - north)
        & (lat < box.north_deg + north)
    )
    return close


def hashed(column: NDArray[np.int64], row: NDArray[np.int64], salt: int) -> NDArray[np.float64]:
    """Return a number in 0..1 for each address, the same on every machine.

    The mixing is SplitMix64's (Steele, Lea and Flood 2014).

    Examples
    --------
    >>> import numpy as np
    >>> address = np.arange(3)
    >>> bool((hashed(address, address, 1) == hashed(address, address, 1)).all())
    True
    """
    mask = (1 << 64) - 1
    state = column.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    state = state ^ (row.astype(np.uint64) * np.uint64(0xC2B2AE3D27D4EB4F))
    state = _mixed(state) ^ np.uint64((salt * 0xD6E8FEB86659FD93) & mask)
    top = _mixed(state) >> np.uint64(11)
    return (top.astype(np.float64) + 0.5) * 2.0**-53


def _mixed(state: NDArray[np.uint64]) -> NDArray[np.uint64]:
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    mixed: NDArray[np.uint64] = state ^ (state >> np.uint64(31))
    return mixed
