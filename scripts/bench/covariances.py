#!/usr/bin/env python3
"""How much each training window should count in the covariance of shapes: bare shapes, maps as they are, and between.

A window counts as its spread to a power: 0 is bare shapes (many weak windows decide), 2 the maps as they are (a few
strong ones do). Printed for each budget and noise, by the blocked protocol, on the validation maps alone: the mean
error of the blend over two routes (lawnmower, refined with few moves) and the three folds.

    scripts/bench/covariances.py gulf_no2_omi_2020-09.tif
    scripts/bench/covariances.py wide_no2_omi_2020-09.nc --native --squared
"""

from __future__ import annotations

import argparse
import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from sparsor.core.metrics import relative_error, squared_error
from sparsor.core.workers import one_blas_thread
from sparsor.design import Budget, unit_legs
from sparsor.design.decoders.covariance import contrasts, with_symmetries
from sparsor.design.refined import refine
from sparsor.prior.reading import read_field
from sparsor.prior.statistics import unit_shapes
from sparsor.study import study_maps
from sparsor.study.baselines import lawnmower
from sparsor.study.cases import blocked_case
from sparsor.study.decoding import validation_error
from sparsor.study.observing import readings, task_of
from sparsor.study.protocol import BLOCKED_FOLDS, PAPER_PIXELS, dense_maps

POWERS = (0.0, 0.5, 1.0, 1.5, 2.0)
BUDGETS, NOISES = (102, 200, 274), (0.0, 0.01)
SHAPE = (32, 32)
LEGS = unit_legs(SHAPE)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("field", type=Path)
    parser.add_argument("--native", action="store_true", help="keep the native pixels (else 1390 x 994)")
    parser.add_argument("--squared", action="store_true", help="print squared errors")
    parser.add_argument("--iterations", type=int, default=60_000)
    options = parser.parse_args()
    metric = squared_error if options.squared else relative_error
    field, pixels = read_field(options.field), None if options.native else PAPER_PIXELS
    maps = study_maps(field, pixels)
    errors = [of_fold(maps, field, fold, pixels, metric, options) for fold in range(len(BLOCKED_FOLDS))]
    print("| noise | budget | " + " | ".join(f"spread^{power:g}" for power in POWERS) + " |")
    print("|---" * (len(POWERS) + 2) + "|")
    for key, row in zip(errors[0], np.mean([list(one.values()) for one in errors], axis=0), strict=True):
        print(f"| {key[0]:g} | {key[1]} | " + " | ".join(f"{one:.4f}" for one in row) + " |")


def of_fold(maps, field, fold, pixels, metric, options):
    """Return the errors of each power, by noise and budget."""
    case = blocked_case(maps, field, fold, pixels)
    dense = list(dense_maps(field, fold, pixels))
    cases = [replace(case, training={"weighted": covariance(dense, power)}) for power in POWERS]
    found = {}
    for sd in NOISES:
        for limit in BUDGETS:
            task = task_of(case, LEGS, limit, sd=sd)
            routes = (
                lawnmower(LEGS, Budget(float(limit), "distance")),
                refine(task, seed=0, iterations=options.iterations, workers=os.cpu_count()).stops,
            )
            made = [readings(LEGS, stops, "legs", sd=sd) for stops in routes]
            with one_blas_thread():
                found[sd, limit] = [np.mean([validation_error(one, m, "blend", metric) for m in made]) for one in cases]
    return found


def covariance(sets, power):
    total, weight = 0.0, 0.0
    for maps in sets:
        shapes, spread = unit_shapes(maps), maps[np.ptp(maps, axis=1) > 0].std(axis=1) ** power
        total = total + (shapes * spread[:, None]).T @ shapes
        weight += spread.sum()
    return contrasts(with_symmetries(total / weight, SHAPE), np.ones(LEGS.size, dtype=bool))


if __name__ == "__main__":
    main()
