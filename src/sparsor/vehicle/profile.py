"""Vehicle profiles: what a vehicle can do, read from TOML and checked once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from sparsor.vehicle.packaged import Profile, load_profile, packaged_names

if TYPE_CHECKING:
    from pathlib import Path

# MAV_TYPE of each kind (MAVLink common.xml). A new kind is an entry here and in `Kind`, a packaged profile,
# and its own sequence of items in mission.
MAV_TYPES = {"quad": 2}
Kind = Literal["quad"]

Speed = Annotated[float, Field(gt=0, le=200, allow_inf_nan=False)]


class Vehicle(Profile):
    """What a vehicle can do; every value in the unit of its name.

    Build one with `load_vehicle` or `Vehicle.from_mapping`, whose errors are sentences.

    Parameters
    ----------
    name : str
        What the profile is called.
    kind : str
        Decides the flight items: ``"quad"``, any multirotor that hovers.
    cruise_m_s, climb_m_s, descent_m_s : float
        Along a leg, up, and down to `touchdown_height_m`.
    touchdown_m_s, touchdown_height_m : float
        Speed of the last part of the landing, and the height above home at which it begins.
    acceleration_m_s2 : float
        Of speeding up and of braking along a leg.
    endurance_s, reserve_fraction : float
        Time from full to empty, and the share of it that is never planned for.
    ceiling_m : float
        Height above home beyond which a mission is warned about. No claim of compliance.
    acceptance_radius_m : float
        How near to a waypoint counts as reached.
    """

    name: Annotated[str, Field(min_length=1, max_length=60)]
    kind: Kind
    cruise_m_s: Speed
    climb_m_s: Speed
    descent_m_s: Speed
    touchdown_m_s: Speed = 0.5
    touchdown_height_m: Annotated[float, Field(ge=0, le=1000, allow_inf_nan=False)] = 10.0
    acceleration_m_s2: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]
    endurance_s: Annotated[float, Field(gt=0, le=1e7, allow_inf_nan=False)]
    reserve_fraction: Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)] = 0.2
    ceiling_m: Annotated[float, Field(gt=0, le=20_000, allow_inf_nan=False)] = 120.0
    acceptance_radius_m: Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)] = 2.0

    @property
    def mav_type(self) -> int:
        """MAV_TYPE of this kind of vehicle."""
        return MAV_TYPES[self.kind]


def packaged_vehicles() -> list[str]:
    """Return the names of the profiles that come with sparsor, sorted."""
    return packaged_names("profiles")


def load_vehicle(name_or_path: str | Path) -> Vehicle:
    """Return a packaged vehicle by name, or the one that a .toml file describes.

    Parameters
    ----------
    name_or_path : str or Path
        ``"quad"``, or a path that ends in ``.toml``.

    Raises
    ------
    VehicleError
        When the name is unknown, the file cannot be read, or a value in it is not allowed.

    Examples
    --------
    >>> load_vehicle("quad").cruise_m_s
    10.0
    """
    return load_profile(Vehicle, "vehicle", "profiles", name_or_path)
