#!/usr/bin/env python3
"""Compare maps of the built-in synthetic field with maps of two OMI fields, size by size.

Prints, for window sizes that an OMI field resolves (32 native pixels a side), the number of principal components
for 95 % of the variance and the variogram over lags in cells, normalised by the variance; for smaller sizes the same
numbers of the synthetic field alone. Each map's mean is taken away. Read docs/decisions/0005-built-in-field.md.

    python scripts/bench/builtin_field.py [--data ../shared/data] [--count 200]
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sparsor.prior.synthetic import SyntheticField, synthetic_maps
from sparsor.prior.synthetic_puffs import M_PER_DEG

if TYPE_CHECKING:
    from numpy.typing import NDArray

SIDE = 32
LAGS = (1, 2, 4, 8, 16)
PIXEL_DEG = 0.1
GULF = (45.5, 22.0, 58.1, 31.0)
COMPARED_KM = (400, 600, 900, 1300)
ALONE_KM = (1, 3, 10, 30, 100, 300)
MOST_GAPS = 0.05
FACTOR = 2.0
GULF_NAME = "OMI gulf"
WIDE_NAME = "OMI wide"


def main() -> int:
    """Print both tables; exit 1 when a compared number is off by more than a factor of two."""
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=root.parent / "shared" / "data")
    parser.add_argument("--count", type=int, default=200, help="windows of each field and size")
    options = parser.parse_args()
    fields = {GULF_NAME: gulf_field(options.data), WIDE_NAME: wide_field(options.data)}
    print(f"{options.count} windows each, {SIDE} x {SIDE} cells; mean of every map removed")
    good = compare(fields, options.count)
    print("\nsizes without a reference: the synthetic field alone")
    good &= alone(options.count)
    return 0 if good else 1


def compare(fields: dict[str, Raster], count: int) -> bool:
    """Print OMI and synthetic numbers side by side; return whether like and like are within the factor.

    The Gulf OMI field is one scene of one place: its windows overlap, which alone makes for few components. Its like
    is one synthetic realisation over the same box, cut the same way. The wide field's like are the maps that models
    learn from.
    """
    print(HEADING)
    good = True
    for size in COMPARED_KM:
        side_m = size * 1000.0
        omi = {name: raster.windows(side_m, count, np.random.default_rng(size)) for name, raster in fields.items()}
        references = {name: Numbers(maps) for name, maps in omi.items() if maps is not None}
        for name, numbers in references.items():
            print(numbers.line(f"{size} km", name))
        maps = Numbers(synthetic_maps((side_m, side_m), (SIDE, SIDE), count, 1, "training"))
        likes = {WIDE_NAME: maps}
        if GULF_NAME in references:
            likes[GULF_NAME] = Numbers(gulf_windows(side_m, count))
            print(likes[GULF_NAME].line(f"{size} km", "synthetic, Gulf"))
        print(maps.line(f"{size} km", "synthetic, maps"))
        for name, numbers in references.items():
            text, within = likes[name].against(numbers)
            good &= within
            print(f"{'':10}{f'like / {name}':<16} {text}")
        if GULF_NAME in references:
            print(f"{'':10}{'maps / OMI gulf':<16} {maps.against(references[GULF_NAME])[0]} (not like for like)")
    return good


def alone(count: int) -> bool:
    """Print the synthetic field's numbers at small sizes; return whether none is degenerate."""
    print(HEADING)
    good = True
    for size in ALONE_KM:
        began = time.perf_counter()
        maps = synthetic_maps((size * 1000.0,) * 2, (SIDE, SIDE), count, 1, "training")
        seconds = time.perf_counter() - began
        numbers = Numbers(maps)
        good &= 8 <= numbers.components <= 80 and numbers.relative_spread > 0.03
        print(numbers.line(f"{size} km", "synthetic, maps") + f"   {1000 * seconds / count:5.1f} ms a map")
    return good


HEADING = (
    f"{'size':>8}  {'field':<16}{'comp.95%':>9}"
    + "".join(f"{f'lag {lag}':>8}" for lag in LAGS)
    + f"{'sd/mean':>9}{'median':>8}"
)


class Numbers:
    """The statistics of one set of maps."""

    def __init__(self, maps: NDArray[np.float64]) -> None:
        self.spreads = maps.std(axis=1) / maps.mean(axis=1)
        self.relative_spread = float(np.median(self.spreads))
        centred = (maps - maps.mean(axis=1, keepdims=True)) / np.ptp(maps)
        self.components = components(centred)
        self.variogram = variogram(centred)
        self.total_spread = float(maps.std() / maps.mean())

    def line(self, size: str, name: str) -> str:
        """Return a row of the table."""
        lags = "".join(f"{value:8.3f}" for value in self.variogram)
        spread = f"{self.total_spread:9.2f}{self.relative_spread:8.2f}"
        return f"{size:>8}  {name:<16}{self.components:9d}{lags}{spread}"

    def against(self, other: Numbers) -> tuple[str, bool]:
        """Return the ratios to another set, and whether all are within the factor."""
        ratios = np.array([self.components / other.components, *(self.variogram / other.variogram)])
        within = bool(((ratios >= 1 / FACTOR) & (ratios <= FACTOR)).all())
        text = f"{ratios[0]:8.2f}" + "".join(f"{ratio:8.2f}" for ratio in ratios[1:])
        return text + ("  within a factor of 2" if within else "  OUTSIDE a factor of 2"), within


def components(maps: NDArray[np.float64]) -> int:
    """Return how many principal components hold 95 % of the variance of maps (n, cells)."""
    values = np.linalg.svd(maps - maps.mean(axis=0), compute_uv=False) ** 2
    return int(np.searchsorted(np.cumsum(values) / values.sum(), 0.95) + 1)


def variogram(maps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return half the mean squared difference over each lag, along rows and columns, over the variance."""
    cells = maps.reshape(-1, SIDE, SIDE)
    half = [
        0.25 * ((cells[:, lag:] - cells[:, :-lag]) ** 2).mean()
        + 0.25 * ((cells[:, :, lag:] - cells[:, :, :-lag]) ** 2).mean()
        for lag in LAGS
    ]
    return np.array(half) / cells.var()


class Raster:
    """A field on 0.1 degree pixels, row 0 northmost, gaps NaN."""

    def __init__(self, values: NDArray[np.float64], west_deg: float, north_deg: float) -> None:
        self.values = values
        self.west_deg = west_deg
        self.north_deg = north_deg
        filled = np.where(np.isfinite(values), values, 0.0)
        self.sums = integral(filled)
        self.weights = integral(np.isfinite(values).astype(np.float64))

    def windows(self, side_m: float, count: int, draw: np.random.Generator) -> NDArray[np.float64] | None:
        """Return `count` windows of 32 x 32 cells; None when the field does not hold or resolve them."""
        maps: list[NDArray[np.float64]] = []
        rows, columns = self.values.shape
        high = side_m / M_PER_DEG / PIXEL_DEG
        for _ in range(50 * count):
            top = draw.uniform(0, max(rows - high, 0))
            lat = self.north_deg - (top + high / 2) * PIXEL_DEG
            wide = high / np.cos(np.radians(lat))
            if high < SIDE or wide < SIDE or wide > columns or high > rows:
                return None
            left = draw.uniform(0, columns - wide)
            one = self._averaged(top, left, high, wide)
            if one is not None:
                maps.append(one)
            if len(maps) == count:
                return np.array(maps)
        return None

    def _averaged(self, top: float, left: float, high: float, wide: float) -> NDArray[np.float64] | None:
        row = top + np.arange(SIDE + 1) * high / SIDE
        column = left + np.arange(SIDE + 1) * wide / SIDE
        sums, weights = boxed(self.sums, row, column), boxed(self.weights, row, column)
        area = high * wide / SIDE**2
        if 1 - weights.sum() / (area * SIDE**2) > MOST_GAPS:
            return None
        mean = np.where(weights > 0.1 * area, sums / np.maximum(weights, 1e-9), np.nan)
        return np.where(np.isnan(mean), np.nanmean(mean), mean).ravel()


def integral(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sums over everything north-west of each pixel corner."""
    return np.pad(values.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))


def boxed(sums: NDArray[np.float64], row: NDArray[np.float64], column: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return integrals over the boxes between fractional rows and columns."""

    def at(axis: int, table: NDArray[np.float64], edge: NDArray[np.float64]) -> NDArray[np.float64]:
        low = np.clip(np.floor(edge).astype(int), 0, table.shape[axis] - 2)
        part = (edge - low).reshape((-1, 1) if axis == 0 else (1, -1))
        return table.take(low, axis) * (1 - part) + table.take(low + 1, axis) * part

    corners = at(1, at(0, sums, row), column)
    return np.diff(np.diff(corners, axis=0), axis=1)


def gulf_windows(side_m: float, count: int) -> NDArray[np.float64]:
    """Return windows of one synthetic realisation over the Gulf, taken as those of the OMI field are."""
    west, south, east, north = GULF
    shape = (round((north - south) / PIXEL_DEG), round((east - west) / PIXEL_DEG))
    raster = Raster(SyntheticField(0).on_raster(GULF, shape), west, north)
    maps = raster.windows(side_m, count, np.random.default_rng(int(side_m / 1000)))
    if maps is None:
        raise SystemExit(f"windows of {side_m / 1000:g} km do not fit the Gulf box")
    return maps


def gulf_field(folder: Path) -> Raster:
    """Read the Gulf OMI field."""
    import rasterio

    with rasterio.open(folder / "gulf_no2_omi_2020-09.tif") as source:
        return Raster(source.read(1).astype(np.float64), source.transform.c, source.transform.f)


def wide_field(folder: Path) -> Raster:
    """Read the wide OMI field."""
    import xarray

    with xarray.open_dataset(folder / "wide_no2_omi_2020-09.nc") as source:
        lat, lon = source["lat"].to_numpy(), source["lon"].to_numpy()
        values = source["no2"].to_numpy().astype(np.float64)
    return Raster(values, float(lon[0]) - PIXEL_DEG / 2, float(lat[0]) + PIXEL_DEG / 2)


if __name__ == "__main__":
    sys.exit(main())
