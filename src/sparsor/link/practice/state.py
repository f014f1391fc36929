"""What the practice vehicle is at one moment, before anything moves it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.battery import Battery
from sparsor.link.practice.exchange import Outgoing, status_text
from sparsor.link.practice.fence import FenceWatch
from sparsor.link.practice.motion import Aim, Motion
from sparsor.link.practice.navigator import Navigator
from sparsor.link.practice.place import FlatMap
from sparsor.link.practice.returning import Return
from sparsor.link.practice.storage import MISSION
from sparsor.link.practice.troubles import Troubles, during
from sparsor.link.practice.wind import Wind, WindSettings

if TYPE_CHECKING:
    from sparsor.link.practice.flavour import Flavour
    from sparsor.link.practice.parameters import Parameters
    from sparsor.link.practice.transfer import MissionStore
    from sparsor.mission import Home
    from sparsor.vehicle import Vehicle


class FlightState:
    """The vehicle in the air or on the ground.

    Parameters
    ----------
    flavour : Flavour
    vehicle : Vehicle
    store : MissionStore
    parameters : Parameters
    home : Home
        Where it stands at power-up.
    ready_s : float
        From power-up to being allowed to fly missions; the GPS has its fix after half of it.
    wind : Wind, optional
    troubles : Troubles
    """

    def __init__(
        self,
        flavour: Flavour,
        vehicle: Vehicle,
        store: MissionStore,
        parameters: Parameters,
        home: Home,
        ready_s: float,
        wind: Wind | None = None,
        troubles: Troubles = Troubles(),  # noqa: B008 (frozen)
    ) -> None:
        self.flavour, self.vehicle, self.store, self.parameters = flavour, vehicle, store, parameters
        self.place = FlatMap(home.lon_deg, home.lat_deg)
        self.home_amsl_m = home.alt_amsl_m
        self.ready_s = ready_s
        self.time_s = 0.0
        self.mode = flavour.start_mode
        self.armed = False
        self.landed = True
        self.battery = Battery(vehicle.endurance_s)
        self.wind, self.troubles = wind or Wind(WindSettings()), troubles
        self.motion = Motion(vehicle, self.wind)
        self.fence = FenceWatch(store, parameters, self.place, px4=flavour.is_px4)
        self.navigator = self._navigator(self._first())
        self.outbox: list[Outgoing] = []
        self.mission_started = False
        self._guided: Aim | None = None
        self._landed_s, self._disarmed_s = 0.0, math.inf
        self._return = Return()
        self._known_mission = store.changes[MISSION]
        self._blown_since_s, self._wind_said_s = 0.0, -math.inf
        self.took_off_s: float | None = None
        """When it first left the ground."""
        self.position_lost = False
        """Whether it has been without GPS for too long to know where it is."""
        self.station_heard = False
        """Whether a ground station has sent a heartbeat."""
        self.last_fix: tuple[float, float, float] | None = None
        """Longitude, latitude (degrees) and height above home (m) of the last GPS fix."""
        self.last_estimate: tuple[float, float] | None = None
        """Longitude and latitude of the last position that the estimator vouched for."""

    @property
    def lon_lat_deg(self) -> tuple[float, float]:
        """Where the vehicle is."""
        return self.place.degrees(self.motion.east_m, self.motion.north_m)

    @property
    def has_fix(self) -> bool:
        """Whether the GPS knows where it is."""
        return self.clock_set and not during(self.troubles.gps_outage, self.flown_s)

    @property
    def clock_set(self) -> bool:
        """Whether the GPS has told the time, which is then kept."""
        return self.time_s >= 0.5 * self.ready_s

    @property
    def flown_s(self) -> float | None:
        """Seconds since the first take-off, None before it."""
        return None if self.took_off_s is None else self.time_s - self.took_off_s

    @property
    def link_lost(self) -> bool:
        """Whether nothing gets in or out."""
        return during(self.troubles.link_loss, self.flown_s)

    def say(self, text: str, severity: int = mavlink.MAV_SEVERITY_INFO) -> None:
        """Send STATUSTEXT."""
        self.outbox.append(status_text(text, severity))

    def _keep_position(self) -> None:
        """Keep what GPS and estimator know now, for the time when they know no more."""
        if self.has_fix:
            self.last_fix = (*self.lon_lat_deg, self.motion.up_m)
        if self.last_fix is not None and not self.position_lost:
            self.last_estimate = self.lon_lat_deg

    def _first(self) -> int:
        return 1 if self.store.limits.home_is_item_0 else 0

    def _navigator(self, first: int) -> Navigator:
        items = self.store.items[MISSION]
        px4 = self.flavour.is_px4
        return Navigator(items, first, self.place, self.home_amsl_m, self.vehicle, radius_in_item=px4)
