#!/usr/bin/env python3
"""Algorithm 1, candidates a second: ours on several threads against plain scikit-learn in one process.

K = 256, M = 35, 56 validation maps; p = 0.03 and theta = 3, or p and theta drawn for a budget. A candidate counts
when it is finished or proven worse. The plain version does the whole of every candidate: ``sparse_encode`` with
``lasso_lars`` for all maps at once, one BLAS thread. It borrows our compiled path, so that not the loops of a Python
2-opt are measured, but the LASSO. Both search the same first samples and have to agree: same sample, Phi and path, cost
to 1e-9. Of the plain version's chunks of candidates the fastest counts, of ours the fastest whole search.

    scripts/bench/algorithm1_speed.py                                   the built-in field's 531 km model
    scripts/bench/algorithm1_speed.py --field gulf_no2_omi_2020-09.tif  fold 0, the last 56 validation maps

Wall-clock time counts on a machine that does nothing else; "by processor time" is the ratio of both versions'
processor seconds a candidate, times the threads: what the ratio would be if nobody else used the cores.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from sklearn.decomposition import sparse_encode
from threadpoolctl import threadpool_limits

from sparsor.core.streams import stream
from sparsor.design import Budget, Problem, Weights, fixed_sparsity, search, searched_sparsity, shortest_path, unit_legs
from sparsor.design.sensing import draw_phi
from sparsor.design.tuning import choose_lasso_weight, comparable_weights, pilot
from sparsor.prior.builtin import builtin_model
from sparsor.prior.dictionary import learned_dictionary
from sparsor.prior.reading import read_field
from sparsor.study import blocked_split, scaled, study_maps

SIDE_M = 531_000.0
ATOMS, ROWS, PROBABILITY, THETA, MAPS, BUDGET_CELLS = 256, 35, 0.03, 3, 56, 102.0
SEED, CHUNK = 0, 10
# scikit-learn's path stops within 1.2e-7 M of lambda, on the scale it is given: 2e-5 of the cost at lambda = 1e-3.
# Scaled up, targets and lambda, it is exact.
SCALE = 2.0**20


@dataclass(frozen=True)
class Case:
    """One setting of the search."""

    name: str
    problem: Problem
    sparsity: object
    weights: Weights


def main() -> None:
    options = _options()
    psi, maps, weight = field_problem(options.field) if options.field else builtin_problem()
    print(f"{len(maps)} validation maps, {psi.shape[1]} atoms, lambda {weight:g}, {options.workers} threads\n")
    for case in cases(Problem(psi, maps, weight, unit_legs(), ROWS)):
        compare(case, options)


def builtin_problem():
    model = builtin_model(SIDE_M)
    return model.dictionary, model.validation - model.mean, model.lasso_weight


def field_problem(path: Path):
    maps = study_maps(read_field(path))
    sets = scaled(maps, blocked_split(maps, 0))
    mean = sets.training.mean(axis=0)
    psi = learned_dictionary(sets.training - mean, ATOMS, seed=SEED)
    validation = sets.validation - mean
    return psi, validation[-MAPS:], choose_lasso_weight(psi, validation, unit_legs(), rows=ROWS, seed=SEED)


def cases(problem: Problem):
    fixed = fixed_sparsity(PROBABILITY, THETA)
    budget = Budget(BUDGET_CELLS, "distance")
    searched = searched_sparsity(budget.stops_within(problem.legs), problem.legs.size, problem.rows)
    three = comparable_weights(pilot(problem, fixed, seed=SEED), valid=1.0, path=None, incoherence=None)
    yield Case("error alone", problem, fixed, Weights())
    yield Case("error, path and incoherence, alike in size", problem, fixed, three)
    yield Case(f"budget of {BUDGET_CELLS:g} cells, error alone", replace(problem, budget=budget), searched, Weights())


def compare(case: Case, options: argparse.Namespace) -> None:
    print(case.name)
    searched(case, 2 * options.workers, options.workers)  # compiled now
    plain_wall, plain_cpu, best = plain(case, options.plain)
    ours = searched(case, options.plain, options.workers)[2]
    unskipped = searched(case, options.plain, options.workers, skip=False)[2]
    for one in (ours, unskipped):
        assert (one.sample, one.phi.tolist(), one.stops.tolist()) == (best[1], best[2].tolist(), best[3].tolist())
        assert abs(one.cost - best[0]) <= 1e-9 * best[0]
    print(
        f"  plain, {options.plain} samples: {1 / plain_wall:9.1f} a second, {plain_cpu * 1e3:7.2f} ms of processor time"
        f" each; same sample ({best[1]}), Phi and path as ours, cost apart {abs(ours.cost / best[0] - 1):.0e}"
    )
    for count, skip in [(options.counts[0], False), *((count, True) for count in options.counts)]:
        runs = [searched(case, count, options.workers, skip=skip) for _ in range(options.repeats)]
        wall, cpu = (min(run[k] for run in runs) for k in (0, 1))
        print(
            f"  ours, {count:5d} samples, {'skipping' if skip else 'all done'}: {1 / wall:9.1f} a second, "
            f"{cpu * 1e3:6.3f} ms each; {plain_wall / wall:6.1f} times, by processor time "
            f"{plain_cpu / cpu * options.workers:6.1f}"
        )
    print()


def searched(case: Case, count: int, workers: int, *, skip: bool = True):
    """Return wall and processor seconds a candidate, and what won."""
    wall, cpu = time.perf_counter(), time.process_time()
    found = search(case.problem, case.sparsity, case.weights, seed=SEED, iterations=count, workers=workers, skip=skip)
    return (time.perf_counter() - wall) / count, (time.process_time() - cpu) / count, found


def plain(case: Case, count: int):
    """Return wall and processor seconds a candidate of the fastest chunk, and cost, sample, Phi and path that won."""
    seconds, best = [], (np.inf,)
    with threadpool_limits(1):
        for first in range(0, count, CHUNK):
            wall, cpu = time.perf_counter(), time.process_time()
            for sample in range(first, first + CHUNK):
                found = plain_candidate(case, sample)
                if found is not None and found[0] < best[0]:
                    best = found
            seconds.append(((time.perf_counter() - wall) / CHUNK, (time.process_time() - cpu) / CHUNK))
    if case.problem.budget is not None:  # chunks differ in how many candidates meet the budget
        return *np.mean(seconds, axis=0), best
    return *np.min(seconds, axis=0), best


def plain_candidate(case: Case, sample: int):
    """Algorithm 1, lines 3 to 28, of one sample, in NumPy and scikit-learn."""
    problem, weights = case.problem, case.weights
    rng = stream(SEED, sample)
    phi = draw_phi(rng, problem.rows, problem.legs.size, *case.sparsity(rng))
    cells = np.flatnonzero(phi.any(axis=0))
    if cells.size < 2:
        return None
    path = shortest_path(cells, problem.legs.length)
    length = problem.legs.path_length(path)
    if problem.budget is not None and length > problem.budget.limit:
        return None
    ones = phi.astype(np.float64)
    norms = np.linalg.norm(ones[ones.any(axis=1)], axis=1, keepdims=True)
    mu = np.abs(ones[ones.any(axis=1)] / norms @ problem.psi).max()
    atoms, sums = ones @ problem.psi, problem.maps @ ones.T
    codes = sparse_encode(SCALE * sums, atoms.T, algorithm="lasso_lars", alpha=SCALE * problem.lasso_weight) / SCALE
    error = np.square(problem.maps - codes @ problem.psi.T).sum(axis=1).mean()
    return weights.valid * error + weights.path * length + weights.incoherence * mu, sample, phi, path


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--field", type=Path, help="GeoTIFF or NetCDF; without it the built-in field")
    parser.add_argument("--counts", type=int, nargs="+", default=[200, 500, 2000], help="samples of our searches")
    parser.add_argument("--plain", type=int, default=40, help="samples of the plain search, whole tens")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=2)
    return parser.parse_args()


if __name__ == "__main__":
    main()
