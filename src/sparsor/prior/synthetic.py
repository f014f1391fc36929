"""The built-in, synthetic NO2 field of the Gulf region, and the maps that built-in models are learned from.

Nothing in it was measured: it is made so that its maps vary as maps of NO2 do (docs/decisions/0005), at
every size from 1 km to 1300 km.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from sparsor.core.streams import stream
from sparsor.errors import FieldError
from sparsor.prior.synthetic_field import DOMAIN, UNIT, SyntheticField, covers
from sparsor.prior.synthetic_inventory import cities, plants
from sparsor.prior.synthetic_puffs import M_PER_DEG

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.geodesy import Grid

__all__ = ["DOMAIN", "UNIT", "Part", "SyntheticField", "covers", "gulf_values", "synthetic_maps", "windows"]

Part = Literal["training", "validation"]
PARTS: tuple[Part, Part] = ("training", "validation")
MAPS_PER_REALISATION = 25
# Of four windows three are near a source; the fourth is anywhere.
NEAR_SOURCE = 0.75
LARGEST_PERIODS = 8


def gulf_values(grid: Grid) -> NDArray[np.float64]:
    """Return the reference realisation (seed 0) of the synthetic field, averaged over each cell of a grid.

    Parameters
    ----------
    grid : Grid
        Its box inside `DOMAIN`.

    Returns
    -------
    array of float64 (N,)
        In `UNIT`.

    Raises
    ------
    FieldError
        When the box is not inside `DOMAIN`.

    Examples
    --------
    >>> from sparsor.geodesy import BoundingBox, Grid
    >>> gulf_values(Grid(BoundingBox(51.50, 25.27, 51.53, 25.30))).shape
    (1024,)
    """
    return SyntheticField(0).on_raster(grid.box.as_tuple(), grid.shape).ravel()


def synthetic_maps(
    side_m: tuple[float, float], shape: tuple[int, int], count: int, seed: int, part: Part
) -> NDArray[np.float64]:
    """Return maps of the synthetic field over windows of one ground size.

    The two parts share neither realisations nor places: see `windows`.

    Parameters
    ----------
    side_m : tuple of float
        Ground size of a window, east and north, metres.
    shape : tuple of int
        Rows and columns of a map.
    count : int
        Number of maps.
    seed : int
        The same seed gives the same maps.
    part : {"training", "validation"}

    Returns
    -------
    array of float64 (count, rows * columns)
        In `UNIT`; row 0 of a map is northmost.

    Raises
    ------
    FieldError
        When a window of that size does not fit into the domain twice.

    Examples
    --------
    >>> maps = synthetic_maps((3000.0, 3000.0), (8, 8), 3, seed=1, part="training")
    >>> maps.shape, bool((maps > 0).all())
    ((3, 64), True)
    """
    boxes = windows(side_m, count, seed, part)
    maps = np.empty((count, shape[0] * shape[1]))
    draw = stream(seed, PARTS.index(part), 1)
    for first in range(0, count, MAPS_PER_REALISATION):
        field = SyntheticField(int(draw.integers(1, 1 << 62)))
        for number in range(first, min(first + MAPS_PER_REALISATION, count)):
            west, south, east, north = boxes[number]
            maps[number] = field.on_raster((west, south, east, north), shape).ravel()
    return maps


def windows(side_m: tuple[float, float], count: int, seed: int, part: Part) -> NDArray[np.float64]:
    """Return places for windows: most near a source, all inside the part's blocks of longitude.

    The domain is cut into blocks of longitude, never narrower than a window; while windows are small enough a
    quarter of the longitudes is for validation. Each window lies within one block, so that no training window
    overlaps a validation window.

    Parameters
    ----------
    side_m : tuple of float
        East and north, metres.
    count : int
    seed : int
    part : {"training", "validation"}

    Returns
    -------
    array of float64 (count, 4)
        West, south, east, north, degrees.

    Raises
    ------
    FieldError
        When a window of that size does not fit into the domain twice.
    """
    if part not in PARTS:
        raise FieldError(f"part '{part}' of the synthetic maps; it is 'training' or 'validation'")
    blocks = _Blocks.for_windows(side_m)
    draw = stream(seed, PARTS.index(part), 0)
    chosen: list[NDArray[np.float64]] = []
    while sum(len(one) for one in chosen) < count:
        chosen.append(_some_windows(side_m, 2 * count + 64, draw, blocks, part))
    return np.concatenate(chosen)[:count]


@dataclass(frozen=True)
class _Blocks:
    """Longitudes from the domain's west side in periods: first training, then validation."""

    period_deg: float
    validation_deg: float

    @classmethod
    def for_windows(cls, side_m: tuple[float, float]) -> _Blocks:
        """Return blocks that hold windows of this size wherever they fit between south and north."""
        west, south, east, north = DOMAIN
        high = side_m[1] / M_PER_DEG
        width = side_m[0] / (M_PER_DEG * float(np.cos(np.radians(north - high / 2))))
        if not (0 < high < north - south and 0 < 2.05 * width < east - west):
            raise FieldError(
                f"windows of {side_m[0] / 1000:g} x {side_m[1] / 1000:g} km do not fit the synthetic field: "
                "it holds windows up to 1300 km x 1300 km; learn from a field of your own with --field"
            )
        periods = int(np.clip((east - west) // (4 * width), 1, LARGEST_PERIODS))
        period = (east - west) / periods
        return cls(period, max(period / 4, 1.02 * width))

    def of(self, lon_deg: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the number of the block of each longitude: even ones are training, odd ones validation."""
        period, inside = np.divmod(lon_deg - DOMAIN[0], self.period_deg)
        return 2 * period.astype(np.int64) + (inside >= self.period_deg - self.validation_deg)


def _some_windows(
    side_m: tuple[float, float], count: int, draw: np.random.Generator, blocks: _Blocks, part: Part
) -> NDArray[np.float64]:
    """Return those of `count` drawn windows that lie in the domain and within one block of the part."""
    west, south, east, north = DOMAIN
    lon, lat = draw.uniform(west, east, count), draw.uniform(south, north, count)
    source_lon, source_lat, weight = _sources()
    near = draw.random(count) < NEAR_SOURCE
    source = draw.choice(weight.size, count, p=weight)
    # The source may be anywhere in the window, also close to its edge.
    away = draw.uniform(-0.4, 0.4, (2, count))
    lat = np.where(near, source_lat[source] + away[1] * side_m[1] / M_PER_DEG, lat)
    metres = M_PER_DEG * np.cos(np.radians(lat))
    lon = np.where(near, source_lon[source] + away[0] * side_m[0] / metres, lon)
    wide, high = side_m[0] / metres, np.full(count, side_m[1] / M_PER_DEG)
    box = np.column_stack([lon - wide / 2, lat - high / 2, lon + wide / 2, lat + high / 2])
    inside = (box[:, 0] > west) & (box[:, 1] > south) & (box[:, 2] < east) & (box[:, 3] < north)
    block = blocks.of(box[:, 0])
    kept = inside & (block == blocks.of(box[:, 2])) & (block % 2 == PARTS.index(part))
    chosen: NDArray[np.float64] = box[kept]
    return chosen


def _sources() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return longitudes, latitudes and the chance to be chosen of all cities and plants."""
    towns, works = cities(), plants()
    # Square roots, so that the few largest do not take all windows.
    weight = np.concatenate([np.sqrt(towns.weight), np.sqrt(works.strength_mw / 1000.0)])
    return (
        np.concatenate([towns.lon_deg, works.lon_deg]),
        np.concatenate([towns.lat_deg, works.lat_deg]),
        weight / weight.sum(),
    )
