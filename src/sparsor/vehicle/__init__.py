"""What flies and what it carries: vehicle profiles, flight times, facts about autopilots."""

from sparsor.vehicle.autopilot import AUTOPILOTS, Autopilot, autopilot_named
from sparsor.vehicle.profile import Vehicle, load_vehicle, packaged_vehicles
from sparsor.vehicle.sensor import SensorProfile, load_sensor, packaged_sensors
from sparsor.vehicle.times import (
    approach_m,
    approach_up_m,
    climb_out_m,
    flight_seconds,
    landing_seconds,
    leg_seconds,
    stop_seconds,
    takeoff_seconds,
    turn_seconds,
    usable_seconds,
)
from sparsor.vehicle.wind import CALM, SteadyWind, check_wind, ground_speed_m_s

__all__ = [
    "AUTOPILOTS",
    "CALM",
    "Autopilot",
    "SensorProfile",
    "SteadyWind",
    "Vehicle",
    "approach_m",
    "approach_up_m",
    "autopilot_named",
    "check_wind",
    "climb_out_m",
    "flight_seconds",
    "ground_speed_m_s",
    "landing_seconds",
    "leg_seconds",
    "load_sensor",
    "load_vehicle",
    "packaged_sensors",
    "packaged_vehicles",
    "stop_seconds",
    "takeoff_seconds",
    "turn_seconds",
    "usable_seconds",
]
