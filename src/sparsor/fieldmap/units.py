"""Units of gas concentrations: shares of the air's molecules and masses in its volume."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from sparsor.errors import CalibrationError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

MOLAR_MASS_G: Final = {
    "NO2": 46.0055,
    "NO": 30.0061,
    "O3": 47.9982,
    "SO2": 64.0638,
    "CO": 28.0101,
    "CO2": 44.0095,
    "CH4": 16.0425,
    "NH3": 17.0305,
    "H2S": 34.0809,
}
STANDARD_TEMPERATURE_C: Final = 25.0
"""Where the log does not tell it; with `STANDARD_PRESSURE_HPA` the reference of most limits for NO2 outside the EU."""
STANDARD_PRESSURE_HPA: Final = 1013.25
AIRS_TEMPERATURE_C: Final = (-120.0, 125.0)
AIRS_PRESSURE_HPA: Final = (10.0, 2000.0)
"""What the air at a vehicle can have; a barometer that has not begun shows 0."""
_GAS_CONSTANT = 8.31446261815324  # J / (mol K)
_ABSOLUTE_ZERO_C = -273.15


@dataclass(frozen=True)
class _Unit:
    kind: Literal["share", "mass"]
    scale: float
    """In molecules of a molecule of air, or in grams per cubic metre."""


_UNITS: Final = {
    "ppt": _Unit("share", 1e-12),
    "ppb": _Unit("share", 1e-9),
    "ppm": _Unit("share", 1e-6),
    "ng/m3": _Unit("mass", 1e-9),
    "ug/m3": _Unit("mass", 1e-6),
    "mg/m3": _Unit("mass", 1e-3),
}
UNITS: Final = tuple(_UNITS)


def unit_name(text: str) -> str:
    """Return a unit as we write it: "ug/m3" for "µg/m³" or "ug m-3"; others as they are.

    Examples
    --------
    >>> unit_name("µg/m³"), unit_name("PPB"), unit_name("counts")
    ('ug/m3', 'ppb', 'counts')
    """
    plain = text.strip().replace("µ", "u").replace("μ", "u").replace("³", "3").replace("^", "").replace(" m-3", "/m3")
    return plain.lower() if plain.lower() in _UNITS else text.strip()


def converted(
    value: ArrayLike,
    unit: str,
    wanted: str,
    gas: str,
    temperature_c: ArrayLike = STANDARD_TEMPERATURE_C,
    pressure_hpa: ArrayLike = STANDARD_PRESSURE_HPA,
) -> NDArray[np.float64]:
    """Return concentrations in another unit.

    Parameters
    ----------
    value : array_like
    unit, wanted : str
        From which and to which; the same unit changes nothing, whatever it is.
    gas : str
        One of `MOLAR_MASS_G`; matters between shares and masses only.
    temperature_c, pressure_hpa : array_like
        Of the air, where shares become masses or masses shares.

    Raises
    ------
    CalibrationError
        When a unit or the gas is unknown, or the air cannot be so.

    Examples
    --------
    >>> float(converted(1.0, "ppb", "ug/m3", "NO2").round(3))
    1.88
    """
    values = np.asarray(value, dtype=np.float64)
    one, other = unit_name(unit), unit_name(wanted)
    if one == other:
        return values
    origin, target = _known(one), _known(other)
    if origin.kind == target.kind:
        return values * (origin.scale / target.scale)
    grams = _grams_per_share(gas, temperature_c, pressure_hpa)
    factor = grams if origin.kind == "share" else 1.0 / grams
    return values * factor * (origin.scale / target.scale)


def _known(unit: str) -> _Unit:
    if unit not in _UNITS:
        raise CalibrationError(f"the unit '{unit}' cannot be converted; those that can are {', '.join(UNITS)}")
    return _UNITS[unit]


def _grams_per_share(gas: str, temperature_c: ArrayLike, pressure_hpa: ArrayLike) -> NDArray[np.float64]:
    """Return the mass in a cubic metre of the pure gas at the air's temperature and pressure, g/m3."""
    if gas.upper() not in MOLAR_MASS_G:
        known = ", ".join(MOLAR_MASS_G)
        raise CalibrationError(
            f"the gas '{gas}' has no known molar mass; known are {known}: name it in the sensor profile"
        )
    given_c, given_hpa = np.asarray(temperature_c, dtype=np.float64), np.asarray(pressure_hpa, dtype=np.float64)
    for name, given, unit, (low, high) in (
        ("temperature", given_c, "degrees C", AIRS_TEMPERATURE_C),
        ("pressure", given_hpa, "hPa", AIRS_PRESSURE_HPA),
    ):
        good = (given >= low) & (given <= high)
        if not good.all():
            raise CalibrationError(
                f"a {name} of {given[~good].flat[0]:g} {unit} is not the air's; allowed are {low:g}..{high:g}"
            )
    return MOLAR_MASS_G[gas.upper()] * given_hpa * 100.0 / (_GAS_CONSTANT * (given_c - _ABSOLUTE_ZERO_C))
