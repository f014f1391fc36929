"""Made-up ground for the tests: hills as arrays, as GeoTIFFs, and between their pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import rasterio
from rasterio.transform import Affine
from scipy.interpolate import RegularGridInterpolator

from sparsor.geodesy.terrain import Terrain, read_terrain

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

WEST, NORTH = 51.47, 25.33
PIXEL_DEG = 1 / 3600


@dataclass(frozen=True, repr=False)
class Hills:
    """Heights, and the same between the centres of pixels by somebody else's interpolation."""

    heights_m: NDArray[np.float64]
    pixel_deg: float = PIXEL_DEG

    def at(self, lon_deg: Any, lat_deg: Any) -> NDArray[np.float64]:
        rows, columns = self.heights_m.shape
        lat = NORTH - (np.arange(rows) + 0.5) * self.pixel_deg
        lon = WEST + (np.arange(columns) + 0.5) * self.pixel_deg
        found = RegularGridInterpolator((lat[::-1], lon), self.heights_m[::-1])
        lat_deg, lon_deg = np.broadcast_arrays(lat_deg, lon_deg)
        return np.asarray(found((lat_deg, lon_deg))).reshape(lat_deg.shape)


def hills(seed: int, *, height_m: float = 60.0, size: int = 330, base_m: float = 20.0, wide: float = 18.0) -> Hills:
    """Return hills and hollows, some steep."""
    rng = np.random.default_rng(seed)
    row, column = np.mgrid[:size, :size]
    heights = np.full((size, size), base_m)
    for _ in range(30):
        middle, width = rng.integers(0, size, 2), rng.uniform(wide / 3, 2 * wide)
        away = (row - middle[0]) ** 2 + (column - middle[1]) ** 2
        heights += rng.uniform(-0.3, 1.0) * height_m * np.exp(-away / (2 * width * width))
    return Hills(heights)


def write_dem(path: Path, ground: Hills, **about: Any) -> Path:
    """Write hills as a GeoTIFF; `about` goes to rasterio, but for `unit`."""
    unit = about.pop("unit", None)
    rows, columns = ground.heights_m.shape
    transform = Affine(ground.pixel_deg, 0, WEST, 0, -ground.pixel_deg, NORTH)
    with rasterio.open(
        path, "w", driver="GTiff", height=rows, width=columns, count=1,
        **{"dtype": "float32", "crs": "EPSG:4326", "transform": transform, **about},
    ) as file:  # fmt: skip
        file.write(ground.heights_m.astype(np.float32), 1)
        if unit:
            file.units = (unit,)
    return path


def terrain_of(path: Path) -> Terrain:
    """Return all that there is in a file round Doha."""
    return read_terrain(path, [51.49, 51.54], [25.26, 25.31], 1500.0)
