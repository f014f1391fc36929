"""Routes that minimise the error to expect of the map, searched directly."""

from sparsor.design.refined.readings import T90_OVER_TAU, Sensor
from sparsor.design.refined.search import DEFAULT_ITERATIONS, Route, Task, refine

__all__ = ["DEFAULT_ITERATIONS", "T90_OVER_TAU", "Route", "Sensor", "Task", "refine"]
