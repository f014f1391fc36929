"""Routes that minimise the error to expect of the map, searched directly."""

from sparsor.design.refined.readings import Sensor
from sparsor.design.refined.search import DEFAULT_ITERATIONS, Route, Task, refine

__all__ = ["DEFAULT_ITERATIONS", "Route", "Sensor", "Task", "refine"]
