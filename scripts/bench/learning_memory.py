#!/usr/bin/env python3
"""Print the peak of memory of `sparsor learn` for 1, 4 and 16 files, and for a field of many times their pixels.

    scripts/bench/learning_memory.py [--files 1 4 16] [--side 2800] [--steps 32]

The files are made: GeoTIFFs of hills, side x side pixels of 4 bytes (31 MB at 2800), one of 16 times the pixels,
and a NetCDF archive of many time steps. Each is learned from in a process of its own; the peak is its VmHWM (Linux).
The dictionary is a DCT: a learned one takes longer, and the memory is that of the same maps.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import rasterio
from rasterio.transform import from_origin

from sparsor.journeys.learning import LearnRequest, learn_from_fields

PIXEL_DEG = 0.001
WEST, NORTH = 50.0, 27.0
BAND = 400


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", type=int, nargs="+", default=[1, 4, 16])
    parser.add_argument("--side", type=int, default=2800)
    parser.add_argument("--steps", type=int, default=32)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = [made(folder / f"{k}.tif", options.side, k) for k in range(max(options.files))]
        print("  fields                          on disk    peak  windows  seconds")
        for count in options.files:
            report(f"{count} of {options.side} x {options.side}", files[:count])
        for path in files[1:]:
            path.unlink()
        report(f"1 of {4 * options.side} x {4 * options.side}", [made(folder / "large.tif", 4 * options.side, 0)])
        (folder / "large.tif").unlink()
        for steps in (options.steps // 4, options.steps):
            report(f"{steps} time steps of 1000 x 1000", [archive(folder / "archive.nc", steps)], time="all")


def report(name: str, files: list[Path], **options: str) -> None:
    size = sum(path.stat().st_size for path in files)
    start = time.perf_counter()
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        peak, windows = process.submit(learned, files, options).result()
    print(f"  {name:30} {size / 1e6:6.0f} MB {peak:4.0f} MB {windows:8} {time.perf_counter() - start:8.1f}", flush=True)


def learned(files: list[Path], options: dict[str, str]) -> tuple[float, int]:
    request = LearnRequest(tuple(files), window_km=(20, 20), dictionary="dct", **options)
    result = learn_from_fields(request, files[0].with_suffix(".npz"))
    status = Path("/proc/self/status").read_text(encoding="ascii")  # getrusage would tell the parent's peak
    return int(re.search(r"VmHWM:\s*(\d+)", status)[1]) / 1024, result.maps


def hills(rows: np.ndarray, columns: np.ndarray, seed: int) -> np.ndarray:
    draw = np.random.default_rng(seed)
    values = np.full((rows.size, columns.size), 5.0, dtype=np.float32)
    for length in (700, 300, 150, 70):
        along, across, turn = draw.uniform(0.5, 1.5, 3)
        values += np.outer(np.sin(along * rows / length + turn), np.cos(across * columns / length)).astype(np.float32)
    return values


def made(path: Path, side: int, seed: int) -> Path:
    """Write hills band by band: this process is not to hold them either."""
    profile = {"driver": "GTiff", "height": side, "width": side, "count": 1, "dtype": "float32", "crs": "EPSG:4326"}
    place = from_origin(WEST, NORTH, PIXEL_DEG, PIXEL_DEG)
    with rasterio.open(path, "w", transform=place, **profile) as dataset:
        for top in range(0, side, BAND):
            rows = np.arange(top, min(top + BAND, side))
            window = ((rows[0], rows[-1] + 1), (0, side))
            dataset.write(hills(rows, np.arange(side), seed), 1, window=window)
    return path


def archive(path: Path, steps: int) -> Path:
    """Write time steps of hills, as an archive of months has them."""
    import h5netcdf

    side = np.arange(1000)
    with h5netcdf.File(path, "w") as file:
        file.dimensions = {"time": steps, "lat": side.size, "lon": side.size}
        units = {"time": "days since 2020-01-01", "lat": "degrees_north", "lon": "degrees_east"}
        for name, values in {"time": 30.0 * np.arange(steps), "lat": 25 + side * 1e-3, "lon": 50 + side * 1e-3}.items():
            file.create_variable(name, (name,), data=values).attrs["units"] = units[name]
        field = file.create_variable("no2", ("time", "lat", "lon"), "f4", chunks=(1, side.size, side.size))
        for step in range(steps):
            field[step] = hills(side, side, step)
    return path


if __name__ == "__main__":
    sys.exit(main())
