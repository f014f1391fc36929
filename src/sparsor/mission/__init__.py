"""What to fly: flight items, fences, plans in and out.

The .plan format, frames and commands are those of docs/mission-items.md.
"""

from sparsor.mission.builder import build_mission, flight_time_s
from sparsor.mission.describe import PlanDescription, describe_plan
from sparsor.mission.exports import FORMATS, export_bytes
from sparsor.mission.fault import Fault
from sparsor.mission.faults import judged_faults, plan_faults
from sparsor.mission.fence import fence_around
from sparsor.mission.items import MissionItem
from sparsor.mission.plan import Circle, ComplexItem, Fence, Home, MissionPlan, RallyPoint, transits
from sparsor.mission.reader import parse_plan, read_plan
from sparsor.mission.timing import FlightTime, time_plan
from sparsor.mission.vehiclefaults import check_faults, vehicle_faults
from sparsor.mission.writer import plan_bytes

__all__ = [
    "FORMATS",
    "Circle",
    "ComplexItem",
    "Fault",
    "Fence",
    "FlightTime",
    "Home",
    "MissionItem",
    "MissionPlan",
    "PlanDescription",
    "RallyPoint",
    "build_mission",
    "check_faults",
    "describe_plan",
    "export_bytes",
    "fence_around",
    "flight_time_s",
    "judged_faults",
    "parse_plan",
    "plan_bytes",
    "plan_faults",
    "read_plan",
    "time_plan",
    "transits",
    "vehicle_faults",
]
