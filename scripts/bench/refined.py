#!/usr/bin/env python3
"""The refined search against a lawnmower and a tour of QR pivots, by the blocked protocol.

Every cell under a route is measured, with sensor noise of the sd given; every route is decoded by the blend of
method's linear decoders (training covariance with its symmetries, and an exponential kernel; level unknown) whose
share, decay, nugget and covariance are chosen on the validation maps. The routes are searched with the training maps'
covariance alone; for the test maps the covariance is learned again from training and validation maps. Printed: the mean
over the test maps of each fold, and over the folds; |s - s'| / |s| for smooth fields, --squared |s - s'|^2.

    scripts/bench/refined.py gulf_no2_omi_2020-09.tif
    scripts/bench/refined.py wide_no2_omi_2020-09.nc --native --squared
    scripts/bench/refined.py FIELD --quick                      one fold, few moves
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from sparsor.core.metrics import relative_error, squared_error
from sparsor.core.streams import stream
from sparsor.core.workers import one_blas_thread
from sparsor.design import Budget, unit_legs
from sparsor.design.decoders.covariance import contrasts, kernel_covariance, with_symmetries
from sparsor.design.refined import DEFAULT_ITERATIONS, Sensor, Task, refine
from sparsor.design.refined.costs import costs
from sparsor.design.refined.posterior import belief
from sparsor.design.refined.starts import pivots, tour_within
from sparsor.prior.reading import read_field
from sparsor.prior.statistics import Kernel, shape_covariance
from sparsor.study import blocked_split, scaled, study_maps
from sparsor.study.protocol import BLOCKED_FOLDS, PAPER_PIXELS, dense_maps

SHAPE = (32, 32)
LEGS = unit_legs(SHAPE)
ALL = np.ones(LEGS.size, dtype=bool)
BUDGETS, NOISES = (102, 200, 274), (0.0, 0.01)
SHARES = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.99, 1.0)
DECAYS = (1.5, 3.0, 6.0, 12.0, 24.0, 96.0)
NUGGETS = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 3e-2)
LEAST_NOISE = 3e-5  # of the maps' variance: what keeps a search without noise from trusting details of the covariance


@dataclass(frozen=True)
class Fold:
    """Maps of a fold, and covariances of the training maps and of training and validation maps together."""

    sets: object
    training: dict
    both: dict

    @classmethod
    def of(cls, maps, field, pixels, number):
        """Return one of the blocked folds."""
        sets = scaled(maps, blocked_split(maps, number))
        both = np.concatenate([sets.training, sets.validation])
        training, final = (dense_maps(field, number, pixels, validation=more) for more in (False, True))
        return cls(sets, covariances(sets.training, training), covariances(both, final))


def covariances(maps, dense):
    """Return the covariance of shapes of densely laid windows, and of the maps as they are."""
    off = maps - maps.mean(axis=0)
    return {
        "scale-free": contrasts(with_symmetries(shape_covariance(dense), SHAPE), ALL),
        "plain": contrasts(with_symmetries(off.T @ off, SHAPE), ALL),
    }


KERNELS = {decay: kernel_covariance(SHAPE, Kernel(1.0, decay, 0.0), ALL) for decay in DECAYS}


def decode(covariance, cells, values, nugget):
    """Return the maps (n, N) by universal kriging with unknown level; None when the system is singular."""
    try:
        factor = cho_factor(covariance[np.ix_(cells, cells)] + nugget * np.eye(cells.size), lower=True)
    except LinAlgError:
        return None
    solved = cho_solve(factor, np.column_stack([values.T, np.ones(cells.size)]))
    ones = solved[:, -1]
    level = solved[:, :-1].sum(axis=0) / ones.sum()
    return (level + covariance[:, cells] @ (solved[:, :-1] - np.outer(ones, level))).T


def test_error(fold, stops, sd, metric):
    """Choose the blend on the validation maps and return its mean error on the test maps."""
    cells = LEGS.cells_under(stops)
    truth = fold.sets.validation
    values = truth[:, cells] + sd * stream(0, 8).standard_normal((len(truth), cells.size))
    known = {}

    def mixed(part, share, decay):
        return share * part + (1 - share) * KERNELS[decay]

    def error(choice):
        if choice not in known:
            share, decay, nugget, name = choice
            decoded = decode(mixed(fold.training[name], share, decay), cells, values, nugget)
            known[choice] = np.inf if decoded is None else metric(truth, decoded).mean()
        return known[choice]

    best, before = (0.5, 12.0, 1e-4, "scale-free"), None
    while best != before:
        before = best
        for place, options in enumerate((SHARES, DECAYS, NUGGETS, tuple(fold.training))):
            best = min([best, *((*best[:place], one, *best[place + 1 :]) for one in options)], key=error)
    share, decay, nugget, name = best
    truth = fold.sets.test
    values = truth[:, cells] + sd * stream(0, 9).standard_normal((len(truth), cells.size))
    return metric(truth, decode(mixed(fold.both[name], share, decay), cells, values, nugget)).mean()


def lawnmower(task, _options):
    """Return the most lines that the budget allows, half a spacing away from every side."""
    best = None
    for lines in range(1, SHAPE[0] + 1):
        spacing = SHAPE[0] / lines
        row = ((np.arange(lines) + 0.5) * spacing).astype(int)
        inset = int(spacing / 2)
        ends = [np.array([inset, SHAPE[1] - 1 - inset])[:: 1 if k % 2 == 0 else -1] for k in range(lines)]
        stops = np.concatenate([at * SHAPE[1] + end for at, end in zip(row, ends, strict=True)])
        if LEGS.path_length(stops) <= task.budget.limit:
            best = stops
    return best


def qr_pivots(task, _options):
    with one_blas_thread():
        prior = belief(task.covariance, ALL, rank=128, least=task.least_telling)
        return tour_within(pivots(prior, task.sensor.noise), costs(task.budget, LEGS))


def refined(task, options):
    return refine(task, seed=options.seed, iterations=options.iterations, workers=options.workers).stops


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("field", type=Path)
    parser.add_argument("--native", action="store_true", help="keep the native pixels (else 1390 x 994)")
    parser.add_argument("--squared", action="store_true", help="print squared errors")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--iterations", type=int, default=DEFAULT_ITERATIONS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    options = parser.parse_args()
    if options.quick:
        options.iterations = min(options.iterations, 20_000)
    field, pixels = read_field(options.field), None if options.native else PAPER_PIXELS
    maps = study_maps(field, pixels)
    folds = [Fold.of(maps, field, pixels, number) for number in range(1 if options.quick else len(BLOCKED_FOLDS))]
    metric = squared_error if options.squared else relative_error
    print(
        f"{options.field.name}: {len(maps.maps)} maps, {maps.dropped} dropped, {maps.filled} filled; {metric.__name__}"
    )
    print("| noise | budget | route | " + " | ".join(f"fold {k}" for k in range(len(folds))) + " | mean | length | s |")
    print("|---" * (len(folds) + 6) + "|")
    for sd in NOISES:
        for limit in BUDGETS:
            for planner in (lawnmower, qr_pivots, refined):
                report(planner, folds, limit, sd, metric, options)


def report(planner, folds, limit, sd, metric, options) -> None:
    errors, lengths, seconds = [], [], []
    for fold in folds:
        noise = LEAST_NOISE + sd**2 / fold.sets.training.var(axis=1).mean()
        task = Task(fold.training["scale-free"], LEGS, Budget(float(limit), "distance"), Sensor(noise))
        start = time.perf_counter()
        stops = planner(task, options)
        seconds.append(time.perf_counter() - start)
        lengths.append(LEGS.path_length(stops))
        errors.append(test_error(fold, stops, sd, metric))
    print(
        f"| {sd:g} | {limit} | {planner.__name__} | {' | '.join(f'{one:.4f}' for one in errors)} | "
        f"{np.mean(errors):.4f} | {np.mean(lengths):.0f} | {np.mean(seconds):.1f} |",
        flush=True,
    )


if __name__ == "__main__":
    main()
