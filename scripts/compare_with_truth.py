#!/usr/bin/env python3
"""Compare a reconstructed map (.tif) with the field that the practice sensor flew through (truth.nc).

scripts/compare_with_truth.py missions/demo/demo.tif missions/demo/truth.nc
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import rasterio
import xarray


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("map", type=Path, help="as reconstruct-map writes it")
    parser.add_argument("truth", type=Path, help="as sparsor simulate --truth leaves it")
    arguments = parser.parse_args()

    with rasterio.open(arguments.map) as dataset:
        value, deviation = dataset.read(1), dataset.read(2)
        inverse, shape = ~dataset.transform, dataset.shape
    with xarray.open_dataset(arguments.truth, engine="h5netcdf") as dataset:
        true = cell_means(dataset["truth"], inverse, shape)

    known = np.isfinite(value) & np.isfinite(true)
    if not known.any():
        raise SystemExit(f"{arguments.map} and {arguments.truth} share no cell")
    off = (value - true)[known]
    within = np.mean(np.abs(off) <= 1.96 * deviation[known])
    print(f"root mean square error {np.sqrt(np.mean(off**2)):.2f}, in the map's unit")
    print(f"cells whose true mean lies within 1.96 standard deviations: {within:.0%}")
    print(f"relative error {np.linalg.norm(off) / np.linalg.norm(true[known] - true[known].mean()):.3f}")


def cell_means(truth: xarray.DataArray, inverse: rasterio.Affine, shape: tuple[int, int]) -> np.ndarray:
    """Return the mean of the truth's pixels whose centres lie in each cell; NaN where none do."""
    lon, lat = np.meshgrid(truth["lon"], truth["lat"])
    column, row = (np.floor(axis).astype(int) for axis in inverse * (lon, lat))
    inside = (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1])
    cell = row[inside] * shape[1] + column[inside]
    count = np.bincount(cell, minlength=shape[0] * shape[1])
    total = np.bincount(cell, weights=truth.values[inside], minlength=count.size)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan).reshape(shape)


if __name__ == "__main__":
    main()
