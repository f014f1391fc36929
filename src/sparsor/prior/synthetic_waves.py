"""The synthetic background: a sum of plane waves over all scales, averaged over cells exactly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.prior.synthetic_puffs import M_PER_DEG

if TYPE_CHECKING:
    from numpy.typing import NDArray

LONGEST_M = 1_600_000.0
OCTAVES = 17  # down to 24 m
WAVES_PER_OCTAVE = 12
# The waves live in one plane for the whole domain, true to scale at this latitude.
PLANE_LAT_DEG = 26.0
M_PER_DEG_LON = M_PER_DEG * float(np.cos(np.radians(PLANE_LAT_DEG)))


@dataclass(frozen=True)
class Waves:
    """Plane waves `amplitude * cos(east * x + north * y + phase)`, arrays of float64 (waves,).

    `east` and `north` are wave numbers in radians a metre.
    """

    east: NDArray[np.float64]
    north: NDArray[np.float64]
    phase: NDArray[np.float64]
    amplitude: NDArray[np.float64]

    @classmethod
    def drawn(cls, stream: np.random.Generator, spread: float, roughness: float) -> Waves:
        """Draw waves of random direction, phase and length.

        Parameters
        ----------
        stream : numpy.random.Generator
        spread : float
            Standard deviation of the waves of the longest octave together.
        roughness : float
            Each octave's standard deviation over that of the next longer one, below 1.
        """
        octave = np.repeat(np.arange(OCTAVES), WAVES_PER_OCTAVE)
        count = octave.size
        length_m = LONGEST_M * 2.0 ** -(octave + stream.random(count))
        angle = stream.random(count) * 2 * np.pi
        number = 2 * np.pi / length_m
        amplitude = spread * roughness**octave * np.sqrt(2 / WAVES_PER_OCTAVE)
        return cls(number * np.cos(angle), number * np.sin(angle), stream.random(count) * 2 * np.pi, amplitude)

    def on_raster(self, lon_edges: NDArray[np.float64], lat_edges: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sum of the waves, averaged over each cell of a raster, (rows, columns).

        `lon_edges` ascend, `lat_edges` descend.
        """
        east_m = (lon_edges[1] - lon_edges[0]) * M_PER_DEG_LON
        north_m = (lat_edges[0] - lat_edges[1]) * M_PER_DEG
        amplitude = self._averaged(east_m, north_m)
        keep = np.abs(amplitude) > 0
        x = (lon_edges[:-1] + lon_edges[1:]) / 2 * M_PER_DEG_LON
        y = (lat_edges[:-1] + lat_edges[1:]) / 2 * M_PER_DEG
        along = np.exp(1j * self.east[keep][:, None] * x[None, :])
        across = np.exp(1j * (self.north[keep][None, :] * y[:, None] + self.phase[keep][None, :]))
        total: NDArray[np.float64] = ((across * amplitude[keep][None, :]) @ along).real
        return total

    def at_points(
        self, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64], cell_m: float
    ) -> NDArray[np.float64]:
        """Return the sum of the waves, averaged over a square cell round each point, (points,)."""
        # A cell that is square on the ground is not in the waves' plane.
        width = cell_m * np.cos(np.radians(PLANE_LAT_DEG)) / np.cos(np.radians(lat_deg))
        total = np.zeros(lon_deg.size)
        for one in np.flatnonzero(self._averaged(cell_m, cell_m)):
            amplitude = self.amplitude[one] * _sinc(self.east[one] * width) * _sinc(self.north[one] * cell_m)
            angle = self.east[one] * lon_deg * M_PER_DEG_LON + self.north[one] * lat_deg * M_PER_DEG
            total += amplitude * np.cos(angle + self.phase[one])
        return total

    def _averaged(self, east_m: float, north_m: float) -> NDArray[np.float64]:
        """Return amplitudes after averaging over a cell; waves far below the cell are dropped."""
        amplitude = self.amplitude * _sinc(self.east * east_m) * _sinc(self.north * north_m)
        length_m = 2 * np.pi / np.hypot(self.east, self.north)
        averaged: NDArray[np.float64] = np.where(length_m < min(east_m, north_m) / 2, 0.0, amplitude)
        return averaged


def _sinc(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean of a unit wave over a cell that it crosses in `angle` radians, relative to its middle."""
    value: NDArray[np.float64] = np.sinc(angle / (2 * np.pi))
    return value
