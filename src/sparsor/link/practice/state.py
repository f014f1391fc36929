"""What the practice vehicle is at one moment, before anything moves it."""

from __future__ import annotations

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
    """

    def __init__(
        self,
        flavour: Flavour,
        vehicle: Vehicle,
        store: MissionStore,
        parameters: Parameters,
        home: Home,
        ready_s: float,
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
        self.motion = Motion(vehicle)
        self.fence = FenceWatch(store, parameters, self.place, px4=flavour.is_px4)
        self.navigator = self._navigator(self._first())
        self.outbox: list[Outgoing] = []
        self.mission_started = False
        self._guided: Aim | None = None
        self._landed_s = 0.0
        self._return = Return()
        self._known_mission = store.changes[MISSION]
        self._low_said = False

    @property
    def lon_lat_deg(self) -> tuple[float, float]:
        """Where the vehicle is."""
        return self.place.degrees(self.motion.east_m, self.motion.north_m)

    @property
    def has_fix(self) -> bool:
        """Whether the GPS knows where it is."""
        return self.time_s >= 0.5 * self.ready_s

    def say(self, text: str, severity: int = mavlink.MAV_SEVERITY_INFO) -> None:
        """Send STATUSTEXT."""
        self.outbox.append(status_text(text, severity))

    def _first(self) -> int:
        return 1 if self.store.limits.home_is_item_0 else 0

    def _navigator(self, first: int) -> Navigator:
        items = self.store.items[MISSION]
        px4 = self.flavour.is_px4
        return Navigator(items, first, self.place, self.home_amsl_m, self.vehicle, radius_in_item=px4)
