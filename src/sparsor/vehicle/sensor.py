"""Sensor profiles: how a sensor answers, read from TOML and checked once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Self

from pydantic import Field, model_validator

from sparsor.vehicle.packaged import Profile, load_profile, packaged_names

if TYPE_CHECKING:
    from pathlib import Path

Seconds = Annotated[float, Field(ge=0, le=86_400, allow_inf_nan=False)]


class SensorProfile(Profile):
    """How a sensor answers; every value in the unit of its name, or in `unit`.

    Build one with `load_sensor` or `SensorProfile.from_mapping`, whose errors are sentences.

    Parameters
    ----------
    name : str
        What the profile is called.
    gas : str
        What it measures: "NO2"; decides how units are converted.
    unit : str
        Of its readings.
    t90_s : float
        Time to 90 % of a step, first order; 0 when it answers at once.
    noise_sd : float
        Standard deviation of a single reading.
    drift_sd_per_h : float
        Standard deviation of how far its zero moves in an hour; 0 when it is not expected to.
    interval_s : float
        Between readings.
    warm_up_s : float
        How long after its first reading of a boot its readings are not to be believed.
    range : tuple of float, optional
        Lowest and highest reading; those at an end, or beyond, are saturated.
    """

    name: Annotated[str, Field(min_length=1, max_length=60)]
    gas: Annotated[str, Field(min_length=1, max_length=20)] = "NO2"
    unit: Annotated[str, Field(min_length=1, max_length=20)] = "ppb"
    t90_s: Seconds = 30.0
    noise_sd: Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)] = 5.0
    drift_sd_per_h: Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)] = 0.0
    interval_s: Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False)] = 1.0
    warm_up_s: Seconds = 0.0
    range: Annotated[tuple[float, float], Field(strict=False)] | None = None

    @model_validator(mode="after")
    def _range_ascends(self) -> Self:
        if self.range is not None and not self.range[0] < self.range[1]:
            raise ValueError(f"range is [{self.range[0]:g}, {self.range[1]:g}]; give the lower end first")
        return self

    @property
    def dwell_s(self) -> float:
        """Time to 95 % of a step, up to whole seconds: ``t90 ln(20) / ln(10)`` of a first-order answer."""
        return float(math.ceil(round(self.t90_s * math.log(20.0) / math.log(10.0), 6)))

    @property
    def words(self) -> str:
        """The sensor as people read it."""
        return f"{self.name}: {self.gas} in {self.unit}, t90 {self.t90_s:g} s, noise {self.noise_sd:g} {self.unit}"


def packaged_sensors() -> list[str]:
    """Return the names of the sensor profiles that come with sparsor, sorted."""
    return packaged_names("sensors")


def load_sensor(name_or_path: str | Path = "no2") -> SensorProfile:
    """Return a packaged sensor by name, or the one that a .toml file describes.

    Parameters
    ----------
    name_or_path : str or Path
        ``"no2"``, or a path that ends in ``.toml``.

    Raises
    ------
    VehicleError
        When the name is unknown, the file cannot be read, or a value in it is not allowed.

    Examples
    --------
    >>> load_sensor().t90_s, load_sensor().noise_sd, load_sensor().unit
    (30.0, 5.0, 'ppb')
    """
    return load_profile(SensorProfile, "sensor", "sensors", name_or_path)
