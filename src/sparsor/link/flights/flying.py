"""Arming, starting and watching a mission until the vehicle has landed."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NoReturn, Self

from sparsor.errors import LeftBehindError, LinkFailureError, StoppedError
from sparsor.link.flights.linkwatch import LinkWatch
from sparsor.link.flights.modes import flight_modes
from sparsor.link.flights.orders import ACCEPTED, ARM_DISARM, command_title, disarm, order, result_words
from sparsor.link.flights.views import Event
from sparsor.link.flights.watching import KINDS, Tracker

if TYPE_CHECKING:
    from collections.abc import Callable

    from sparsor.link.connection import Connection
    from sparsor.link.flights.samples import SampleCounter
    from sparsor.link.flights.views import View
    from sparsor.link.vehicles import FoundVehicle
    from sparsor.mission import MissionPlan

# MAV_CMD.
RETURN_TO_LAUNCH, SET_MODE, MISSION_START = 20, 176, 300
CUSTOM_MODE: Final = 1.0  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
TICK_S: Final = 0.25
RETRY_S: Final = 1.0
UNDER_WAY_S: Final = 20.0  # from an accepted start to leaving the ground
FLIES_ON: Final = "flies on by itself"  # what a vehicle does that is not watched any more
SETTLE_S: Final = 1.5  # what is still on its way when the vehicle disarms


@dataclass(frozen=True)
class FlightResult:
    """How a flight ended.

    Parameters
    ----------
    outcome : {"complete", "returned early", "disarmed in flight"}
    reached, missed : tuple of int
        Waypoints, by their place among the plan's items (1 is the first).
    seconds : float
        From leaving the ground to disarming, by the vehicle's clock.
    distance_m : float
        Length of the track over ground.
    warnings : tuple of str
    """

    outcome: str
    reached: tuple[int, ...]
    missed: tuple[int, ...]
    seconds: float
    distance_m: float
    warnings: tuple[str, ...]


class Flight:
    """One mission of one vehicle, from arming to disarming.

    Parameters
    ----------
    connection : Connection
    vehicle : FoundVehicle
    plan : MissionPlan
        What the vehicle holds.
    samples : SampleCounter
        Listening on the connection.
    told : callable
        Gets every `Event`.
    seen : callable
        Gets a `View` several times a second.

    Raises
    ------
    LinkError
        When it is a kind of vehicle that we cannot start.
    """

    def __init__(
        self,
        connection: Connection,
        vehicle: FoundVehicle,
        plan: MissionPlan,
        samples: SampleCounter,
        *,
        told: Callable[[Event], None] = lambda _: None,
        seen: Callable[[View], None] = lambda _: None,
    ) -> None:
        self._modes = flight_modes(vehicle)
        self._connection, self._vehicle, self._told, self._seen = connection, vehicle, told, seen
        self._tracker = Tracker(plan, vehicle, samples, self._modes.mission)
        self._warnings: dict[str, None] = {}
        self._link = LinkWatch(connection, vehicle)
        self._inbox = connection.inbox(*KINDS, system_id=vehicle.system_id)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._inbox.__exit__()

    @property
    def under_way(self) -> bool:
        """Whether the vehicle left the ground."""
        return self._tracker.flown

    def start(self, ready_timeout_s: float) -> None:
        """Arm and start the mission, again and again until the vehicle is ready for it and leaves the ground.

        A vehicle arms before AUTO has the position it requires, and disarms itself when it idles: each attempt does
        all of it. When the time is over it is disarmed.

        Raises
        ------
        LeftBehindError
            When it does not start in time, in its own words, or the link is gone. StoppedError after a Ctrl-C on the
            ground.
        """
        deadline_s = time.monotonic() + ready_timeout_s
        told: str | None = None
        try:
            self._link.insist()
            under_way = self._tracker.flown
            while not under_way:
                refusal = self._attempt()
                # What it says comes a little after its answer.
                under_way = self._wait(UNDER_WAY_S if refusal is None else TICK_S)
                if refusal is not None and told != (told := f"{refusal}{self._its_words()}"):
                    self._tell(Event(f"waiting until it is ready: {told}"))
                if not under_way and time.monotonic() > deadline_s:
                    self._give_up(refusal, ready_timeout_s)
                under_way = under_way or self._wait(RETRY_S)
        except LeftBehindError:
            raise
        except LinkFailureError as error:
            state = "state unknown, it may take off by itself"
            raise LeftBehindError(f"{error}, while it was started. The vehicle: {state}", state) from error
        except KeyboardInterrupt:
            if self._tracker.flown or not disarm(self._connection, self._vehicle):
                raise
            raise StoppedError("interrupted before take-off. The vehicle: disarmed", "disarmed") from None

    def watch(self, lost_timeout_s: float) -> FlightResult:
        """Follow the flight until the vehicle is disarmed; can be called again after a Ctrl-C.

        A vehicle that never left the ground has ended its flight as soon as it is disarmed.

        Raises
        ------
        LeftBehindError
            When nothing is heard of the vehicle for `lost_timeout_s` seconds, or the link is gone.
        """
        try:
            while not self._tracker.ended and (self._tracker.flown or self._tracker.armed):
                self._listen(time.monotonic() + TICK_S, lost_timeout_s)
                self._seen(self._tracker.view())
            self._listen(time.monotonic() + SETTLE_S)
        except LinkFailureError as error:
            raise LeftBehindError(f"{error}. The vehicle: flies on by itself", FLIES_ON) from error
        return self._result()

    def return_home(self) -> None:
        """Order the vehicle home (MAV_CMD_NAV_RETURN_TO_LAUNCH) and tell whether it obeys."""
        try:
            result = order(self._connection, self._vehicle, RETURN_TO_LAUNCH)
        except LinkFailureError as error:
            self._tell(Event(f"the vehicle may not return home: {error}", warning=True))
            return
        obeys = result == ACCEPTED
        words = "the vehicle returns home" if obeys else f"the vehicle does not return home: {result_words(result)}"
        self._tell(Event(words, warning=not obeys))

    def _attempt(self) -> str | None:
        """Arm and start once; return why not."""
        self._tracker.statustexts.forget()
        orders: list[tuple[int, tuple[float, ...]]] = [(MISSION_START, ())]
        if self._modes.arming is not None and not self._tracker.armed:
            orders = [(SET_MODE, (CUSTOM_MODE, float(self._modes.arming))), (ARM_DISARM, (1.0,)), *orders]
        for command, params in orders:
            result = order(self._connection, self._vehicle, command, *params)
            if result != ACCEPTED:
                return f"{command_title(command)} is {result_words(result)}"
        return None

    def _wait(self, seconds: float) -> bool:
        """Listen for so long, or until the vehicle is under way or disarmed itself; return whether it is under way."""
        end_s, armed = time.monotonic() + seconds, self._tracker.armed
        while not self._tracker.flown and (now_s := time.monotonic()) < end_s:
            self._listen(min(now_s + TICK_S, end_s))
            if armed and not self._tracker.armed:
                break
            armed = self._tracker.armed
        return self._tracker.flown

    def _its_words(self) -> str:
        said = self._tracker.statustexts.last()
        return f" (it says: {'; '.join(said)})" if said else ""

    def _give_up(self, refusal: str | None, ready_timeout_s: float) -> NoReturn:
        words = self._its_words()
        why = refusal or "it accepted the start and stays where it is"
        disarmed = disarm(self._connection, self._vehicle)
        state = f"{'disarmed' if disarmed else 'armed on the ground'}, it holds the plan"
        raise LeftBehindError(
            f"the mission did not start within {ready_timeout_s:g} s: {why}{words}. The vehicle: {state}", state
        )

    def _listen(self, deadline_s: float, lost_timeout_s: float | None = None) -> None:
        for received in self._inbox.until(deadline_s):
            self._link.heard(received)
            for event in self._tracker.take(received):
                self._tell(event)
            if time.monotonic() > deadline_s:  # there may be more than can be taken in that time
                break
        change = self._link.check(lost_timeout_s, flying=self._tracker.flown)
        if change is not None:
            self._tell(change)

    def _tell(self, event: Event) -> None:
        if event.warning:
            self._warnings[event.text] = None
        self._told(event)

    def _result(self) -> FlightResult:
        tracker = self._tracker
        waypoints, reached = tracker.waypoints, tracker.reached
        missed = tuple(place + 1 for place in waypoints if place not in reached)
        outcome = "disarmed in flight" if not tracker.on_ground else "returned early" if missed else "complete"
        return FlightResult(
            outcome=outcome,
            reached=tuple(place + 1 for place in waypoints if place in reached),
            missed=missed,
            seconds=round(tracker.seconds, 1),
            distance_m=round(tracker.flown_m, 1),
            warnings=tuple(self._warnings),
        )
