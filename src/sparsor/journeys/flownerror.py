"""The error to expect of what sorties fly: their own legs, in their own order, each from its first stop to its last."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sparsor.design import Candidate
from sparsor.design.expectation import expected_errors
from sparsor.journeys.refining import linear_expectation, refined_task

if TYPE_CHECKING:
    from sparsor.design import LegTable, Problem
    from sparsor.journeys.preparing import Prepared
    from sparsor.journeys.refining import Known
    from sparsor.mission.specification import MissionSpecification

Expected = Callable[[Candidate, Sequence[NDArray[np.int64]]], tuple[float, float]]
"""From what is flown and the cells of each flight to the errors from the sums, and from single cells."""


def flown_candidate(
    found: Candidate,
    orders: Sequence[NDArray[np.int64]],
    tours: Sequence[NDArray[np.int64]],
    legs: LegTable,
    *,
    refined: bool,
) -> Candidate:
    """Return a route as sorties fly it: their stops one flight after the other, and what they measure.

    Parameters
    ----------
    found : Candidate
    orders, tours : sequences of arrays of int64
        Places on the route, and cells, of each flight's stops.
    legs : LegTable
    refined : bool
        Whether every cell under the legs is measured; else the cells of the stops alone, in the sums of Phi.
    """
    order = np.concatenate(orders)
    stops = found.stops[order]
    if refined:
        under = np.unique(np.concatenate([legs.cells_under(tour) for tour in tours]))
        phi = np.eye(legs.size, dtype=np.bool_)[under]
    else:
        phi = found.phi
        if stops.size < found.stops.size:
            phi = phi & np.isin(np.arange(legs.size), stops)
            phi = phi[phi.any(axis=1)]
    return replace(found, stops=stops, phi=phi, dwells=None if found.dwells is None else found.dwells[order])


def flown_refined(
    prepared: Prepared, problem: Problem, spec: MissionSpecification, known: Known | None = None
) -> Expected:
    """Return what the refined search expects of flights, each a path of the sensor of its own, after earlier ones."""

    def expected(_flown: Candidate, tours: Sequence[NDArray[np.int64]]) -> tuple[float, float]:
        assert prepared.sensor is not None
        hold_s, braking_s = prepared.hold(spec)
        model = prepared.prior.model
        task = refined_task(model, problem, prepared.sensor, hold_s=hold_s, braking_s=braking_s, known=known)
        # One stop that is flown through is over in no time: a reading that says nothing, and upsets the decoders.
        longer = [tour for tour in tours if tour.size > 1] or tours
        rows, variances = zip(*(task.readings(tour) for tour in longer), strict=True)
        together = np.concatenate(rows), np.concatenate(variances)
        error = linear_expectation(model, problem.counted, *together, spec.search.seed, known)
        return error, error

    return expected


def flown_by_algorithm_1(problem: Problem, mean: NDArray[np.float64]) -> Expected:
    """Return what Algorithm 1 expects, of the sums over the stops that are flown to."""

    def expected(flown: Candidate, _tours: Sequence[NDArray[np.int64]]) -> tuple[float, float]:
        return expected_errors(problem, flown, mean)

    return expected
