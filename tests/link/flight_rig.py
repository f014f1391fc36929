"""Short flights with the practice autopilot, for the tests of flying."""

from __future__ import annotations

from contextlib import contextmanager
from functools import cache

from mission_strategies import KNOWN_HOME, QUAD
from sparsor.journeys.flying import Choice
from sparsor.link.practice import PracticeAutopilot, PracticeServer, PracticeSettings, built_in_truth, flavour_named
from sparsor.mission import build_mission

LON, LAT = KNOWN_HOME.lon_deg, KNOWN_HOME.lat_deg
STOPS = [(LON + 0.0006, LAT), (LON + 0.0006, LAT + 0.0006), (LON, LAT + 0.0008), (LON - 0.0004, LAT + 0.0002)]


def short_plan(autopilot="ardupilot", stops=STOPS):
    """Return some hundred metres at 12 m, a minute and a half."""
    lon, lat = zip(*stops, strict=True)
    return build_mission(lon, lat, home=KNOWN_HOME, vehicle=QUAD, autopilot=autopilot, altitude_m=12, hold_s=2)


@cache
def _truth():
    return built_in_truth(LON, LAT)


@contextmanager
def practice(autopilot="ardupilot", *, speedup=60, **settings):
    """Run a practice autopilot that keeps its own track: (east, north, up) metres at each of its steps."""
    truth = _truth()
    made = PracticeSettings(home=KNOWN_HOME, flavour=flavour_named(autopilot), truth=truth, **settings)
    vehicle = PracticeAutopilot(made)
    vehicle.track = []
    step = vehicle.flight.step

    def kept(dt_s):
        step(dt_s)
        motion = vehicle.flight.motion
        vehicle.track.append((motion.east_m, motion.north_m, motion.up_m))

    vehicle.flight.step = kept
    with PracticeServer(vehicle, udp=("127.0.0.1", 0), speedup=speedup) as server:
        yield server


def url_of(server):
    return f"udpout://127.0.0.1:{server.udp_port}"


class Witness:
    """A watcher that remembers, answers as it is told, and may do something at an event (once)."""

    def __init__(self, *, yes=True, at="", do=lambda: None, choice=Choice.LEAVE):
        self.yes, self.at, self.do, self.choice = yes, at, do, choice
        self.events, self.views = [], []

    def progress(self, task, done, total):
        pass

    def found(self, vehicle):
        pass

    def confirm(self, report, briefing, _samples):
        self.report, self.briefing = report, briefing
        return self.yes

    def told(self, event):
        self.events.append(event)
        if self.at and self.at in event.text:
            self.at = ""
            self.do()

    def seen(self, view):
        self.views.append(view)

    def interrupted(self):
        return self.choice

    @property
    def words(self):
        return [event.text for event in self.events]
