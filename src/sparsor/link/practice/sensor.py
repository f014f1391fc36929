"""A gas sensor that flies on the practice autopilot: slow, noisy, and sometimes silent."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from sparsor.core.streams import stream
from sparsor.errors import InputError

TAU_PER_T90 = 1.0 / math.log(10.0)
Truth = Callable[[float, float], float]
"""The field's value s at a longitude and latitude (degrees); 0..1 for a field over its own range."""


@dataclass(frozen=True)
class SensorSettings:
    """How the sensor measures.

    Parameters
    ----------
    name : str
        Of NAMED_VALUE_FLOAT; at most 10 characters.
    low_ppb, high_ppb : float
        Reading where the field's value s is 0 and 1.
    t90_s : float
        Time to 90 % of a step, first order; 0 answers at once.
    noise_ppb : float
        Standard deviation of each sample.
    drift_ppb_h : float
        Standard deviation of the drift after one hour (a random walk).
    drop_out_fraction : float
        Share of the samples that are never sent.
    interval_s : float
        Between samples.

    Raises
    ------
    InputError
        When a value is out of range.
    """

    name: str = "NO2"
    low_ppb: float = 10.0
    high_ppb: float = 70.0
    t90_s: float = 30.0
    noise_ppb: float = 1.0
    drift_ppb_h: float = 0.0
    drop_out_fraction: float = 0.0
    interval_s: float = 1.0

    def __post_init__(self) -> None:
        if not 0 < len(self.name.encode()) <= 10:
            raise InputError(f"a sensor named '{self.name}'; MAVLink has room for 1 to 10 characters")
        if not self.high_ppb > self.low_ppb:
            raise InputError(f"a sensor range of {self.low_ppb:g} to {self.high_ppb:g} ppb; give LO below HI")
        for what in ("t90_s", "noise_ppb", "drift_ppb_h"):
            value = getattr(self, what)
            if not 0 <= value < 1e6:
                raise InputError(f"the sensor's {what} is {value:g}; it has to be 0 or above")
        if not 0 <= self.drop_out_fraction < 1:
            raise InputError(f"drop-outs of {self.drop_out_fraction:g}; give a share from 0 to below 1")
        if not 0.01 <= self.interval_s <= 3600:
            raise InputError(f"a sensor interval of {self.interval_s:g} s; allowed are 0.01..3600")


class PracticeSensor:
    """The sensor's state; `step` it along the flight.

    Parameters
    ----------
    truth : callable
        The field's value s at a longitude and latitude.
    settings : SensorSettings
    seed : int
        The same seed and flight give the same samples.
    """

    def __init__(self, truth: Truth, settings: SensorSettings, seed: int) -> None:
        self.settings = settings
        self._truth = truth
        self._draw = stream(seed, 0)
        self._tau_s = settings.t90_s * TAU_PER_T90
        self._level: float | None = None
        self._time_s = 0.0
        self._due_s = settings.interval_s
        self._drift = 0.0

    def step(self, lon_deg: float, lat_deg: float, time_s: float) -> float | None:
        """Breathe the air at a place until `time_s`; returns a sample in ppb when one is due and not lost."""
        settings = self.settings
        air = settings.low_ppb + (settings.high_ppb - settings.low_ppb) * self._truth(lon_deg, lat_deg)
        passed = time_s - self._time_s
        self._time_s = time_s
        if self._level is None or self._tau_s == 0:
            self._level = air
        else:
            self._level = air + (self._level - air) * math.exp(-passed / self._tau_s)
        if time_s + 1e-9 < self._due_s:
            return None
        self._due_s += settings.interval_s
        # Three draws for every sample, sent or not: what one setting draws does not move the others.
        noise, walk, lost = self._draw.standard_normal(), self._draw.standard_normal(), self._draw.random()
        self._drift += settings.drift_ppb_h * math.sqrt(settings.interval_s / 3600.0) * walk
        if lost < settings.drop_out_fraction:
            return None
        return self._level + self._drift + settings.noise_ppb * float(noise)
