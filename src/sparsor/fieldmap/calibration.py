"""From what a sensor shows to a concentration: its calibration file, and other values of the log at its times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from sparsor.core.tomlmodel import model_of_file
from sparsor.errors import CalibrationError
from sparsor.flightlog.log import AMBIENT
from sparsor.flightlog.sampling import samples as samples_of

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from sparsor.flightlog.log import FlightLog
    from sparsor.flightlog.sampling import Samples

TEMPERATURE, PRESSURE = "temperature", "press_abs"
"""Names under which the autopilot's own ambient values are kept; degrees C and hPa."""
LONGEST_WAY_S = 60.0
"""Other values farther apart in time than this are not interpolated between."""

Number = Annotated[float, Field(allow_inf_nan=False)]


class Ambient(BaseModel):
    """How a reading follows temperature or humidity.

    Parameters
    ----------
    source : str, optional
        Named value that tells it; left out, temperature is the autopilot's own.
    reference : float
        Where zero and span were taken: degrees C or per cent.
    zero : float
        Change of the reading in clean air per degree or per cent, in the sensor's unit.
    span : float
        Relative change of the sensitivity per degree or per cent.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    source: Annotated[str, Field(min_length=1)] | None = None
    reference: Number
    zero: Number = 0.0
    span: Annotated[float, Field(gt=-1, lt=1)] = 0.0


class Cross(BaseModel):
    """How much of another named value a reading holds.

    Parameters
    ----------
    factor : float
        Of the sensor's unit per unit of the other value.
    reference : float
        The other value at which it adds nothing.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    factor: Number
    reference: Number = 0.0


class Calibration(BaseModel):
    """What turns readings into concentrations.

    ``(reading - zero - dzero) * span / (1 + dspan) - sum(factor * (other - reference))``, where dzero and dspan are
    what temperature and humidity do to the sensor.

    Parameters
    ----------
    zero : float
        Reading in clean air.
    span : float
        Concentration per reading above it.
    unit : str, optional
        Of the concentration, where it is not the sensor profile's.
    temperature, humidity : Ambient, optional
    cross : mapping of str to Cross
        By the name of the other value.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    zero: Number = 0.0
    span: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 1.0
    unit: Annotated[str, Field(min_length=1, max_length=20)] | None = None
    temperature: Ambient | None = None
    humidity: Ambient | None = None
    cross: dict[str, Cross] = Field(default_factory=dict)

    @property
    def sources(self) -> tuple[str, ...]:
        """Other values of the log that it needs."""
        ambient = [self._source(name, one) for name, one in self._ambients()]
        return tuple(dict.fromkeys([*ambient, *self.cross]))

    def apply(self, reading: NDArray[np.float64], others: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return concentrations.

        Parameters
        ----------
        reading : array of float64 (n,)
        others : mapping of str to array of float64 (n,)
            Each of `sources` at the readings' times; where one is NaN the concentration is NaN.

        Examples
        --------
        >>> Calibration(zero=4.0, span=2.0).apply(np.array([4.0, 14.0]), {})
        array([ 0., 20.])
        """
        zero, gain = np.full_like(reading, self.zero), np.full_like(reading, self.span)
        for name, one in self._ambients():
            above = others[self._source(name, one)] - one.reference
            zero += one.zero * above
            gain = gain / (1.0 + one.span * above)
        value = (reading - zero) * gain
        for name, cross in self.cross.items():
            value -= cross.factor * (others[name] - cross.reference)
        return value

    def _ambients(self) -> list[tuple[str, Ambient]]:
        both = (("temperature", self.temperature), ("humidity", self.humidity))
        return [(name, one) for name, one in both if one is not None]

    @staticmethod
    def _source(name: str, one: Ambient) -> str:
        if one.source is not None:
            return one.source
        if name == "temperature":
            return TEMPERATURE
        raise CalibrationError("the calibration's humidity has no source; name the value of the log that tells it")


def read_calibration(path: Path) -> Calibration:
    """Read a calibration file.

    Raises
    ------
    CalibrationError
        When it cannot be read, or a value in it is not allowed.
    """
    calibration = model_of_file(Calibration, path, "calibration", CalibrationError)
    _ = calibration.sources  # a humidity that nothing tells is refused now, not after the log was read
    return calibration


def calibrated(log: FlightLog, samples: Samples, calibration: Calibration) -> NDArray[np.float64]:
    """Return a sensor's concentrations, NaN where the log does not hold another value that they depend on.

    Raises
    ------
    CalibrationError
        When a value that the calibration names is not in the log.
    """
    others = {name: value_at(log, samples, name) for name in calibration.sources}
    return calibration.apply(samples.value, others)


def value_at(log: FlightLog, samples: Samples, name: str) -> NDArray[np.float64]:
    """Return another value of the log at the samples' times, NaN where it has none before and after.

    Parameters
    ----------
    log : FlightLog
    samples : Samples
    name : str
        NAME or NAME@SYSTEM/COMPONENT; the vehicle's own ambient values are `TEMPERATURE` and `PRESSURE`.

    Raises
    ------
    CalibrationError
        When it is not in the log.
    LogError
        When several have that name.
    """
    if not any(name in (one.name, f"{one.name}@{one.sender}") for one in log.values):
        there = ", ".join(dict.fromkeys(one.name for one in log.values)) or "none"
        raise CalibrationError(f"the value '{name}' is not in the log; there are {there}")
    own = f"{name}@{samples.system}/1"
    asked = own if any(one.message == AMBIENT and f"{one.name}@{one.sender}" == own for one in log.values) else name
    other = samples_of(log, sensor=asked, system=samples.system)
    value = np.full(samples.time_s.size, np.nan)
    for boot in np.unique(samples.boot):
        rows, known = samples.boot == boot, other.boot == boot
        if known.any():
            value[rows] = _interpolated(samples.time_s[rows], other.time_s[known], other.value[known])
    return value


def _interpolated(
    at_s: NDArray[np.float64], time_s: NDArray[np.float64], value: NDArray[np.float64]
) -> NDArray[np.float64]:
    after = np.searchsorted(time_s, at_s).clip(0, time_s.size - 1)
    before = (np.searchsorted(time_s, at_s, side="right") - 1).clip(0, time_s.size - 1)
    inside = (at_s >= time_s[0]) & (at_s <= time_s[-1])
    return np.where(inside & (time_s[after] - time_s[before] <= LONGEST_WAY_S), np.interp(at_s, time_s, value), np.nan)
