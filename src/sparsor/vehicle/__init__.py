"""What flies and what it carries: vehicle profiles, flight times, facts about autopilots."""

from sparsor.vehicle.autopilot import AUTOPILOTS, Autopilot, autopilot_named
from sparsor.vehicle.profile import Vehicle, load_vehicle, packaged_vehicles
from sparsor.vehicle.sensor import SensorProfile, load_sensor, packaged_sensors
from sparsor.vehicle.times import (
    flight_seconds,
    landing_seconds,
    leg_seconds,
    stop_seconds,
    takeoff_seconds,
    usable_seconds,
)

__all__ = [
    "AUTOPILOTS",
    "Autopilot",
    "SensorProfile",
    "Vehicle",
    "autopilot_named",
    "flight_seconds",
    "landing_seconds",
    "leg_seconds",
    "load_sensor",
    "load_vehicle",
    "packaged_sensors",
    "packaged_vehicles",
    "stop_seconds",
    "takeoff_seconds",
    "usable_seconds",
]
