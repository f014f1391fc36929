#!/usr/bin/env python3
"""Algorithm 1's random Phi on a field, by the blocked protocol.

Per fold: learns K = 256 atoms, chooses lambda on the validation maps, draws random Phi with p = 0.03,
theta = 3, M = 35, and prints visited cells, the nearest-neighbour path and the errors of the LASSO from the 35
sums; then lets Algorithm 1 choose with lambda_path = lambda_incoh = 0.

    scripts/bench/algorithm1_reference.py gulf_no2_omi_2020-09.tif
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

import numpy as np

from sparsor.core.metrics import centred_relative_error, relative_error, squared_error
from sparsor.core.streams import stream
from sparsor.design import Problem, Weights, evaluate, fixed_sparsity, lasso, search, unit_legs
from sparsor.design.tuning import choose_lasso_weight
from sparsor.prior.dictionary import learned_dictionary
from sparsor.prior.reading import read_field
from sparsor.study import blocked_split, scaled, study_maps
from sparsor.study.protocol import BLOCKED_FOLDS, PAPER_PIXELS

ATOMS, ROWS, PROBABILITY, THETA = 256, 35, 0.03, 3


def main() -> None:
    options = _options()
    maps = study_maps(read_field(options.field), None if options.native else PAPER_PIXELS)
    print(f"{options.field}: {len(maps.maps)} maps, {maps.dropped} dropped, {maps.filled} filled")
    print(f"p = {PROBABILITY}, theta = {THETA}, M = {ROWS}, K = {ATOMS}, {options.draws} random Phi a fold")
    print("errors: sq = |s - s'|^2, rel = |s - s'| / |s|, centred = |s - s'| / |s - mean(s)|; mean over maps\n")
    for fold in range(len(BLOCKED_FOLDS)):
        _report(maps, fold, options)


def _report(maps, fold, options) -> None:
    sets = scaled(maps, blocked_split(maps, fold))
    mean = sets.training.mean(axis=0)
    start = time.perf_counter()
    psi = learned_dictionary(sets.training - mean, ATOMS, seed=options.seed)
    learned = time.perf_counter() - start
    legs = unit_legs()
    weight = choose_lasso_weight(psi, sets.validation - mean, legs, rows=ROWS, seed=options.seed)
    problem = Problem(psi, sets.validation - mean, weight, legs, ROWS, improve=False)
    sparsity = fixed_sparsity(PROBABILITY, THETA)
    draws = [
        evaluate(problem, sparsity, Weights(), rng=stream(options.seed, r), sample=r) for r in range(options.draws)
    ]
    test = np.array([_errors(one.phi, psi, mean, weight, sets.test) for one in draws])
    cells = [one.stops.size for one in draws]
    validation = np.array([one.error for one in draws])
    print(
        f"fold {fold}: {len(sets.training)} training, {len(sets.validation)} validation, {len(sets.test)} test maps; "
        f"dictionary of {psi.shape[1]} atoms in {learned:.1f} s, lambda {weight:g}"
    )
    print(f"  cells visited            mean {np.mean(cells):.1f} ({min(cells)}-{max(cells)})")
    print(f"  nearest-neighbour path   median {np.median([one.length_cells for one in draws]):.0f} cell units")
    print(f"  validation error (sq)    median {np.median(validation):.4f}")
    print("  test error, mean         sq {:.4f}  rel {:.4f}  centred {:.4f}".format(*test.mean(axis=0)))
    best = search(
        problem, sparsity, Weights(), seed=options.seed, iterations=options.iterations, workers=os.cpu_count() or 1
    )
    chosen = _errors(best.phi, psi, mean, weight, sets.test)
    print(
        f"  Algorithm 1, best of {options.iterations}: validation sq {best.error:.4f} "
        f"(below the median draw: {best.error < np.median(validation)}), path {best.length_cells:.0f}"
    )
    print("    its test error         sq {:.4f}  rel {:.4f}  centred {:.4f}\n".format(*chosen))


def _errors(phi, psi, mean, weight, truth) -> tuple[float, float, float]:
    """Decode the test maps from the sums that Phi measures."""
    codes = lasso(phi @ psi, (truth - mean) @ phi.T.astype(np.float64), weight)
    estimate = codes @ psi.T + mean
    return tuple(
        float(metric(truth, estimate).mean()) for metric in (squared_error, relative_error, centred_relative_error)
    )


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("field", type=Path, help="GeoTIFF or NetCDF")
    parser.add_argument("--native", action="store_true", help="keep the native pixels (else 1390 x 994)")
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--iterations", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args()


if __name__ == "__main__":
    main()
