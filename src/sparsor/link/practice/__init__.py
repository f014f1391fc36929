"""A practice autopilot that speaks real MAVLink, for rehearsing a mission; not flight dynamics.

See docs/practice-autopilot.md for what it does as ArduPilot and PX4 do, and what it leaves out.
"""

from sparsor.link.practice.autopilot import PracticeAutopilot, PracticeSettings, Sample
from sparsor.link.practice.flavour import FLAVOURS, Flavour, flavour_named
from sparsor.link.practice.sensor import PracticeSensor, SensorSettings, Truth
from sparsor.link.practice.server import PracticeServer
from sparsor.link.practice.troubles import LinkTroubles, Troubles, Window
from sparsor.link.practice.truth import RasterTruth, built_in_over, built_in_truth, field_truth, truth_netcdf
from sparsor.link.practice.wind import Wind, WindSettings

__all__ = [
    "FLAVOURS",
    "Flavour",
    "LinkTroubles",
    "PracticeAutopilot",
    "PracticeSensor",
    "PracticeServer",
    "PracticeSettings",
    "RasterTruth",
    "Sample",
    "SensorSettings",
    "Troubles",
    "Truth",
    "Wind",
    "WindSettings",
    "Window",
    "built_in_over",
    "built_in_truth",
    "field_truth",
    "flavour_named",
    "truth_netcdf",
]
