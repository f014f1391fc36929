"""From what a sensor logged to concentrations: its profile, calibration and unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.fieldmap.calibration import PRESSURE, TEMPERATURE, calibrated, read_calibration, value_at
from sparsor.fieldmap.units import (
    AIRS_PRESSURE_HPA,
    AIRS_TEMPERATURE_C,
    STANDARD_PRESSURE_HPA,
    STANDARD_TEMPERATURE_C,
    converted,
    unit_name,
)
from sparsor.vehicle.sensor import load_sensor

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from sparsor.flightlog import FlightLog, Samples
    from sparsor.vehicle.sensor import SensorProfile


@dataclass(frozen=True, eq=False)
class Readings:
    """A sensor's concentrations.

    Parameters
    ----------
    value : array of float64 (n,)
        NaN where they are unknown.
    unit : str
    profile : SensorProfile
        Its noise in that unit; t90 0 where nothing tells it.
    words : str
        What was done to the readings.
    warnings : tuple of str
    """

    value: NDArray[np.float64]
    unit: str
    profile: SensorProfile
    words: str
    warnings: tuple[str, ...]


def concentrations(
    log: FlightLog,
    samples: Samples,
    *,
    profile: SensorProfile | None,
    calibration: Path | None,
    unit: str | None,
    t90_s: float | None,
) -> Readings:
    """Return a sensor's concentrations in the unit asked for.

    The unit of the readings is the calibration's, else the profile's. Where neither is given it is the one asked for,
    and nothing is converted.

    Parameters
    ----------
    log : FlightLog
    samples : Samples
    profile : SensorProfile, optional
    calibration : Path, optional
    unit : str, optional
    t90_s : float, optional
        Instead of the profile's.

    Raises
    ------
    VehicleError, CalibrationError
        When a file cannot be used, a value it needs is not in the log, or units cannot be converted.
    """
    sensor = load_sensor() if profile is None else profile
    adjustment = None if calibration is None else read_calibration(calibration)
    value = samples.value if adjustment is None else calibrated(log, samples, adjustment)
    done = [] if calibration is None else [f"calibrated by {calibration.name}"]
    stated = (adjustment.unit if adjustment is not None else None) or (None if profile is None else sensor.unit)
    wanted = unit_name(unit or stated or sensor.unit)
    warnings = []
    if stated is not None and unit_name(stated) != wanted:
        value, words = _converted(log, samples, value, unit_name(stated), wanted, sensor.gas)
        done.append(words)
    if stated is None and unit is None:
        warnings.append(f"Nothing tells the unit of the readings: {wanted} is taken; give --unit or --sensor-profile.")
    answer_s = t90_s if t90_s is not None else sensor.t90_s if profile is not None else 0.0
    if profile is None and t90_s is None:
        warnings.append(
            "Nothing tells how slowly the sensor answers: its lag is not undone, and may look like drift; give --t90 "
            "or --sensor-profile."
        )
    done.append(f"response of t90 {answer_s:g} s undone" if answer_s > 0 else "response not undone (no t90 given)")
    slope = _slope(samples.value, value)
    drift_sd_per_h = 0.0 if profile is None else sensor.drift_sd_per_h * slope  # a unit that is not known has none
    changes = {
        "unit": wanted,
        "t90_s": answer_s,
        "noise_sd": sensor.noise_sd * slope,
        "drift_sd_per_h": drift_sd_per_h,
    }
    return Readings(value, wanted, sensor.model_copy(update=changes), "; ".join(done), tuple(warnings))


def _converted(
    log: FlightLog, samples: Samples, value: NDArray[np.float64], stated: str, wanted: str, gas: str
) -> tuple[NDArray[np.float64], str]:
    """Convert at the air's own temperature and pressure where the log tells them; say in words what was done."""
    known = {one.name for one in log.values}
    filled = {}
    for name, usual, (low, high) in (
        (TEMPERATURE, STANDARD_TEMPERATURE_C, AIRS_TEMPERATURE_C),
        (PRESSURE, STANDARD_PRESSURE_HPA, AIRS_PRESSURE_HPA),
    ):
        told = value_at(log, samples, name) if name in known else np.full(value.size, np.nan)
        filled[name] = np.where((told >= low) & (told <= high), told, usual)
    words = f"converted from {stated} to {wanted}"
    if samples.value.size and stated != wanted:
        words += f" at {np.median(filled[TEMPERATURE]):.1f} degrees C and {np.median(filled[PRESSURE]):.0f} hPa"
        words += "" if known >= filled.keys() else " (the log does not tell them)"
    return converted(value, stated, wanted, gas, filled[TEMPERATURE], filled[PRESSURE]), words


def _slope(reading: NDArray[np.float64], value: NDArray[np.float64]) -> float:
    """Return by how much a concentration changes with its reading: what noise is scaled by."""
    known = np.isfinite(value)
    if value is reading or not known.any() or np.ptp(reading[known]) == 0:
        return 1.0
    return float(abs(np.polyfit(reading[known], value[known], 1)[0]))
