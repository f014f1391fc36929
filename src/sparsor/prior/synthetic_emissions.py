"""What one realisation of the synthetic field draws from its seed: winds, emissions, background waves.

The amounts below were chosen so that mean and spread over the Gulf, components and variograms are near those of
monthly OMI columns (docs/decisions/0005-built-in-field.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.streams import stream
from sparsor.prior.synthetic_inventory import cities, plants, roads
from sparsor.prior.synthetic_local import LEVELS, LocalSources
from sparsor.prior.synthetic_puffs import Puffs, join, plumes
from sparsor.prior.synthetic_waves import Waves

if TYPE_CHECKING:
    from numpy.typing import NDArray

BACKGROUND = 25.0  # umol m-2
CITY_MASS = 1.1e10  # of a city of 100 000 people, umol
PLANT_MASS_MW = 1.35e7  # of a megawatt of gas-fired power, umol
ROAD_STRENGTH = 2000.0  # of the road to a town of 100 000 people, umol m-1
LOCAL_FLOOR = 2.0  # of scattered sources far from any city, umol m-2

# Most of a column is hours old: a month of changing winds and a satellite's pixels smear it over this much.
AGED_M = 18_000.0
FRESH = 0.08  # the part of an emission that is not: a city's stacks and streets, a plant's near plume
LIFETIME_S = 4 * 3600.0
FRESH_LIFETIME_S = LIFETIME_S / 8
AGED_PUFFS = (0.0, 0.3, 0.75, 1.4, 2.3)
FRESH_PUFFS = (0.0, 0.03, 0.1, 0.25, 0.55, 1.1, 2.0)
STACK_PART = 0.1  # of a plant's fresh emission: its main stack; the rest is spread over its grounds
STACK_RADIUS_M = 300.0
GROUNDS_RADIUS_M = 3000.0
STREET_PART = 0.25  # of what small sources emit
LEVEL_SHARE = 0.92  # of the emission of each level of small sources, over that of the next larger one

# Of the background's logarithm: spread of the longest octave of waves, and of each octave over the one before.
WAVE_SPREAD = 0.48
WAVE_ROUGHNESS = 0.58
WAVE_VARIANCE = WAVE_SPREAD**2 / (1 - WAVE_ROUGHNESS**2)

# The north-westerly shamal is the Gulf's wind most of the year.
SHAMAL_TOWARDS_DEG = -45.0
SHAMAL_SPREAD_RAD = 0.7


@dataclass(frozen=True)
class Realisation:
    """Everything that a seed fixes; made when first asked for.

    Parameters
    ----------
    seed : int
        0 or above.
    """

    seed: int

    @cached_property
    def plumes(self) -> Puffs:
        """Plumes of cities and plants: most of the emission aged and wide, main stacks fresh and narrow."""
        towns, works = cities(), plants()
        lon = np.concatenate([towns.lon_deg, works.lon_deg])
        lat = np.concatenate([towns.lat_deg, works.lat_deg])
        extent = np.concatenate([_city_radius_m(towns.population), np.zeros(works.lon_deg.size)])
        mass = (1.0 - FRESH) * np.concatenate([self._city_mass, self._plant_mass])
        aged = Puffs(lon, lat, np.hypot(AGED_M, extent), mass)
        radius = np.full(works.lon_deg.size, STACK_RADIUS_M)
        fresh = Puffs(works.lon_deg, works.lat_deg, radius, STACK_PART * FRESH * self._plant_mass)
        _, speed, _ = self._wind
        return join(
            [
                plumes(aged, *self._downwind(aged), speed * LIFETIME_S, AGED_PUFFS),
                plumes(fresh, *self._downwind(fresh), speed * FRESH_LIFETIME_S, FRESH_PUFFS),
            ]
        )

    @cached_property
    def local(self) -> LocalSources:
        """The recipe for stacks and streets, dense where cities and plants are."""
        towns, works = cities(), plants()
        activity = Puffs(
            np.concatenate([towns.lon_deg, works.lon_deg]),
            np.concatenate([towns.lat_deg, works.lat_deg]),
            np.concatenate([_city_radius_m(towns.population), np.full(works.lon_deg.size, GROUNDS_RADIUS_M)]),
            FRESH * np.concatenate([self._city_mass, (1.0 - STACK_PART) * self._plant_mass]),
        )
        share = np.array([LEVEL_SHARE**level for level in range(LEVELS)])
        share /= share.sum()
        direction, _, _ = self._wind
        downwind = (float(np.cos(direction)), float(np.sin(direction)))
        salt = int(stream(self.seed, 3).integers(1 << 48)) << 12
        stacks, streets = (1.0 - STREET_PART) * share, STREET_PART * share
        return LocalSources(salt, activity, LOCAL_FLOOR, stacks, streets, downwind)

    @cached_property
    def traffic(self) -> NDArray[np.float64]:
        """Emission of each road a metre, umol m-1, (roads,)."""
        weight = roads().weight
        return ROAD_STRENGTH * weight * _around_one(stream(self.seed, 5), 0.6, weight.size)

    @cached_property
    def waves(self) -> Waves:
        """The logarithm of the background over its mean."""
        return Waves.drawn(stream(self.seed, 6), WAVE_SPREAD, WAVE_ROUGHNESS)

    @cached_property
    def _wind(self) -> tuple[float, float, float]:
        """Direction blown towards, radians from east; speed, m/s; phase of its turning over the domain."""
        draw = stream(self.seed, 1)
        direction = np.radians(SHAMAL_TOWARDS_DEG) + SHAMAL_SPREAD_RAD * draw.standard_normal()
        speed = float(np.clip(draw.gamma(6.0, 0.8), 2.0, 10.0))
        return float(direction), speed, float(draw.random() * 2 * np.pi)

    def _downwind(self, at: Puffs) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return unit vectors; the wind turns by some tens of degrees over a thousand kilometres."""
        direction, _, phase = self._wind
        turned = direction + 0.5 * np.sin(np.radians(18 * at.lon_deg + 13 * at.lat_deg) + phase)
        return np.cos(turned), np.sin(turned)

    @cached_property
    def _city_mass(self) -> NDArray[np.float64]:
        weight = cities().weight
        return CITY_MASS * weight * _around_one(stream(self.seed, 4), 0.5, weight.size)

    @cached_property
    def _plant_mass(self) -> NDArray[np.float64]:
        strength = plants().strength_mw
        return PLANT_MASS_MW * strength * _around_one(stream(self.seed, 2), 0.6, strength.size)


def _around_one(draw: np.random.Generator, spread: float, count: int) -> NDArray[np.float64]:
    """Draw log-normal factors of mean 1: no source emits what the inventory says."""
    return draw.lognormal(-(spread**2) / 2, spread, count)


def _city_radius_m(population: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviation of a city's extent: area grows a little more slowly than population."""
    radius: NDArray[np.float64] = 2000.0 * (population / 100_000) ** 0.42
    return radius
