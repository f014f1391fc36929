"""Says in words what becomes of the practice vehicle, for the person at the desk."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.link.practice.storage import MISSION
from sparsor.link.practice.troubles import during

if TYPE_CHECKING:
    from collections.abc import Callable

    from sparsor.link.practice.flight import Flight

Change = tuple["Callable[[], bool]", str, str]


class Narrator:
    """Tells what changes, one line each, with the simulated time; `step` it with the vehicle.

    Parameters
    ----------
    flight : Flight
    told : callable
        Gets the lines.
    """

    def __init__(self, flight: Flight, told: Callable[[str], None]) -> None:
        self._flight, self._told = flight, told
        troubles = flight.troubles
        # The vehicle lands before it disarms, in the same step.
        self._changes: tuple[Change, ...] = (
            (lambda: not flight.landed, "take-off", "landed"),
            (lambda: flight.armed, "armed", "disarmed"),
            (lambda: flight.battery.low, "the battery is low", "the battery was changed"),
            (lambda: flight.blown, "the wind is too strong: it drifts", "it holds its own against the wind again"),
            (
                lambda: during(troubles.silent_sensor, flight.flown_s),
                "the sensor falls silent",
                "the sensor sends again",
            ),
            (lambda: during(troubles.gps_outage, flight.flown_s), "the GPS loses its fix", "the GPS has a fix again"),
            (lambda: flight.link_lost, "the link is lost", "the link is back"),
        )
        self._before = [holds() for holds, _, _ in self._changes]
        self._missions = flight.store.changes[MISSION]

    def say(self, text: str) -> None:
        """Tell something with the simulated time."""
        self._told(f"{self._flight.time_s:7.1f} s  {text}")

    def step(self) -> None:
        """Look at everything once."""
        for place, (holds, begins, ends) in enumerate(self._changes):
            now = holds()
            if now != self._before[place]:
                self._before[place] = now
                self.say(begins if now else ends)
        store = self._flight.store
        if self._missions != store.changes[MISSION]:
            self._missions = store.changes[MISSION]
            items = len(store.items[MISSION]) - int(store.limits.home_is_item_0)
            self.say(f"mission received, {items} items" if items > 0 else "mission cleared")
