"""The wind that a mission is planned for, and what it does to the speed over the ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import VehicleError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from sparsor.vehicle.profile import Vehicle

STRONGEST_M_S = 60.0


@dataclass(frozen=True)
class SteadyWind:
    """A level wind, the same everywhere and all the time.

    Parameters
    ----------
    speed_m_s : float
        0..60.
    from_deg : float
        Where it comes from, clockwise from north, -360..360.

    Raises
    ------
    VehicleError
        When a value is out of range.
    """

    speed_m_s: float = 0.0
    from_deg: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.speed_m_s <= STRONGEST_M_S:
            raise VehicleError(f"a wind of {self.speed_m_s:g} m/s; allowed are 0..{STRONGEST_M_S:g}")
        if not -360 <= self.from_deg <= 360:
            raise VehicleError(f"a wind from {self.from_deg:g} degrees; allowed are -360..360, clockwise from north")


CALM = SteadyWind()


def check_wind(vehicle: Vehicle, wind: SteadyWind, speed_m_s: float) -> None:
    """Refuse a wind that cannot be flown against: a flight that comes home has to.

    Raises
    ------
    VehicleError
    """
    if vehicle.flies and wind.speed_m_s >= speed_m_s:
        raise VehicleError(
            f"a wind of {wind.speed_m_s:g} m/s cannot be flown against at an airspeed of {speed_m_s:g} m/s: wait for "
            "less wind, or give a higher --speed where the vehicle has it"
        )


def ground_speed_m_s(
    vehicle: Vehicle, speed_m_s: float, course_deg: ArrayLike, wind: SteadyWind = CALM
) -> NDArray[np.float64]:
    """Return the speed over the ground along courses, metres per second.

    The wind triangle: at the airspeed given the vehicle crabs into the wind to keep to its course. A plane and a VTOL
    gain from a wind behind them; a multirotor holds the speed over the ground that it was told, as both autopilots do,
    and only loses. What drives or swims keeps its speed.

    Parameters
    ----------
    vehicle : Vehicle
    speed_m_s : float
        Airspeed; has to be above the wind's (`check_wind`).
    course_deg : array_like
        Clockwise from north.
    wind : SteadyWind

    Examples
    --------
    >>> from sparsor.vehicle import load_vehicle
    >>> north_wind = SteadyWind(5.0, 0.0)
    >>> [float(ground_speed_m_s(load_vehicle(kind), 10.0, 180.0, north_wind)) for kind in ("plane", "quad")]
    [15.0, 10.0]
    """
    course = np.asarray(course_deg, dtype=np.float64)
    if not vehicle.flies or wind.speed_m_s == 0:
        return np.full(course.shape, speed_m_s)
    angle = np.radians(course - wind.from_deg)
    against, across = wind.speed_m_s * np.cos(angle), wind.speed_m_s * np.sin(angle)
    over_ground = np.sqrt(np.maximum(speed_m_s**2 - across**2, 0.0)) - against
    return over_ground if vehicle.circles else np.minimum(over_ground, speed_m_s)
