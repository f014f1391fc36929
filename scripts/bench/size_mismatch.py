#!/usr/bin/env python3
"""What a model learned at another ground size costs: the factor on the error that it states.

For every pair of built-in sizes up to --most times apart: the maps of one size, in the field's unit, are decoded with
the model of the other from the same random Phi (LASSO from the sums), and the error is set against the one that the
model states from its own validation maps. The exponent e of factor = ratio ** e is fitted through all pairs.

    scripts/bench/size_mismatch.py [--most 20] [--draws 4]
"""

from __future__ import annotations

import argparse

import numpy as np

from sparsor.core.metrics import centred_relative_error
from sparsor.core.streams import stream
from sparsor.design.lars import lasso
from sparsor.design.sensing import draw_phi
from sparsor.prior.builtin import SIDES_M, builtin_model

PROBABILITIES = (0.014, 0.03)  # about 10 and 89 cells


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--most", type=float, default=20.0, help="largest ratio of sizes")
    parser.add_argument("--draws", type=int, default=4, help="random Phi of each density")
    options = parser.parse_args()
    models = {side: builtin_model(side) for side in SIDES_M}
    print("model_km   maps_km   ratio   stated  realised   factor")
    logs = []
    for side, model in models.items():
        stated = error(model, model.validation, options.draws)
        for other, truth in models.items():
            ratio = max(side / other, other / side)
            if side == other or ratio > options.most:
                continue
            maps = on_scale(truth.validation, truth.scale, model.scale)
            realised = error(model, maps, options.draws)
            logs.append((np.log(ratio), np.log(realised / stated)))
            print(
                f"{side / 1000:8g}  {other / 1000:8g}  {ratio:6.2f}  {stated:7.3f}  {realised:8.3f}  "
                f"{realised / stated:7.2f}"
            )
    x, y = np.array(logs).T
    print(f"exponent, least squares through ratio 1: {(x @ y) / (x @ x):.2f}")
    print(f"exponent, median of the pairs:           {np.median(y / x):.2f}")


def on_scale(maps, own, wanted):
    return (own[0] + maps * (own[1] - own[0]) - wanted[0]) / (wanted[1] - wanted[0])


def error(model, maps, draws: int) -> float:
    found = []
    for probability in PROBABILITIES:
        for draw in range(draws):
            phi = draw_phi(stream(draw), 35, model.mean.size, probability, 3).astype(float)
            codes = lasso(phi @ model.dictionary, (maps - model.mean) @ phi.T, model.lasso_weight)
            found.append(np.median(centred_relative_error(maps, codes @ model.dictionary.T + model.mean)))
    return float(np.mean(found))


if __name__ == "__main__":
    main()
