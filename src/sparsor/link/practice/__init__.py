"""A practice autopilot that speaks real MAVLink, for rehearsing a mission; not flight dynamics.

See docs/practice-autopilot.md for what it does as ArduPilot and PX4 do, and what it leaves out.
"""

from sparsor.link.practice.autopilot import PracticeAutopilot, PracticeSettings, Sample
from sparsor.link.practice.flavour import FLAVOURS, Flavour, flavour_named
from sparsor.link.practice.sensor import PracticeSensor, RasterTruth, SensorSettings, Truth, built_in_truth
from sparsor.link.practice.server import PracticeServer

__all__ = [
    "FLAVOURS",
    "Flavour",
    "PracticeAutopilot",
    "PracticeSensor",
    "PracticeServer",
    "PracticeSettings",
    "RasterTruth",
    "Sample",
    "SensorSettings",
    "Truth",
    "built_in_truth",
    "flavour_named",
]
