#!/usr/bin/env python3
"""Make, or check, the built-in models: learned from the synthetic Gulf NO2 field, one a ground size.

    scripts/make_builtin_models.py            # write them
    scripts/make_builtin_models.py --check    # learn them again and compare

They are stored in half precision (about 3 digits) and with 128 components of the covariance, which keeps them below
8 MB together. The maps are drawn from fixed seeds; the dictionary's solver sums in an order that depends on the
machine's linear algebra library, so a check compares what a model is for: the representation error of its validation
maps and its lambda, to 5 %.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from sparsor.core.files import write_file
from sparsor.core.metrics import centred_relative_error
from sparsor.design.lars import lasso
from sparsor.journeys.modelling import learn_model, representation_error
from sparsor.prior.builtin import SIDES_M, builtin_maps, builtin_model, file_name
from sparsor.prior.model import arrays_to_npz, model_arrays, model_from_npz

FOLDER = Path(__file__).resolve().parents[1] / "src" / "sparsor" / "prior" / "models"
LARGEST_BYTES = 8_000_000
COMPONENTS = 128
TOLERANCE = 0.05


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare instead of writing")
    parser.add_argument("--side-km", type=float, action="append", help="only this size; may be repeated")
    options = parser.parse_args()
    sides = [side for side in SIDES_M if not options.side_km or side / 1000 in options.side_km]
    print("side_km  seconds  atoms  lambda  kernel_cells  representation_error  decode_error_89_cells  kB")
    good = True
    for side in sides:
        start = time.perf_counter()
        model = learn_model(builtin_maps(side))
        model = replace(model, covariance_factor=model.covariance_factor[:, :COMPONENTS])
        content = arrays_to_npz(model_arrays(model, np.float16))
        model = model_from_npz(content, file_name(side))
        error = representation_error(model)
        print(
            f"{side / 1000:7g}  {time.perf_counter() - start:7.1f}  {model.atoms:5d}  {model.lasso_weight:6g}  "
            f"{model.kernel.length_cells:12.1f}  {error:20.4f}  {decode_error(model):21.4f}  {len(content) / 1000:.0f}",
            flush=True,
        )
        if options.check:
            good &= same(builtin_model(side), model.lasso_weight, error)
        else:
            write_file(FOLDER / file_name(side), content)
    total = sum(path.stat().st_size for path in FOLDER.glob("*.npz"))
    print(f"{total / 1e6:.2f} MB together (at most {LARGEST_BYTES / 1e6:g})")
    return 0 if good and total <= LARGEST_BYTES else 1


def decode_error(model) -> float:
    """Mean |s - s'| / |s - mean(s)| of validation maps decoded from the same 89 random cells."""
    cells = np.random.default_rng(0).choice(model.mean.size, 89, replace=False)
    codes = lasso(model.dictionary[cells], (model.validation - model.mean)[:, cells], model.lasso_weight)
    return float(centred_relative_error(model.validation, codes @ model.dictionary.T + model.mean).mean())


def same(packaged, weight: float, error: float) -> bool:
    held = representation_error(packaged)
    agrees = packaged.lasso_weight == weight and abs(error - held) <= TOLERANCE * held
    print(f"         packaged: lambda {packaged.lasso_weight:g}, error {held:.4f}: {'same' if agrees else 'DIFFERS'}")
    return agrees


if __name__ == "__main__":
    sys.exit(main())
