#!/usr/bin/env python3
"""Time the compiled LARS against scikit-learn's, side by side in one run: one candidate is 56 validation maps.

    scripts/bench/lasso_speed.py [--atoms 256] [--uncentred] [--repeats 5]

Maps and dictionary are of the built-in synthetic field's 531 km model; the rows are sums over random Phi with
p = 0.03, theta = 3, M = 35. Both solve the same problems; the largest difference of the objectives is printed.
"""

from __future__ import annotations

import argparse

import numpy as np
from sklearn.decomposition import sparse_encode
from stopwatch import fastest
from threadpoolctl import threadpool_limits

from sparsor.core.streams import stream
from sparsor.design.lars import lasso
from sparsor.design.sensing import draw_phi
from sparsor.prior.builtin import builtin_maps, builtin_model
from sparsor.prior.dictionary import learned_dictionary

SIDE_M, WEIGHT = 531_000.0, 1e-3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--atoms", type=int, default=256)
    parser.add_argument("--uncentred", action="store_true", help="the paper's dictionary: nearly parallel atoms")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    psi, maps = problem(options.atoms, options.uncentred)
    phi = draw_phi(stream(0), 35, psi.shape[0], 0.03, 3).astype(float)
    A, targets = phi @ psi, maps @ phi.T
    lasso(A, targets[:1], WEIGHT)  # compiled now
    with threadpool_limits(1):
        ours, codes = fastest(lambda: lasso(A, targets, WEIGHT), options.repeats)
        theirs, reference = fastest(
            lambda: sparse_encode(targets, A.T, algorithm="lasso_lars", alpha=WEIGHT), max(1, options.repeats // 2)
        )
    difference = (objective(A, targets, codes) - objective(A, targets, reference)) / objective(A, targets, reference)
    print(f"{len(maps)} maps, A of {A.shape[0]} x {A.shape[1]}, {'un' if options.uncentred else ''}centred, one thread")
    print(f"  ours          {ours * 1e3:8.2f} ms a candidate, {(codes != 0).sum(axis=1).mean():.1f} atoms used a map")
    print(f"  scikit-learn  {theirs * 1e3:8.2f} ms a candidate")
    print(f"  ratio         {theirs / ours:8.1f}")
    print(f"  objective, ours less theirs: {difference.min():.1e} to {difference.max():.1e} (relative)")
    print(f"  largest violation of the optimality conditions (relative): {violation(A, targets, codes):.1e}")


def problem(atoms: int, uncentred: bool):
    model = builtin_model(SIDE_M)
    if atoms == model.atoms and not uncentred:
        return model.dictionary, model.validation - model.mean
    maps = builtin_maps(SIDE_M)
    low, high = maps.training.min(), maps.training.max()
    training = (maps.training - low) / (high - low)
    mean = 0.0 if uncentred else training.mean(axis=0)
    return learned_dictionary(training - mean, atoms, seed=0), (maps.validation - low) / (high - low) - mean


def objective(A, targets, codes):
    return 0.5 * np.square(codes @ A.T - targets).sum(axis=1) + WEIGHT * np.abs(codes).sum(axis=1)


def violation(A, targets, codes) -> float:
    pull = (targets - codes @ A.T) @ A
    gap = np.where(codes == 0, np.abs(pull) - WEIGHT, np.abs(pull - WEIGHT * np.sign(codes)))
    return float((gap.max(axis=1) / np.abs(targets @ A).max(axis=1)).max())


if __name__ == "__main__":
    main()
