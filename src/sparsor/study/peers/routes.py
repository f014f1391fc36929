"""Routes of other people's planners: which a Python has, what they answer, what of that fits a budget."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sparsor.core.workers import one_blas_thread
from sparsor.design import shortest_path
from sparsor.design.refined.costs import costs
from sparsor.design.refined.starts import tour_within
from sparsor.errors import InputError
from sparsor.study.decoding import validation_error
from sparsor.study.observing import readings

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from sparsor.design import Budget, LegTable
    from sparsor.study.cases import Case
    from sparsor.study.decoding import Metric
    from sparsor.study.observing import Measured

PLANNERS = {"sgptools": ("SGP-Tools",), "python-sensors": ("PySensors QR", "PySensors CCQR")}
_ASK = (
    "import json; from importlib import metadata as m; "
    "known = {d.metadata['Name'].lower().replace('_', '-'): d.version for d in m.distributions()}; "
    f"print(json.dumps({{one: known[one] for one in {sorted(PLANNERS)} if one in known}}))"
)


@dataclass(frozen=True)
class Peers:
    """A Python that has some of the planners.

    Parameters
    ----------
    python : str
    versions : dict of str to str
        Distribution to version; part of what decides a result.
    steps : int
        Of SGP-Tools' optimiser.
    """

    python: str
    versions: dict[str, str]
    steps: int = 100

    @property
    def planners(self) -> tuple[str, ...]:
        """The names of its planners."""
        return tuple(name for one in sorted(self.versions) for name in PLANNERS[one])


class PeerRoute(NamedTuple):
    """A route within a budget, and what it took to plan it."""

    stops: NDArray[np.int64]
    seconds: float


def own_python() -> str | None:
    """Return this Python, where it has one of the planners."""
    return sys.executable if find_spec("sgptools") or find_spec("pysensors") else None


def find_peers(python: str, steps: int = 100) -> Peers:
    """Return what a Python has.

    Raises
    ------
    InputError
        When it cannot be started or has none of the planners.
    """
    try:
        answer = subprocess.run([python, "-c", _ASK], check=True, capture_output=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        raise InputError(f"'{python}' cannot be started as a Python ({error}); give the path of one") from error
    versions = json.loads(answer)
    if not versions:
        raise InputError(f"'{python}' has neither sgptools nor python-sensors; install one of them there with pip")
    return Peers(python, versions, steps)


def peer_routes(
    peers: Peers, maps: NDArray[np.float64], legs: LegTable, budgets: Sequence[Budget]
) -> dict[tuple[str, float], list[PeerRoute]]:
    """Return the routes of other planners: by planner and budget, of all kinds that fit it.

    Parameters
    ----------
    peers : Peers
    maps : array of float64 (n, N)
        For training.
    legs : LegTable
    budgets : sequence of Budget
        Of distance.

    Raises
    ------
    InputError
        When the planners fail.
    """
    limits = {f"{budget.limit:g}": budget for budget in budgets}
    answers = _answers(peers, maps, legs.shape, [budget.limit for budget in budgets])
    routes: dict[tuple[str, float], list[PeerRoute]] = {}
    for key in (one for one in answers if not one.endswith("|seconds")):
        name, limit, kind = key.split("|")
        stops = _within(answers[key], kind, limits[limit], legs)
        if stops is not None:
            seconds = float(answers[f"{key}|seconds"])
            routes.setdefault((name, limits[limit].limit), []).append(PeerRoute(stops, seconds))
    return routes


def best_kind(
    routes: Sequence[PeerRoute], case: Case, legs: LegTable, measured: Measured, *, sd: float, t90_s: float, by: Metric
) -> PeerRoute:
    """Return the kind, of kernel and number of stops, that the validation maps choose."""

    def error(one: PeerRoute) -> float:
        made = readings(legs, one.stops, measured, sd=sd, t90_s=t90_s)
        return validation_error(case, made, "blend", by)

    with one_blas_thread():
        return min(routes, key=error)


def _answers(
    peers: Peers, maps: NDArray[np.float64], shape: tuple[int, int], limits: list[float]
) -> Mapping[str, NDArray[Any]]:
    with (
        tempfile.TemporaryDirectory() as folder,
        resources.as_file(resources.files("sparsor.study.peers") / "program.py") as program,
    ):
        given, found = Path(folder) / "given.npz", Path(folder) / "found.npz"
        np.savez(given, maps=maps, shape=shape, limits=np.array(limits, dtype=float), steps=peers.steps)
        command = [peers.python, str(program), str(given), str(found)]
        try:
            ended = subprocess.run(command, check=False, capture_output=True, text=True)
        except OSError as error:
            raise InputError(f"'{peers.python}' cannot be started: {error}") from error
        if ended.returncode != 0:
            said = ended.stderr.strip().splitlines()
            raise InputError(f"the planners of '{peers.python}' failed: {said[-1] if said else 'no word'}")
        with np.load(found) as answers:
            return dict(answers)


def _within(cells: NDArray[np.int64], kind: str, budget: Budget, legs: LegTable) -> NDArray[np.int64] | None:
    """Return a peer's cells as a route, or nothing when it is too long: our 2-opt orders them where that is shorter."""
    if kind.startswith("ranking"):
        return tour_within(cells, costs(budget, legs))
    tour = min([cells, shortest_path(cells, legs.length)], key=legs.path_length)
    return tour if tour.size > 1 and budget.used(tour, legs) <= budget.limit else None
