"""The map that a flight gave, and the samples it was made from."""

from __future__ import annotations

from dataclasses import dataclass
from math import isqrt
from typing import TYPE_CHECKING, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from sparsor.geodesy import Grid

_Cell = TypeVar("_Cell", np.float64, np.bool_)


@dataclass(frozen=True, eq=False)
class FieldMap:
    """A map with its uncertainty, on the mission's grid.

    Parameters
    ----------
    name : str
        Of the mission.
    quantity, unit : str
        What was measured and in which unit: "NO2", "ppb".
    grid : Grid
    values, standard_deviation : array of float64 (N,)
        Mean of each cell and how far it may be off, in `unit`.
    measured : array of bool (N,)
        Cells that the flight measured.
    allowed : array of bool (N,)
        Cells inside the area; the map says nothing of the others.
    decoder : str
        How values were found between the measured cells.
    facts : mapping of str to str
        How the map was made: logs, versions, options. Written into the files.
    finer : array of float64 (N * K**2,), optional
        The values on a grid K times finer.
    """

    name: str
    quantity: str
    unit: str
    grid: Grid
    values: NDArray[np.float64]
    standard_deviation: NDArray[np.float64]
    measured: NDArray[np.bool_]
    allowed: NDArray[np.bool_]
    decoder: str
    facts: Mapping[str, str]
    finer: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        for what in ("values", "standard_deviation", "measured", "allowed"):
            if getattr(self, what).shape != (self.grid.size,):
                raise ValueError(f"{what} has shape {getattr(self, what).shape}; the grid has {self.grid.size} cells")
        if self.finer is not None and self.finer.size != self.grid.size * self.factor**2:
            raise ValueError(f"finer holds {self.finer.size} values, no whole multiple of {self.grid.shape}")

    @property
    def factor(self) -> int:
        """How many times finer than the grid the layers are."""
        return 1 if self.finer is None else isqrt(self.finer.size // self.grid.size)

    @property
    def typical_deviation(self) -> float:
        """Median standard deviation of the cells inside the area, in `unit`."""
        return float(np.median(self.standard_deviation[self.allowed]))

    def layers(self) -> Layers:
        """Return the map as rasters, on the finer grid where there is one; NaN outside the area."""
        rows, columns = self.grid.shape
        finer = self.values if self.finer is None else self.finer
        inside = self._raster(self.allowed)
        return Layers(
            values=np.where(inside, finer.reshape(rows * self.factor, columns * self.factor), np.nan),
            standard_deviation=np.where(inside, self._raster(self.standard_deviation), np.nan),
            measured=self._raster(self.measured),
            west_deg=self.grid.box.west_deg,
            north_deg=self.grid.box.north_deg,
            width_deg=self.grid.box.width_deg,
            height_deg=self.grid.box.height_deg,
        )

    def _raster(self, cells: NDArray[_Cell]) -> NDArray[_Cell]:
        """Return an array over the cells as a raster, each cell as often as the finer grid has it."""
        return cells.reshape(self.grid.shape).repeat(self.factor, axis=0).repeat(self.factor, axis=1)


@dataclass(frozen=True, eq=False)
class Layers:
    """Rasters over the box: row 0 northmost, column 0 westmost.

    Parameters
    ----------
    values, standard_deviation : array of float64 (rows, cols)
        NaN outside the area. On a grid finer than the cells the standard deviation is that of the cell around.
    measured : array of bool (rows, cols)
    west_deg, north_deg, width_deg, height_deg : float
        The box; longitudes run on beyond 180 degrees where it crosses the antimeridian.
    """

    values: NDArray[np.float64]
    standard_deviation: NDArray[np.float64]
    measured: NDArray[np.bool_]
    west_deg: float
    north_deg: float
    width_deg: float
    height_deg: float

    @property
    def pixel_deg(self) -> tuple[float, float]:
        """Width and height of a pixel, degrees."""
        rows, columns = self.values.shape
        return self.width_deg / columns, self.height_deg / rows

    def edges_deg(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the meridians (cols + 1), eastward, and parallels (rows + 1), southward, between the pixels."""
        rows, columns = self.values.shape
        return (
            self.west_deg + self.width_deg * np.arange(columns + 1) / columns,
            self.north_deg - self.height_deg * np.arange(rows + 1) / rows,
        )


@dataclass(frozen=True, eq=False)
class FlownSamples:
    """Every sample of the log that has a place, in order of time, and whether the map was made from it.

    Parameters
    ----------
    time_s : array of float64 (n,)
        The vehicle's seconds since boot.
    lon_deg, lat_deg : array of float64 (n,)
    alt_m : array of float64 (n,)
        Metres above mean sea level; NaN when unknown.
    value : array of float64 (n,)
        What the sensor read, in the map's unit.
    air : array of float64 (n,)
        What the air held there, the sensor's slow response undone; NaN where that was not estimated.
    clock : array of str (n,)
        What `time_s` is from.
    boot : array of int64 (n,)
        Number of the vehicle's boot.
    unix_s : array of float64 (n,)
        Seconds since 1970; NaN when nothing tells the time of day.
    reason : array of str (n,)
        Why it was left out; empty where it was used.
    """

    time_s: NDArray[np.float64]
    lon_deg: NDArray[np.float64]
    lat_deg: NDArray[np.float64]
    alt_m: NDArray[np.float64]
    value: NDArray[np.float64]
    air: NDArray[np.float64]
    clock: NDArray[np.str_]
    boot: NDArray[np.int64]
    unix_s: NDArray[np.float64]
    reason: NDArray[np.str_]

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which samples the map was made from."""
        return np.asarray(self.reason == "")

    @property
    def places(self) -> NDArray[np.float64]:
        """Longitudes and latitudes, (n, 2)."""
        return np.column_stack((self.lon_deg, self.lat_deg))

    def left_out(self) -> dict[str, int]:
        """Return how many samples were left out for which reason, the most frequent first."""
        reasons, counts = np.unique(self.reason[~self.used], return_counts=True)
        order = np.argsort(-counts, kind="stable")
        return {str(reasons[k]): int(counts[k]) for k in order}
