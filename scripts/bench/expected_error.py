#!/usr/bin/env python3
"""How optimistic the stated error is: the search chose Phi on the maps that it is stated from.

Decodes fresh maps of the built-in synthetic field, of the size of the mission's model and from other seeds, with a
mission's own Phi, dictionary and lambda, and prints the error beside the one on the model's validation maps.

    scripts/bench/expected_error.py missions/doha/doha.npz missions/gulf/gulf.npz [--maps 200]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from sparsor.core.metrics import centred_relative_error
from sparsor.design.lars import lasso
from sparsor.mission.sidecar import read_sidecar
from sparsor.prior.synthetic import synthetic_maps

SEEDS = (1, 2, 3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sidecars", type=Path, nargs="+")
    parser.add_argument("--maps", type=int, default=200, help="fresh maps a seed")
    options = parser.parse_args()
    print("mean and median of |s - s'| / |s - mean(s)|, from the sums, before widening")
    for path in options.sidecars:
        sidecar = read_sidecar(path)
        model = sidecar.model
        low, high = model.scale
        print(f"{path}: on the maps that Phi was chosen on {errors(sidecar, model.validation)}")
        for seed in SEEDS:
            maps = synthetic_maps(model.window_m, model.shape, options.maps, seed, "validation")
            print(f"  fresh maps, seed {seed}                     {errors(sidecar, (maps - low) / (high - low))}")


def errors(sidecar, maps) -> str:
    model, phi = sidecar.model, sidecar.phi.astype(float)
    codes = lasso(phi @ model.dictionary, (maps - model.mean) @ phi.T, sidecar.lasso_weight)
    each = centred_relative_error(maps, codes @ model.dictionary.T + model.mean)
    return f"mean {np.nanmean(each):.2f}  median {np.nanmedian(each):.2f}"


if __name__ == "__main__":
    main()
