"""Sparsor: the shortest flight whose samples rebuild the whole map, as a MAVLink mission.

The names below are the public API; each is imported when it is first used.

Examples
--------
>>> import sparsor
>>> sparsor.parse_budget("25min").value
1500.0
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from sparsor.design import lasso, parse_budget, search, shortest_path
    from sparsor.errors import InputError, OutputError, SparsorError
    from sparsor.geodesy import BoundingBox, Grid
    from sparsor.geodesy.areas import read_area
    from sparsor.journeys.folder import write_mission
    from sparsor.journeys.learning import LearnRequest, learn_from_fields
    from sparsor.journeys.mapfiles import write_map
    from sparsor.journeys.planning import plan_mission
    from sparsor.journeys.reconstructing import ReconstructRequest, reconstruct
    from sparsor.mission import build_mission, plan_bytes, read_plan
    from sparsor.mission.sidecar import read_sidecar
    from sparsor.mission.specification import read_specification, specification
    from sparsor.prior import Field, Model, read_model
    from sparsor.prior.reading import read_field
    from sparsor.vehicle import Vehicle, load_vehicle

_HOMES = {
    "sparsor.design": ("lasso", "parse_budget", "search", "shortest_path"),
    "sparsor.errors": ("InputError", "OutputError", "SparsorError"),
    "sparsor.geodesy": ("BoundingBox", "Grid"),
    "sparsor.geodesy.areas": ("read_area",),
    "sparsor.journeys.learning": ("LearnRequest", "learn_from_fields"),
    "sparsor.journeys.folder": ("write_mission",),
    "sparsor.journeys.mapfiles": ("write_map",),
    "sparsor.journeys.planning": ("plan_mission",),
    "sparsor.journeys.reconstructing": ("ReconstructRequest", "reconstruct"),
    "sparsor.mission": ("build_mission", "plan_bytes", "read_plan"),
    "sparsor.mission.sidecar": ("read_sidecar",),
    "sparsor.mission.specification": ("read_specification", "specification"),
    "sparsor.prior": ("Field", "Model", "read_model"),
    "sparsor.prior.reading": ("read_field",),
    "sparsor.vehicle": ("Vehicle", "load_vehicle"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "BoundingBox",
    "Field",
    "Grid",
    "InputError",
    "LearnRequest",
    "Model",
    "OutputError",
    "ReconstructRequest",
    "SparsorError",
    "Vehicle",
    "__version__",
    "build_mission",
    "lasso",
    "learn_from_fields",
    "load_vehicle",
    "parse_budget",
    "plan_bytes",
    "plan_mission",
    "read_area",
    "read_field",
    "read_model",
    "read_plan",
    "read_sidecar",
    "read_specification",
    "reconstruct",
    "search",
    "shortest_path",
    "specification",
    "write_map",
    "write_mission",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401 (whatever the name stands for)
    if name not in _HOME_OF:
        raise AttributeError(f"module 'sparsor' has no attribute '{name}'")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
