"""Vehicle profiles: what a vehicle can do, read from TOML and checked once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from sparsor.vehicle.packaged import Profile, load_profile, packaged_names

if TYPE_CHECKING:
    from pathlib import Path

# MAV_TYPE of each kind (MAVLink common.xml; 22 is VTOL_FIXEDROTOR, lift motors and a pusher). A new kind is an entry
# here and in `Kind`, a packaged profile, and its own sequence of items in mission.
MAV_TYPES = {"quad": 2, "plane": 1, "vtol": 22, "rover": 10, "boat": 11}
Kind = Literal["quad", "plane", "vtol", "rover", "boat"]

Speed = Annotated[float, Field(gt=0, le=200, allow_inf_nan=False)]
Watts = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, le=100_000)]


class Vehicle(Profile):
    """What a vehicle can do; every value in the unit of its name.

    Build one with `load_vehicle` or `Vehicle.from_mapping`, whose errors are sentences.

    Parameters
    ----------
    name : str
        What the profile is called.
    kind : {"quad", "plane", "vtol", "rover", "boat"}
        Decides the flight items; ``"quad"`` is any multirotor that hovers.
    cruise_m_s, climb_m_s, descent_m_s : float
        Along a leg, up, and down to `touchdown_height_m`. Airspeed of what flies, in a wind.
    touchdown_m_s, touchdown_height_m : float
        Speed of the last part of a vertical landing, and the height above home at which it begins.
    acceleration_m_s2 : float
        Of speeding up and of braking along a leg.
    turn_radius_m : float
        Of a turn at cruise; 0 for what turns on the spot. A plane's circles have it.
    transition_s : float
        Of a VTOL, each way between hovering and flying as a plane.
    glide_deg : float
        Slope of a plane's and a VTOL's last approach.
    endurance_s, reserve_fraction : float
        Time from full to empty at cruise, and the share of it that is never planned for.
    energy_wh, cruise_w, hover_w, climb_w, descent_w : float, optional
        Instead of `endurance_s`: the battery's energy, and the power of each phase (default: `cruise_w`).
    ceiling_m : float
        Height above home beyond which a mission is warned about. No claim of compliance.
    acceptance_radius_m : float
        How near to a waypoint counts as reached.
    max_items, max_fence_points, max_rally_points : int, optional
        What its board stores, where that is less than usual.
    """

    name: Annotated[str, Field(min_length=1, max_length=60)]
    kind: Kind
    cruise_m_s: Speed
    climb_m_s: Speed
    descent_m_s: Speed
    touchdown_m_s: Speed = 0.5
    touchdown_height_m: Annotated[float, Field(ge=0, le=1000, allow_inf_nan=False)] = 10.0
    acceleration_m_s2: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]
    turn_radius_m: Annotated[float, Field(ge=0, le=5000, allow_inf_nan=False)] = 0.0
    transition_s: Annotated[float, Field(ge=0, le=600, allow_inf_nan=False)] = 0.0
    glide_deg: Annotated[float, Field(ge=1, le=45, allow_inf_nan=False)] = 6.0
    endurance_s: Annotated[float, Field(gt=0, le=1e7, allow_inf_nan=False)]
    reserve_fraction: Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)] = 0.2
    energy_wh: Annotated[float, Field(gt=0, le=1e7, allow_inf_nan=False)] | None = None
    cruise_w: Watts | None = None
    hover_w: Watts | None = None
    climb_w: Watts | None = None
    descent_w: Watts | None = None
    ceiling_m: Annotated[float, Field(gt=0, le=20_000, allow_inf_nan=False)] = 120.0
    acceptance_radius_m: Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)] = 2.0
    max_items: Count | None = None
    max_fence_points: Count | None = None
    max_rally_points: Count | None = None

    @model_validator(mode="before")
    @classmethod
    def _endurance_of_the_battery(cls, given: Any) -> Any:  # noqa: ANN401 (pydantic hands over whatever was given)
        """Work out the endurance at cruise where energy and power are given instead."""
        if not isinstance(given, dict):
            return given
        powers = [key for key in ("cruise_w", "hover_w", "climb_w", "descent_w") if key in given]
        if "energy_wh" not in given:
            if powers:
                raise ValueError(f"{', '.join(powers)} without energy_wh: give both, or endurance_s alone")
            return given
        if "endurance_s" in given:
            raise ValueError("give either endurance_s, or energy_wh with cruise_w")
        energy, power = given["energy_wh"], given.get("cruise_w")
        if not (isinstance(energy, int | float) and isinstance(power, int | float) and power > 0):
            raise ValueError("energy_wh needs a cruise_w above 0")
        return {**given, "endurance_s": energy * 3600.0 / power}

    @model_validator(mode="after")
    def _as_its_kind_moves(self) -> Self:
        if self.circles and self.turn_radius_m == 0:
            raise ValueError(f"a {self.kind} turns in circles: give its turn_radius_m")
        if self.kind != "vtol" and self.transition_s > 0:
            raise ValueError(f"transition_s is of a vtol, not of a {self.kind}")
        return self

    @property
    def mav_type(self) -> int:
        """MAV_TYPE of this kind of vehicle."""
        return MAV_TYPES[self.kind]

    @property
    def flies(self) -> bool:
        """Whether it leaves the ground."""
        return self.kind not in ("rover", "boat")

    @property
    def circles(self) -> bool:
        """Whether it cannot stay where it is along its route, and circles instead."""
        return self.kind in ("plane", "vtol")

    @property
    def lifts(self) -> bool:
        """Whether it takes off and lands vertically."""
        return self.kind in ("quad", "vtol")

    def load(self, phase: Literal["cruise", "hover", "climb", "descent"]) -> float:
        """Return the power of a phase as a share of that at cruise; 1 where only the endurance is known."""
        power = {"hover": self.hover_w, "climb": self.climb_w, "descent": self.descent_w}.get(phase)
        return 1.0 if power is None or self.cruise_w is None else power / self.cruise_w


def packaged_vehicles() -> list[str]:
    """Return the names of the profiles that come with sparsor, sorted."""
    return packaged_names("profiles")


def load_vehicle(name_or_path: str | Path) -> Vehicle:
    """Return a packaged vehicle by name, or the one that a .toml file describes.

    Parameters
    ----------
    name_or_path : str or Path
        ``"quad"``, ``"plane"``, ``"vtol"``, ``"rover"``, ``"boat"``, or a path that ends in ``.toml``.

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
