#!/usr/bin/env python3
"""The error that `generate-mission` states against the one that test maps show.

For each split of a field: a model of its training and validation windows, the refined search for a sensor at 10 m/s
over cells of 94 m (9.4 s each), with dwells of 5 s, and the mean error |s - s'| / |s - mean(s)| three times: as the
search believes it (the root of the mean posterior variance), as it is stated (the best linear decoder on the
validation maps), and as that decoder does on the test maps. The noise is the packaged sensor's, relative to the maps
as the planner takes it. Printed as Markdown with the ratio of the last two; `random` flatters, since its test windows
have near-twins in training.

    scripts/bench/stated_error.py --field FIELD.tif            splits `random` and `blocked`, at the paper's pixels
    scripts/bench/stated_error.py --field FIELD.nc --native    at its own pixels
    scripts/bench/stated_error.py                              fresh maps of the built-in field, 2.45 km
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from decoders import cases_of

from sparsor.core.metrics import centred_relative_error
from sparsor.core.streams import stream
from sparsor.core.workers import one_blas_thread
from sparsor.design import Budget, LegTable, Problem, unit_legs
from sparsor.design.decoders import Measurements
from sparsor.design.decoders.decode import candidates
from sparsor.design.decoders.setting import Setting
from sparsor.design.refined import DEFAULT_ITERATIONS, refine
from sparsor.journeys.refining import LINEAR, linear_expectation, refined_task
from sparsor.prior.builtin import SHAPE
from sparsor.prior.statistics import unit_shapes
from sparsor.vehicle import load_sensor

BUDGETS = (0.10, 0.20)
T90_S = (30.0, 0.0)
CELL_S, HOLD_S, BRAKING_S = 9.4, 5.0, 4.0
COLUMNS = ("split", "budget", "t90, s", "believed", "stated", "test maps", "test / stated")
EVERYWHERE = np.ones(SHAPE[0] * SHAPE[1], dtype=bool)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--field", type=Path, help="instead of the built-in field")
    parser.add_argument("--native", action="store_true", help="windows of the field's own pixels, not the paper's")
    parser.add_argument("--maps", type=int, default=400, help="most test maps a split")
    parser.add_argument("--iterations", type=int, default=DEFAULT_ITERATIONS)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--split", choices=("random", "blocked"), help="of a field, only this one")
    options = parser.parse_args()
    options.atoms, options.random_seeds, options.side_m = 64, 3, 2450.0  # the dictionary does not matter here
    print(f"| {' | '.join(COLUMNS)} |")
    print("|---" * len(COLUMNS) + "|")
    with ProcessPoolExecutor(options.workers) as pool:
        for protocol, cases in cases_of(options).items():
            if options.split and not protocol.endswith(options.split):
                continue
            for budget in BUDGETS:
                for t90_s in T90_S:
                    jobs = [(case, budget, t90_s, options.iterations) for case in cases]
                    found = np.array(list(pool.map(errors, *zip(*jobs, strict=True))))
                    believed, stated, realised = found.mean(axis=0)
                    print(
                        f"| {protocol} | {budget:.0%} | {t90_s:g} | {believed:.3f} | {stated:.3f} | {realised:.3f} | "
                        f"{(found[:, 2] / found[:, 1]).mean():.2f} |",
                        flush=True,
                    )


def errors(case, budget, t90_s, iterations):
    """Return the error of one route: believed, stated, and on the test maps."""
    model = case.model
    unit = unit_legs(SHAPE)
    legs = LegTable(SHAPE, unit.length, CELL_S * unit.length, 1.0, unit.allowed)
    limit = Budget(budget * (legs.size - 1), "distance")
    problem = Problem(model.dictionary, model.validation - model.mean, model.lasso_weight, legs, budget=limit)
    sensor = load_sensor().model_copy(update={"t90_s": t90_s})
    task = refined_task(model, problem, sensor, hold_s=HOLD_S, braking_s=BRAKING_S)
    route = refine(task, seed=0, iterations=iterations)
    rows, variance = task.readings(route.stops)
    with one_blas_thread():
        stated = linear_expectation(model, legs.allowed, rows, variance, 0)
        truth = unit_shapes(case.test)
        values = truth @ rows.T + np.sqrt(variance) * stream(0, 31).standard_normal((len(truth), len(rows)))
        setting = Setting(model, Measurements(rows, values[0], variance), EVERYWHERE, np.zeros(len(rows)), 0)
        best = min(candidates(setting, LINEAR, amplitude=1.0).values(), key=lambda one: one.error)
        decoded = best.decoder.decode(values).mean
    return np.sqrt(route.expected_error), stated, centred_relative_error(truth, decoded).mean()


if __name__ == "__main__":
    main()
