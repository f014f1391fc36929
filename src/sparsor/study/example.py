"""An example: a test map, routes over it, and what is reconstructed (the paper's `compar` and `pathrobot`)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.core.metrics import relative_error
from sparsor.core.workers import one_blas_thread
from sparsor.design import Weights, fixed_sparsity, search
from sparsor.design.refined import refine
from sparsor.study.decoding import decode_lasso, decode_linear
from sparsor.study.observing import of_cells, readings, task_of
from sparsor.study.scoreboard import Given, Source, split_given

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.study.settings import StudySettings
    from sparsor.study.store import Store

PROBABILITY, THETA, SHARE = 0.03, 3, 0.10
_RANK = 0.75  # of the shown map among the test maps by contrast


def example(source: Source, settings: StudySettings, store: Store) -> dict[str, Any]:
    """Return a test map of the first blocked fold, and what two flights make of it.

    Returns
    -------
    dict
        `truth`, a list of N values on the 0..1 scale, and `flights`: for each its `title`, `stops` in order, `map`,
        `error` (relative) and `length`.
    """
    key: dict[str, object] = {"kind": "example", "field": source.digest, "pixels": source.pixels}
    key |= settings.of("seed", "moves", "samples", "atoms", "rows")
    if (kept := store.get(key)) is not None:
        return dict(kept)
    given = split_given(source, "blocked", 0, settings, store)
    test = given.case.sets.test
    shown = int(np.argsort(test.std(axis=1), kind="stable")[int(_RANK * (len(test) - 1))])
    case = replace(given.case, sets=replace(given.case.sets, test=test[[shown]]))
    with one_blas_thread():
        flights = [_papers(given._replace(case=case)), _refined(given._replace(case=case))]
    return dict(store.put(key, {"truth": test[shown].tolist(), "flights": flights}))


def _papers(given: Given) -> dict[str, object]:
    settings, legs = given.settings, given.problem.legs
    sparsity = fixed_sparsity(PROBABILITY, THETA)
    best = search(given.problem, sparsity, Weights(), seed=settings.seed, iterations=settings.samples)
    cells = np.unique(best.stops)
    made = of_cells(cells, legs.size, 0.0)
    decoded = decode_lasso(given.case, made, given.problem.psi, sums=best.phi[:, cells])
    return _flight(f"Algorithm 1, {settings.rows} sums, LASSO", given, best.stops, decoded)


def _refined(given: Given) -> dict[str, object]:
    settings, legs = given.settings, given.problem.legs
    task = task_of(given.case, legs, SHARE * (legs.size - 1), sd=0.0)
    stops = refine(task, seed=settings.seed, iterations=settings.moves).stops
    decoded = decode_linear(given.case, readings(legs, stops, "legs", sd=0.0), "blend")
    return _flight("refined, cells under the legs, blend", given, stops, decoded)


def _flight(title: str, given: Given, stops: NDArray[np.int64], decoded: NDArray[np.float64]) -> dict[str, object]:
    error = relative_error(given.case.sets.test, decoded)[0]
    length = given.problem.legs.path_length(stops)
    return {
        "title": title,
        "stops": stops.tolist(),
        "map": decoded[0].tolist(),
        "error": float(error),
        "length": length,
    }
