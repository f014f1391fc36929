"""Simulated annealing of a route's stops (Kirkpatrick et al. 1983), compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray  # noqa: TC002

from sparsor.core.compiled import njit
from sparsor.design.refined.costs import Costs, used
from sparsor.design.refined.crossings import crosses
from sparsor.design.refined.dense import gram, solve
from sparsor.design.refined.flyover import Flyover, passes
from sparsor.design.refined.moves import propose
from sparsor.design.refined.posterior import Belief, changed, posterior_root, root_error
from sparsor.design.refined.readings import Readings, Sensor, readings, readings_after

_MOST_CHANGED = 0.65  # readings per component: an update by more costs more than starting afresh
_MOST_UPDATES = 8  # taking readings away again amplifies rounding: then the posterior is made afresh


@njit(cache=True, nogil=True)
def route_error(prior: Belief, over: Flyover, sensor: Sensor, stops: NDArray[np.int64]) -> float:
    """Return the expected error of the route over `stops`: the mean posterior variance over the cells that count."""
    cell, seconds = passes(over, stops)
    return root_error(prior, _afresh(prior, sensor, readings(prior, sensor, cell, seconds)))


@njit(cache=True, nogil=True)
def anneal(
    prior: Belief,
    over: Flyover,
    sensor: Sensor,
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
    sensor : Sensor
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
    cell, seconds = passes(over, stops)
    known = readings(prior, sensor, cell, seconds)
    root = _afresh(prior, sensor, known)
    covariance, error = gram(root), root_error(prior, root)
    best, best_error, updates = stops, error, 0
    for temperature in temperatures:
        trial = propose(stops, prior.allowed, over.columns, over.hold_s > 0, rng)
        if trial.size < 2 or used(costs, trial) > costs.limit:
            continue
        head, tail = _unchanged(stops, trial) if costs.symmetric else (0, 0)
        if crosses(trial, costs.legs, over.columns, head, trial.size - 1 - tail):
            continue
        cell, seconds = passes(over, trial)
        made, rows, difference = readings_after(prior, sensor, cell, seconds, known)
        if not difference.size:  # a change of order alone
            stops, known = trial, made
            continue
        most_rise = error * np.expm1(-temperature * np.log(1.0 - rng.random()))
        if difference.size > _MOST_CHANGED * prior.spread.size:
            root = _afresh(prior, sensor, made)
            fresh = root_error(prior, root)
            if fresh - error > most_rise:
                continue
            stops, known, covariance, error, updates = trial, made, gram(root), fresh, 0
        else:
            rise, left, inner = changed(prior, covariance, rows, difference)
            if rise > most_rise:
                continue
            stops, known, error = trial, made, error + rise
            updates += 1
            if error < best_error or updates == _MOST_UPDATES:
                known = readings(prior, sensor, cell, seconds)
                root = _afresh(prior, sensor, known)
                covariance, error, updates = gram(root), root_error(prior, root), 0
            else:
                covariance -= np.dot(np.ascontiguousarray(left.T), solve(inner, left))
        if error < best_error:
            best, best_error = stops, error
    return stops, best, best_error


@njit(cache=True, nogil=True)
def _afresh(prior: Belief, sensor: Sensor, known: Readings) -> NDArray[np.float64]:
    """Return the root of the posterior covariance of the coefficients after all readings."""
    rows = known.row
    if sensor.tau_s == 0.0:
        rows = np.empty((known.cell.size, prior.spread.size))
        for k in range(known.cell.size):
            rows[k] = prior.factor[known.cell[k]]
    return posterior_root(prior, rows, known.precision)


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
