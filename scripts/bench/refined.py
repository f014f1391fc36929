#!/usr/bin/env python3
"""The refined search against every baseline, by the blocked protocol: one row a route, a fold a column.

Every route is decoded twice, with all cells under its legs measured and with its stops alone, by the blend of method's
linear decoders; its settings are chosen on the validation maps, and for the test maps, which are decoded once, the
covariance is learned again from training and validation maps. Algorithm 1 is also decoded from its 35 sums by the
LASSO, as the paper does, within the budgets and at its own p = 0.03, theta = 3. Printed: the mean over the test maps of
each fold, and over the folds: |s - s'| / |s| for smooth fields, with --squared |s - s'|^2; length in cell units;
seconds that the planning took.

    scripts/bench/refined.py gulf_no2_omi_2020-09.tif
    scripts/bench/refined.py wide_no2_omi_2020-09.nc --native --squared
    scripts/bench/refined.py FIELD --quick                      one fold, few moves
    scripts/bench/refined.py FIELD --t90 30                     a slow sensor over a 3 km box at 10 m/s, beside t90 = 0
    scripts/bench/refined.py FIELD --sgptools-python /path/to/python    SGP-Tools and PySensors run there
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sparsor.core.metrics import relative_error, squared_error
from sparsor.core.streams import stream
from sparsor.core.workers import one_blas_thread
from sparsor.design import Budget, Problem, Weights, fixed_sparsity, search, unit_legs
from sparsor.design.refined import DEFAULT_ITERATIONS, refine
from sparsor.design.tuning import choose_lasso_weight
from sparsor.prior.reading import read_field
from sparsor.study import study_maps
from sparsor.study.baselines import best_within, lawnmower, qr_pivot_tour, random_tour, tuned_ipp
from sparsor.study.cases import blocked_case
from sparsor.study.decoding import decode_lasso, decode_linear
from sparsor.study.observing import flown_at, of_cells, readings, task_of
from sparsor.study.peers import best_kind, find_peers, peer_routes
from sparsor.study.protocol import BLOCKED_FOLDS, PAPER_PIXELS

SHAPE = (32, 32)
BUDGETS, NOISES = (102, 200, 274), (0.0, 0.01)
ATOMS, ROWS, PROBABILITY, THETA = 256, 35, 0.03, 3
# The example of the packaged quadrotor: 3 km box, 10 m/s.
LEGS = flown_at(unit_legs(SHAPE), 3000.0 / SHAPE[0] / 10.0)
# Of method's measured references, for where SGP-Tools is not installed: Gulf relative, wide squared errors.
QUOTED = {
    (0.0, False): {102: 0.072, 200: 0.017, 274: 0.008},
    (0.01, False): {102: 0.113, 200: 0.071, 274: 0.058},
    (0.0, True): {102: 1.463, 200: 0.754, 274: 0.497},
    (0.01, True): {102: 1.50, 200: 0.80, 274: 0.55},
}


class Planned(NamedTuple):
    """A route, what it took to plan it, and Algorithm 1's measurement matrix."""

    stops: np.ndarray
    seconds: float
    phi: np.ndarray | None = None


class Fold:
    """One fold, and the routes over it that do not depend on the sensor's noise."""

    def __init__(self, case, options) -> None:
        self.case, self.options = case, options

    @cache  # noqa: B019 # a few folds live as long as the program
    def psi(self):
        """Return the learned dictionary."""
        return self.case.dictionary(ATOMS, self.options.seed)

    @cache  # noqa: B019
    def problem(self):
        """Return what Algorithm 1 is given, without a budget."""
        maps = self.case.sets.validation - self.case.mean
        weight = choose_lasso_weight(self.psi(), maps, LEGS, rows=ROWS, seed=self.options.seed)
        return Problem(self.psi(), maps, weight, LEGS, ROWS)

    @cache  # noqa: B019
    def route(self, name, limit, sd, t90_s) -> Planned:
        """Return a route, timed; `sd` and `t90_s` are 0 for planners that do not look at them."""
        if name in ALGORITHM:
            self.problem()  # learned before, as for a real flight
        begun = time.perf_counter()
        with one_blas_thread():
            found = PLANNERS[name](self, Budget(float(limit), "distance"), sd, t90_s)
        seconds = time.perf_counter() - begun
        return Planned(found, seconds) if isinstance(found, np.ndarray) else Planned(found.stops, seconds, found.phi)


def algorithm_1(fold, budget, _sd, _t90_s):
    problem = replace(fold.problem(), budget=budget)
    return best_within(problem, seed=fold.options.seed, iterations=fold.options.samples, workers=fold.options.workers)


def papers_own(fold, _budget, _sd, _t90_s):
    problem = replace(fold.problem(), improve=False)
    sparsity = fixed_sparsity(PROBABILITY, THETA)
    options = {"seed": fold.options.seed, "iterations": fold.options.samples, "workers": fold.options.workers}
    return search(problem, sparsity, Weights(), **options)


def refined(fold, budget, sd, t90_s):
    task = task_of(fold.case, LEGS, budget.limit, sd=sd, t90_s=t90_s)
    options = fold.options
    return refine(task, seed=options.seed, iterations=options.iterations, workers=options.workers).stops


PAPERS = f"Algorithm 1, p = {PROBABILITY}, theta = {THETA}"
ALGORITHM = ("Algorithm 1", PAPERS)
PLANNERS = {
    "lawnmower": lambda _fold, budget, *_: lawnmower(LEGS, budget),
    "random cells": lambda fold, budget, *_: random_tour(LEGS, budget, stream(fold.options.seed, 11)),
    "QR pivots": lambda fold, budget, *_: qr_pivot_tour(fold.case.sets.training, LEGS, budget),
    "greedy IPP": lambda fold, budget, *_: tuned_ipp(fold.case.sets.validation, LEGS, budget)[0],
    "Algorithm 1": algorithm_1,
    "refined": refined,
    PAPERS: papers_own,
}


def main() -> None:
    options = arguments()
    metric = squared_error if options.squared else relative_error
    field, pixels = read_field(options.field), None if options.native else PAPER_PIXELS
    maps = study_maps(field, pixels)
    numbers = range(1 if options.quick else len(BLOCKED_FOLDS))
    folds = [Fold(blocked_case(maps, field, number, pixels), options) for number in numbers]
    print(
        f"{options.field.name}: {len(maps.maps)} maps, {maps.dropped} dropped, {maps.filled} filled; {metric.__name__}"
    )
    print("| noise | t90, s | budget | route | measured | decoder |", end="")
    print(" | ".join(f" fold {k}" for k in range(len(folds))) + " | mean | length | s |")
    print("|---" * (len(folds) + 9) + "|")
    peers = []
    if options.sgptools_python:
        known, budgets = (
            find_peers(options.sgptools_python, options.peer_steps),
            [Budget(one, "distance") for one in BUDGETS],
        )
        peers = [peer_routes(known, fold.case.sets.training, LEGS, budgets) for fold in folds]
    for sd in NOISES:
        for t90_s in sorted({0.0, options.t90}):
            for limit in BUDGETS:
                for name in options.routes:
                    if name != PAPERS:
                        report(name, folds, limit, sd, t90_s, metric)
                for name in sorted({key[0] for key in peers[0] if key[1] == limit} if peers else ()):
                    report_peer(name, folds, peers, limit, sd, t90_s, metric)
                if not peers and t90_s == 0:
                    print(quoted(limit, sd, options.squared))
            if PAPERS in options.routes:
                report(PAPERS, folds, None, sd, t90_s, metric)


def report(name, folds, limit, sd, t90_s, metric) -> None:
    answers = name == "refined"
    routes = [fold.route(name, limit or 0.0, sd if answers else 0.0, t90_s if answers else 0.0) for fold in folds]
    row = (sd, t90_s, limit or "none", name)
    for measured in ("legs", "stops"):
        errors = [
            blend_error(fold, one.stops, measured, sd, t90_s, metric) for fold, one in zip(folds, routes, strict=True)
        ]
        print_row(*row, measured, "blend", errors, routes)
    if name in ALGORITHM and t90_s == 0:
        errors = [sums_error(fold, one, sd, metric) for fold, one in zip(folds, routes, strict=True)]
        print_row(*row, f"{ROWS} sums", "lasso", errors, routes)


def blend_errors(folds, routes, *asked):
    return [blend_error(fold, one.stops, *asked) for fold, one in zip(folds, routes, strict=True)]


def blend_error(fold, stops, measured, sd, t90_s, metric):
    with one_blas_thread():
        decoded = decode_linear(fold.case, readings(LEGS, stops, measured, sd=sd, t90_s=t90_s), "blend", metric)
    return float(metric(fold.case.sets.test, decoded).mean())


def sums_error(fold, planned, sd, metric):
    cells = np.unique(planned.stops)
    made = of_cells(cells, LEGS.size, sd)
    decoded = decode_lasso(fold.case, made, fold.psi(), sums=planned.phi[:, cells], metric=metric)
    return float(metric(fold.case.sets.test, decoded).mean())


def print_row(sd, t90_s, limit, name, measured, decoder, errors, routes) -> None:
    length = np.mean([LEGS.path_length(one.stops) for one in routes])
    print(
        f"| {sd:g} | {t90_s:g} | {limit} | {name} | {measured} | {decoder} | "
        f"{' | '.join(f'{one:.4f}' for one in errors)} | {np.mean(errors):.4f} | {length:.0f} | "
        f"{np.mean([one.seconds for one in routes]):.1f} |",
        flush=True,
    )


def quoted(limit, sd, squared) -> str:
    name = "SGP-Tools' best route (quoted from method.md: not run here)"
    return f"| {sd:g} | 0 | {limit} | {name} | legs | blend | {QUOTED[sd, squared][limit]:g} (mean of 3 folds) |"


def report_peer(name, folds, peers, limit, sd, t90_s, metric) -> None:
    """Print the kind, of kernel and number of stops, that the validation maps choose for each fold."""
    if not all((name, limit) in of for of in peers):
        print(f"| {sd:g} | {t90_s:g} | {limit} | {name} | no route of its own within the budget in some fold |")
        return
    for measured in ("legs", "stops"):
        routes = [
            best_kind(of[name, limit], fold.case, LEGS, measured, sd=sd, t90_s=t90_s, by=metric)
            for fold, of in zip(folds, peers, strict=True)
        ]
        errors = [
            blend_error(fold, one.stops, measured, sd, t90_s, metric) for fold, one in zip(folds, routes, strict=True)
        ]
        print_row(sd, t90_s, limit, name, measured, "blend", errors, routes)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("field", type=Path)
    parser.add_argument("--native", action="store_true", help="keep the native pixels (else 1390 x 994)")
    parser.add_argument("--squared", action="store_true", help="print squared errors")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--t90", type=float, default=0.0, help="also a sensor of this response, s")
    parser.add_argument("--routes", nargs="+", default=list(PLANNERS), choices=list(PLANNERS))
    parser.add_argument("--iterations", type=int, default=DEFAULT_ITERATIONS, help="moves of the refined search")
    parser.add_argument("--samples", type=int, default=500, help="of Algorithm 1")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--sgptools-python", metavar="PATH", help="a Python that has sgptools or python-sensors")
    parser.add_argument("--peer-steps", type=int, default=100, help="of SGP-Tools' optimiser")
    options = parser.parse_args()
    if options.quick:
        options.iterations, options.samples = min(options.iterations, 20_000), min(options.samples, 60)
    return options


if __name__ == "__main__":
    main()
