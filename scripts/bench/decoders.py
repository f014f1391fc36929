#!/usr/bin/env python3
"""How good each decoder's map is, and how often its stated uncertainty holds, on maps that it has never seen.

Held-out maps, in ppb with a spread of 13 (a range of about 60), are measured in every cell under a route and decoded
by each decoder: all with one rehearsal on the validation maps for that spread, or with --each as users do, one by one
with a rehearsal for the amplitude estimated from each map's values. A model is learned from the training windows of
each split; every choice is made on its validation windows. Printed as Markdown: the mean relative error
|s - s'| / |s - mean(s)|, the same over |s| and the squared l2 error on the 0..1 scale, the first as it is stated from
the validation maps, and the share of cells within 1.96 standard deviations before and after the recalibration.

    scripts/bench/decoders.py                                   the built-in field, 14.7 km
    scripts/bench/decoders.py --field FIELD.tif                 resampled to the paper's pixels
    scripts/bench/decoders.py --field FIELD.nc --native         at its own pixels
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from sparsor.core.metrics import centred_relative_error, relative_error, squared_error
from sparsor.core.streams import stream
from sparsor.core.workers import one_blas_thread
from sparsor.design import Budget, Problem, Weights, search, searched_sparsity, unit_legs
from sparsor.design.decoders import Measurements, decode_each
from sparsor.design.decoders.decode import CHOICES, candidates
from sparsor.design.decoders.setting import Setting
from sparsor.prior.builtin import SHAPE, builtin_model
from sparsor.prior.learning import TrainingMaps, untuned_model
from sparsor.prior.reading import read_field
from sparsor.prior.synthetic import synthetic_maps
from sparsor.study.protocol import PAPER_PIXELS, blocked_split, random_split, study_maps

BUDGETS = (0.1, 0.2, 0.3)
LEVEL_PPB, SPREAD_PPB = 40.0, 13.0  # a range of about 60
NOISES_PPB = (5.0, 0.0)
DECODERS = (*CHOICES, "auto")
COLUMNS = (
    "route",
    "noise",
    "decoder",
    "error / contrast",
    "error / map",
    "squared error",
    "stated error",
    "covered, raw",
    "covered",
)
LEGS = unit_legs(SHAPE)


@dataclass(frozen=True)
class Case:
    """A model and maps it has not seen, both on the model's 0..1 scale."""

    model: object
    test: np.ndarray


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--field", type=Path, help="instead of the built-in field")
    parser.add_argument("--native", action="store_true", help="windows of the field's own pixels, not the paper's")
    parser.add_argument("--side-m", type=float, default=14_700.0, help="size of the built-in model")
    parser.add_argument("--maps", type=int, default=200, help="most held-out maps a split")
    parser.add_argument("--each", action="store_true", help="decode flight by flight; slow")
    parser.add_argument("--iterations", type=int, default=200, help="of Algorithm 1")
    parser.add_argument("--atoms", type=int, default=256)
    parser.add_argument("--random-seeds", type=int, default=3, help="how many of the random splits")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    options = parser.parse_args()
    for protocol, cases in cases_of(options).items():
        print(f"\n### {protocol}: {sum(len(case.test) for case in cases)} held-out maps\n")
        print(f"| {' | '.join(COLUMNS)} |")
        print("|---" * len(COLUMNS) + "|")
        with ProcessPoolExecutor(options.workers) as pool:
            for budget in BUDGETS:
                for planner in (lawnmower, algorithm_1):
                    routes = list(pool.map(partial(planner, budget, options.iterations), cases))
                    for noise in NOISES_PPB:
                        report(pool, f"{planner.__name__} {budget:.0%}", options, noise, cases, routes)


def report(pool, planner, options, noise, cases, routes) -> None:
    decode_all = flight_by_flight if options.each else at_once
    jobs = [(case, cells, noise) for case, cells in zip(cases, routes, strict=True)]
    parts = list(pool.map(decode_all, *zip(*jobs, strict=True)))
    for decoder in DECODERS:
        contrast, whole, squared, stated, raw, calibrated = np.concatenate([part[decoder] for part in parts]).mean(
            axis=0
        )
        print(
            f"| {planner} ({np.mean([cells.size for cells in routes]):.0f} cells) | {noise:g} | {decoder} "
            f"| {contrast:.3f} | {whole:.3f} | {squared:.3f} | {stated:.3f} | {raw:.1%} | {calibrated:.1%} |",
            flush=True,
        )


def measure(case, cells, noise):
    """Return the maps in ppb, and all of them measured in some cells."""
    shifted = case.test - case.test.mean(axis=1, keepdims=True)
    fields = LEVEL_PPB + SPREAD_PPB * shifted / shifted.std(axis=1, keepdims=True)
    drawn = stream(0, cells.size, 77).standard_normal((len(fields), cells.size))
    return fields, fields[:, cells] + noise * drawn


def at_once(case, cells, noise):
    """Decode all maps with one rehearsal, made for the amplitude that they have."""
    fields, values = measure(case, cells, noise)
    flight = Measurements(np.eye(fields.shape[1])[cells], values[0], np.full(cells.size, noise**2))
    allowed = np.ones(fields.shape[1], dtype=bool)
    setting = Setting(case.model, flight, allowed, np.zeros(cells.size), 0)
    with one_blas_thread():  # the processes share the cores
        tried = candidates(setting, amplitude=SPREAD_PPB)
        rows = {name: [] for name in CHOICES}
        for name, one in tried.items():
            found = one.decoder.decode(values)
            rows[name] = [
                figures(truth, field, mean, np.sqrt(variance), one.widening, one.error)
                for truth, field, mean, variance in zip(case.test, fields, found.mean, found.variance, strict=True)
            ]
    return rows | {"auto": rows[min(tried, key=lambda name: tried[name].error)]}


def flight_by_flight(case, cells, noise):
    """Decode each map with a rehearsal of its own, for the amplitude estimated from its values, as users do."""
    rows = {name: [] for name in DECODERS}
    for truth, field, values in zip(case.test, *measure(case, cells, noise), strict=True):
        flight = Measurements(np.eye(field.size)[cells], values, np.full(cells.size, noise**2))
        found = decode_each(flight, case.model)
        found["auto"] = min(found.values(), key=lambda one: one.expected_relative_error)
        for name in DECODERS:
            one = found[name]
            sd = one.standard_deviation / one.recalibration
            rows[name].append(figures(truth, field, one.values, sd, one.recalibration, one.expected_relative_error))
    return rows


def figures(truth, field, estimate, sd, widening, stated):
    on_scale = truth.mean() + (estimate - LEVEL_PPB) * truth.std() / SPREAD_PPB
    missed = np.abs(field - estimate)
    return (
        centred_relative_error(field[None], estimate[None])[0],
        relative_error(truth[None], on_scale[None])[0],
        squared_error(truth[None], on_scale[None])[0],
        stated,
        np.mean(missed <= 1.96 * sd),
        np.mean(missed <= 1.96 * widening * sd),
    )


def lawnmower(budget, _iterations, _case):
    """Return the cells under as many lines as the budget allows, half a spacing away from every side."""
    rows, columns = SHAPE
    lines = max(k for k in range(1, rows + 1) if k * columns - columns / k <= budget * (LEGS.size - 1))
    row = ((np.arange(lines) + 0.5) * rows / lines).astype(int)
    inset = int(columns / lines / 2)
    ends = [np.array([inset, columns - 1 - inset])[:: 1 if k % 2 == 0 else -1] for k in range(lines)]
    return LEGS.cells_under(np.concatenate([at * columns + end for at, end in zip(row, ends, strict=True)]))


def algorithm_1(budget, iterations, case):
    """Return the cells under the route that the paper's search finds within the budget."""
    return LEGS.cells_under(searched_stops(budget, iterations, case.model))


def searched_stops(budget, iterations, model):
    """Return the stops, in flight order, of the route that the paper's search finds within the budget."""
    limit = Budget(budget * (LEGS.size - 1), "distance")
    problem = Problem(model.dictionary, model.validation - model.mean, model.lasso_weight, LEGS, budget=limit)
    sparsity = searched_sparsity(limit.stops_within(LEGS), LEGS.size, problem.rows)
    return search(problem, sparsity, Weights(), seed=0, iterations=iterations).stops


def cases_of(options):
    if options.field is None:
        model = builtin_model(options.side_m)
        low, high = model.scale
        maps = synthetic_maps(model.window_m, SHAPE, options.maps, 1, "validation")
        name = f"built-in field, {options.side_m / 1000:g} km, fresh maps"
        return {name: [Case(model, (maps - low) / (high - low))]}
    field = read_field(options.field)
    windows = study_maps(field, None if options.native else PAPER_PIXELS)
    splits = {
        "random": [random_split(windows, seed) for seed in range(options.random_seeds)],
        "blocked": [blocked_split(windows, fold) for fold in range(3)],
    }
    return {
        f"{options.field.name}, {name}": [case_of(windows, one, options) for one in chosen]
        for name, chosen in splits.items()
    }


def case_of(windows, split, options):
    spread = np.linspace(0, len(split.validation) - 1, min(56, len(split.validation))).round().astype(int)
    maps = TrainingMaps(
        windows.maps[split.training],
        windows.maps[split.validation][spread],
        SHAPE,
        (1.0, 1.0),  # on the ground it does not matter here
        windows.unit,
        windows.source,
    )
    model = untuned_model(maps, atoms=options.atoms)
    low, high = model.scale
    chosen = np.linspace(0, len(split.test) - 1, min(options.maps, len(split.test))).round().astype(int)
    return Case(model, (windows.maps[split.test][chosen] - low) / (high - low))


if __name__ == "__main__":
    main()
