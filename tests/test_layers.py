"""The house of design.md: a stage imports from the stages above it and from no other."""

from __future__ import annotations

import ast
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

import sparsor

PACKAGE = Path(sparsor.__file__).parent
STAGES = (
    "errors",
    "core",
    "plot",
    "geodesy",
    "prior",
    "vehicle",
    "design",
    "mission",
    "link",
    "flightlog",
    "fieldmap",
    "study",
    "journeys",
    "cli",
)
ONLY_IN = {"pyproj": "sparsor.geodesy.lengths", "mavsdk": "sparsor.link"}
LATE = frozenset({"rasterio", "xarray", "matplotlib", "dask", "distributed", "mavsdk", "sklearn", "pyogrio"})
NOT_FOR_HELP = ("numpy", "numba", "scipy", "sklearn", "matplotlib", "rasterio")


@dataclass(frozen=True)
class Import:
    """One imported name, in full, and when it is imported."""

    name: str
    line: int
    at_import: bool
    """Not inside a function, and not for type checkers alone."""
    for_types: bool

    @property
    def top(self):
        return self.name.partition(".")[0]


class Imports(ast.NodeVisitor):
    """All imports of a module, wherever they stand."""

    def __init__(self, module, *, is_package):
        self.found = []
        self.package = module if is_package else module.rpartition(".")[0]
        self.inside = {"function": 0, "types": 0}

    def add(self, name, node):
        at_import = not any(self.inside.values())
        self.found.append(Import(name, node.lineno, at_import, self.inside["types"] > 0))

    def visit_within(self, kind, nodes):
        self.inside[kind] += 1
        for node in nodes:
            self.visit(node)
        self.inside[kind] -= 1

    def visit_Import(self, node):
        for alias in node.names:
            self.add(alias.name, node)

    def visit_ImportFrom(self, node):
        base = node.module or ""
        if node.level:
            above = self.package.split(".")
            above = ".".join(above[: len(above) - node.level + 1])
            base = f"{above}.{base}" if base else above
        for alias in node.names:
            self.add(f"{base}.{alias.name}", node)

    def visit_Call(self, node):
        called = ast.unparse(node.func).rpartition(".")[2]
        first = node.args[0] if node.args else None
        if called in {"import_module", "__import__"} and isinstance(first, ast.Constant):
            self.add(str(first.value), node)
        self.generic_visit(node)

    def visit_If(self, node):
        if ast.unparse(node.test) not in {"TYPE_CHECKING", "typing.TYPE_CHECKING"}:
            self.generic_visit(node)
            return
        self.visit_within("types", node.body)
        for other in node.orelse:
            self.visit(other)

    def visit_FunctionDef(self, node):
        # Decorators and defaults run when the module is imported.
        for early in (*node.decorator_list, node.args):
            self.visit(early)
        self.visit_within("function", node.body)

    visit_AsyncFunctionDef = visit_FunctionDef  # noqa: N815

    def visit_Lambda(self, node):
        self.visit(node.args)
        self.visit_within("function", [node.body])


def imports_of(source, module, *, is_package=False):
    visitor = Imports(module, is_package=is_package)
    visitor.visit(ast.parse(source))
    return visitor.found


def stage_of(name):
    """The stage that a module or an imported name of ours belongs to; "" for the package itself."""
    parts = name.split(".")
    return parts[1] if len(parts) > 1 and parts[1] in STAGES else ""


def belongs_to(module, home):
    return module == home or module.startswith(f"{home}.")


def fault_of_ours(module, one):
    """What is wrong with importing `one` of our own names in `module`, or nothing."""
    here, there = stage_of(module), stage_of(one.name)
    if module == "sparsor":
        if there == "cli":
            return "imports the command line"
        return "is imported eagerly by the public API" if one.at_import else None
    if module == "sparsor.__main__":
        return None if there == "cli" else "is not the command line"
    if not there:
        known = one.name == "sparsor.__version__"
        return None if known else "comes from the public API, which hides the stage it belongs to"
    if here != there and there == "cli":
        return "imports the command line"
    return None if STAGES.index(there) <= STAGES.index(here) else f"is of '{there}', which is below '{here}'"


def fault_of_theirs(module, one):
    """What is wrong with importing `one` of other people's packages in `module`, or nothing."""
    home = ONLY_IN.get(one.top)
    if home and not belongs_to(module, home):
        return f"belongs to {home} alone"
    if one.top in LATE and one.at_import:
        return "is slow to import: import it in the function that needs it"
    return None


def faults(source, module, *, is_package=False):
    found = []
    if module not in {"sparsor", "sparsor.__main__"} and not stage_of(module):
        return [f"{module} belongs to no stage of design.md"]
    for one in imports_of(source, module, is_package=is_package):
        fault = fault_of_ours(module, one) if one.top == "sparsor" else fault_of_theirs(module, one)
        if fault:
            found.append(f"{module}, line {one.line}: {one.name} {fault}")
    return found


def modules():
    """Name, path and whether it is an `__init__`, of every module of the package."""
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = ["sparsor", *path.relative_to(PACKAGE).with_suffix("").parts]
        is_package = parts[-1] == "__init__"
        yield ".".join(parts[:-1] if is_package else parts), path, is_package


def test_every_module_imports_only_what_its_stage_may():
    found = [
        fault
        for module, path, is_package in modules()
        for fault in faults(path.read_text(encoding="utf-8"), module, is_package=is_package)
    ]
    assert not found, "\n" + "\n".join(found)


def test_the_modules_that_are_read_are_the_package():
    names = {module for module, _, _ in modules()}
    assert {"sparsor", "sparsor.__main__", "sparsor.errors", "sparsor.cli.main", "sparsor.geodesy.lengths"} <= names
    assert len(names) > 60


MADE_UP = {
    "a stage below": ("sparsor.prior.x", "from sparsor.design import lasso", "is of 'design', which is below 'prior'"),
    "a stage below, as a module": ("sparsor.design.x", "import sparsor.journeys.planning as p", "'journeys'"),
    "a stage below, from the package": ("sparsor.core.x", "from sparsor import geodesy", "'geodesy'"),
    "inside a function": ("sparsor.plot.x", "def f():\n    from sparsor.prior import Field", "'prior'"),
    "inside a method": ("sparsor.core.x", "class C:\n  async def f(s):\n    import sparsor.plot", "'plot'"),
    "for types alone": (
        "sparsor.vehicle.x",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from sparsor.mission import MissionPlan",
        "'mission'",
    ),
    "in an except branch": (
        "sparsor.errors",
        "try:\n    import json\nexcept ImportError:\n    from sparsor.core import files",
        "'core'",
    ),
    "relative, one up": ("sparsor.geodesy.x", "from ..vehicle import profile", "'vehicle'"),
    "relative, by name": ("sparsor.geodesy.x", "from .. import vehicle", "'vehicle'"),
    "by import_module": ("sparsor.core.x", "import importlib\nimportlib.import_module('sparsor.study')", "'study'"),
    "the command line": ("sparsor.journeys.x", "from sparsor.cli.console import Json", "imports the command line"),
    "the command line, by the API": ("sparsor", "def f():\n    import sparsor.cli.main", "imports the command line"),
    "the API in a stage": ("sparsor.core.x", "from sparsor import plan_mission", "hides the stage"),
    "the API as a whole": ("sparsor.mission.x", "def f():\n    import sparsor", "hides the stage"),
    "the API, eagerly": ("sparsor", "from sparsor.design import lasso", "is imported eagerly"),
    "a stage nobody knows": ("sparsor.helpers.x", "", "belongs to no stage"),
    "pyproj elsewhere": (
        "sparsor.mission.x",
        "def f():\n    from pyproj import Geod",
        "belongs to sparsor.geodesy.lengths",
    ),
    "pyproj next door": ("sparsor.geodesy.box", "import pyproj.exceptions", "belongs to sparsor.geodesy.lengths"),
    "mavsdk elsewhere": ("sparsor.mission.x", "def f():\n    import mavsdk.mission_raw", "belongs to sparsor.link"),
    "mavsdk at once": ("sparsor.link.x", "import mavsdk", "slow to import"),
    "at once in a branch": ("sparsor.prior.x", "try:\n    import rasterio\nexcept ImportError:\n    pass", "slow"),
    "at once in a class": ("sparsor.plot.x", "class C:\n    from matplotlib import cm", "slow to import"),
    "at once for a default": ("sparsor.core.x", "def f(d=__import__('dask')): ...", "slow to import"),
    "when not for types": (
        "sparsor.prior.x",
        "if TYPE_CHECKING:\n    import sklearn\nelse:\n    import sklearn",
        "line 4: sklearn is slow",
    ),
} | {
    f"{name} at once": ("sparsor.prior.x", f"from {name}.a import b", "slow to import")
    for name in sorted(LATE - {"mavsdk"})
}


@pytest.mark.parametrize("case", MADE_UP)
def test_a_made_up_violation_is_caught(case):
    module, source, words = MADE_UP[case]
    (fault,) = faults(source, module)
    assert words in fault


def test_relative_imports_are_resolved_from_packages_and_modules():
    (fault,) = faults("from ..vehicle import Vehicle", "sparsor.geodesy", is_package=True)
    assert "sparsor.vehicle.Vehicle is of 'vehicle'" in fault
    assert not faults("from .vehicle import Vehicle\nfrom . import plan", "sparsor.mission.x")


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("sparsor.design.x", "from sparsor.core.streams import stream\nfrom sparsor.errors import DesignError"),
        ("sparsor.design.x", "from sparsor.design.route import shortest_path"),
        ("sparsor.geodesy.lengths", "def f():\n    from pyproj import Geod"),
        ("sparsor.link.missions.upload", "def f():\n    import mavsdk"),
        ("sparsor.prior.x", "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import rasterio"),
        ("sparsor.prior.x", "def f():\n    import sklearn\nf = lambda: __import__('xarray')"),
        ("sparsor", "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from sparsor.design import lasso"),
        ("sparsor", "def __getattr__(name):\n    from sparsor.journeys.planning import plan_mission"),
        ("sparsor.__main__", "from sparsor.cli.main import main"),
        ("sparsor.cli.main", "from sparsor import __version__\nfrom sparsor.cli.plan import plan"),
    ],
)
def test_what_is_allowed_is_not_called_a_violation(module, source):
    assert faults(source, module) == []


def test_help_needs_none_of_the_heavy_packages():
    script = (
        "import sys; import sparsor.cli.main\n"
        "try: sparsor.cli.main.app(['plan', '--help'])\n"
        "except SystemExit as end: assert not end.code\n"
        f"print('loaded:', *sorted(set({NOT_FOR_HELP}) & set(sys.modules)))"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False)
    assert ran.returncode == 0, ran.stderr
    assert "bbox" in ran.stdout
    assert ran.stdout.splitlines()[-1] == "loaded:"
