"""Simulated annealing of a route's stops (Kirkpatrick et al. 1983), compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray  # noqa: TC002

from sparsor.design.refined.costs import Costs, used
from sparsor.design.refined.crossings import crosses
from sparsor.design.refined.dense import solve
from sparsor.design.refined.flyover import Flyover, fly, response
from sparsor.design.refined.moves import propose
from sparsor.design.refined.posterior import Belief, changed, expected_error, posterior

_LEAST_CHANGE = 1e-9
_MOST_UPDATES = 8  # taking readings away again amplifies rounding: then the posterior is made afresh


@njit(cache=True, nogil=True)
def route_error(prior: Belief, over: Flyover, stops: NDArray[np.int64]) -> float:
    """Return the expected error of the route over `stops`: the mean posterior variance over the cells that count."""
    return expected_error(prior, posterior(prior, _shares(over, stops, prior.precision.size)[2]))


@njit(cache=True, nogil=True)
def anneal(
    prior: Belief,
    over: Flyover,
    costs: Costs,
    start: NDArray[np.int64],
    temperatures: NDArray[np.float64],
    rng: np.random.Generator,
) -> tuple[NDArray[np.int64], NDArray[np.int64], float]:
    """Change a route move by move, one for each temperature.

    A move is taken when it lowers the expected error, or with the probability that the temperature gives to its
    relative rise. None leaves the budget or makes the route cross itself.

    Parameters
    ----------
    prior : Belief
    over : Flyover
    costs : Costs
    start : array of int64 (n,)
        Stops of a route within the budget.
    temperatures : array of float64
        Of the relative rise of the expected error.
    rng : numpy.random.Generator

    Returns
    -------
    array of int64, array of int64, float
        The last route, the best one and the best one's expected error.
    """
    stops = start.copy()
    passes, seconds, share = _shares(over, stops, prior.precision.size)
    covariance = posterior(prior, share)
    error = expected_error(prior, covariance)
    best, best_error, updates = stops, error, 0
    for temperature in temperatures:
        trial = propose(stops, prior.precision, over.columns, rng)
        if trial.size < 2 or used(costs, trial) > costs.limit:
            continue
        head, tail = _unchanged(stops, trial)
        if crosses(trial, costs.legs, over.columns, head, trial.size - 1 - tail):
            continue
        before, after = stops[head : stops.size - tail], trial[head : trial.size - tail]
        fly(over, before, -1, passes, seconds)
        fly(over, after, 1, passes, seconds)
        touched, difference = _differences(over, passes, seconds, share)
        rise, left, inner = 0.0, covariance, covariance  # for a change of order alone
        if touched.size:
            rise, left, inner = changed(prior, covariance, touched, difference)
        if rise > error * np.expm1(-temperature * np.log(1.0 - rng.random())):
            fly(over, after, -1, passes, seconds)
            fly(over, before, 1, passes, seconds)
            continue
        stops = trial
        if not touched.size:
            continue
        share[touched] += difference
        error += rise
        updates += 1
        if error < best_error or updates % _MOST_UPDATES == 0:
            covariance = posterior(prior, share)
            error = expected_error(prior, covariance)
        else:
            covariance -= np.dot(np.ascontiguousarray(left.T), solve(inner, left))
        if error < best_error:
            best, best_error = stops, error
    return stops, best, best_error


@njit(cache=True, nogil=True)
def _shares(
    over: Flyover, stops: NDArray[np.int64], cells: int
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return how often a route passes over each cell, for how long, and the share of its information that gives."""
    passes, seconds, share = np.zeros(cells, dtype=np.int64), np.zeros(cells), np.zeros(cells)
    fly(over, stops, 1, passes, seconds)
    touched, difference = _differences(over, passes, seconds, share)
    share[touched] += difference
    return passes, seconds, share


@njit(cache=True, nogil=True)
def _unchanged(stops: NDArray[np.int64], trial: NDArray[np.int64]) -> tuple[int, int]:
    """Return how many legs at the head and at the tail two routes have in common."""
    most = min(stops.size, trial.size)
    head = 0
    while head < most and stops[head] == trial[head]:
        head += 1
    tail = 0
    while tail < most - head and stops[stops.size - 1 - tail] == trial[trial.size - 1 - tail]:
        tail += 1
    return max(head - 1, 0), max(tail - 1, 0)


@njit(cache=True, nogil=True)
def _differences(
    over: Flyover, passes: NDArray[np.int64], seconds: NDArray[np.float64], share: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the cells whose share is no longer the one given, and by how much it differs."""
    cells, difference = np.empty(share.size, dtype=np.int64), np.empty(share.size)
    count = 0
    for cell in range(share.size):
        if passes[cell] == 0:
            seconds[cell] = 0.0  # what rounding left there
        change = response(passes[cell], seconds[cell], over.tau_s) - share[cell]
        if abs(change) > _LEAST_CHANGE:
            cells[count] = cell
            difference[count] = change
            count += 1
    return cells[:count], difference[:count]
