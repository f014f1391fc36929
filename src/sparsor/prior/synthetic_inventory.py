"""What the synthetic field is made from: cities, plants, and the roads between cities."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from sparsor.prior.synthetic_puffs import M_PER_DEG

if TYPE_CHECKING:
    from numpy.typing import NDArray

ROADS_PER_CITY = 2
LONGEST_ROAD_M = 400_000.0


@dataclass(frozen=True)
class Cities:
    """Cities by name; positions and populations from GeoNames (CC BY 4.0)."""

    lon_deg: NDArray[np.float64]
    lat_deg: NDArray[np.float64]
    population: NDArray[np.float64]
    weight: NDArray[np.float64]


@dataclass(frozen=True)
class Plants:
    """Power plants and other industry, with where each row comes from and how far off it may be."""

    lon_deg: NDArray[np.float64]
    lat_deg: NDArray[np.float64]
    strength_mw: NDArray[np.float64]
    position_error_km: NDArray[np.float64]
    source: tuple[str, ...]


@dataclass(frozen=True)
class Roads:
    """Lines between neighbouring cities; `weight` grows with the smaller of the two."""

    from_deg: NDArray[np.float64]
    to_deg: NDArray[np.float64]
    length_m: NDArray[np.float64]
    weight: NDArray[np.float64]


@cache
def cities() -> Cities:
    """Read the cities of the package data (synthetic_cities.csv)."""
    rows = _rows("synthetic_cities.csv")
    lon, lat, population, weight = _columns(rows, "lon_deg", "lat_deg", "population", "weight")
    return Cities(lon, lat, population, weight)


@cache
def plants() -> Plants:
    """Read the plants of the package data (synthetic_plants.csv)."""
    rows = _rows("synthetic_plants.csv")
    lon, lat, strength, error = _columns(rows, "lon_deg", "lat_deg", "strength_mw", "position_error_km")
    return Plants(lon, lat, strength, error, tuple(row["source"] for row in rows))


@cache
def roads() -> Roads:
    """Join every city to its nearest larger ones, as far as they are within 400 km.

    Examples
    --------
    >>> net = roads()
    >>> bool((net.length_m <= 400_000).all()), net.from_deg.shape == net.to_deg.shape
    (True, True)
    """
    towns = cities()
    order = np.argsort(-towns.population, kind="stable")
    lon, lat = towns.lon_deg[order], towns.lat_deg[order]
    starts, ends = [], []
    for town in range(1, order.size):
        apart = _apart_m(lon[town], lat[town], lon[:town], lat[:town])
        for other in np.argsort(apart, kind="stable")[:ROADS_PER_CITY]:
            if 0.0 < apart[other] <= LONGEST_ROAD_M:
                starts.append(town)
                ends.append(int(other))
    position = np.column_stack([lon, lat])
    length = _apart_m(lon[starts], lat[starts], lon[ends], lat[ends])
    # A road to a far metropolis carries less than one to the next town.
    weight = np.sqrt(towns.weight[order][starts]) / (1.0 + length / 100_000.0)
    return Roads(position[starts], position[ends], length, weight)


def _apart_m(
    lon0: NDArray[np.float64], lat0: NDArray[np.float64], lon1: NDArray[np.float64], lat1: NDArray[np.float64]
) -> NDArray[np.float64]:
    east = (lon1 - lon0) * np.cos(np.radians((lat0 + lat1) / 2))
    apart: NDArray[np.float64] = M_PER_DEG * np.hypot(east, lat1 - lat0)
    return apart


def _rows(name: str) -> list[dict[str, str]]:
    text = (files("sparsor.prior") / "data" / name).read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def _columns(rows: list[dict[str, str]], *names: str) -> tuple[NDArray[np.float64], ...]:
    return tuple(np.array([float(row[name]) for row in rows]) for name in names)
