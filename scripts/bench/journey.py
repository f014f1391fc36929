#!/usr/bin/env python3
"""From simulated flights to maps: each decoder's error, and how often its stated uncertainty holds.

Held-out maps, in ppb with a spread of 13, are laid over a box of 2.45 km and flown at 10 m/s by a sensor of t90 20 to
30 s, noise 5 ppb and a drift of sd 5 ppb an hour, as its profile says, that loses a tenth of its samples. What it logs
goes through `measure` and `decode_each` as a user's log does. Flights take the routes in turn: planned by Algorithm 1
within 20 % of full coverage, eight lines there and across, and the eight lines once, which never meet. Printed as
Markdown for each split: the mean relative error |s - s'| / |s - mean(s)|, the same as it is stated, and the share of
the true cells within 1.96 standard deviations before and after the recalibration on the validation maps, with the
standard error of that share over the flights. Then, on other flights, how spikes, a freeze and the drift are found.

    scripts/bench/journey.py                                   the built-in field
    scripts/bench/journey.py --field FIELD.tif                 splits `random` and `blocked` of a field
    scripts/bench/journey.py --field FIELD.nc --native         at its own pixels
    scripts/bench/journey.py --flights 21 --faults 0
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from decoders import LEVEL_PPB, SPREAD_PPB, cases_of, searched_stops
from measuring import ALTITUDE_M, FINE, GRID, SIDE_M, Flight, fields, fly, line_stops, print_drift, print_faults
from scipy.ndimage import map_coordinates

from sparsor.core.metrics import centred_relative_error
from sparsor.core.streams import stream
from sparsor.core.workers import one_blas_thread
from sparsor.design.decoders import decode_each
from sparsor.design.decoders.decode import CHOICES
from sparsor.fieldmap.measuring import measure
from sparsor.vehicle import SensorProfile

ROUTES = ("planned", "across", "lines")
DECODERS = (*CHOICES, "auto")
NOISE_PPB, DRIFT_SD_PPB_H = 5.0, 5.0  # as the profile states them
T90_S = (20.0, 30.0)
BUDGET, ITERATIONS = 0.2, 200
COLUMNS = ("route", "decoder", "error", "stated error", "covered, raw", "covered", "+-")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--field", type=Path, help="instead of the built-in field")
    parser.add_argument("--native", action="store_true", help="windows of the field's own pixels, not the paper's")
    parser.add_argument("--flights", type=int, default=201, help="of each split")
    parser.add_argument("--faults", type=int, default=200, help="flights of each kind with faults, and with a drift")
    parser.add_argument("--atoms", type=int, default=256)
    parser.add_argument("--random-seeds", type=int, default=3, help="how many of the random splits")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--split", choices=("random", "blocked"), help="of a field, only this one")
    options = parser.parse_args()
    options.maps, options.side_m = options.flights, SIDE_M
    with ProcessPoolExecutor(options.workers) as pool:
        for protocol, cases in cases_of(options).items():
            if options.split and not protocol.endswith(options.split):
                continue
            print_maps(pool, protocol, cases, options)
        if options.faults:
            maps = fields(options.faults)

            def each(task, flight):
                return np.array(list(pool.map(partial(task, flight), range(len(maps)), maps, chunksize=5)))

            print_faults(each)
            print_drift(each)


def print_maps(pool, protocol, cases, options) -> None:
    print(f"\n### {protocol}: {options.flights} flights\n")
    print(f"| {' | '.join(COLUMNS)} |")
    print("|---" * len(COLUMNS) + "|")
    planned = list(pool.map(planned_stops, cases))
    jobs = [job(cases, planned, number, options.flights) for number in range(options.flights)]
    found = list(pool.map(flown, *zip(*jobs, strict=True)))
    taken = [route for route, *_ in jobs]
    for route in ("all", *ROUTES):
        flights = [one for one, own in zip(found, taken, strict=True) if route in ("all", own)]
        for decoder in DECODERS:
            each = np.array([one[decoder] for one in flights])
            error, stated, raw, covered = each.mean(axis=0)
            apart = each[:, 3].std() / np.sqrt(len(each))
            print(
                f"| {route} | {decoder} | {error:.3f} | {stated:.3f} | {raw:.1%} | {covered:.1%} | {apart:.1%} |",
                flush=True,
            )


def job(cases, planned, number, flights):
    """Return what `flown` takes: routes in turn, then cases in turn, each of them through all of its maps."""
    turn, route = divmod(number, len(ROUTES))
    turn, at = divmod(turn, len(cases))
    test = cases[at].test
    turns = -(-flights // (len(ROUTES) * len(cases)))
    shape = test[(turn * len(ROUTES) + route) * len(test) // (turns * len(ROUTES))]
    return ROUTES[route], number, cases[at].model, shape, planned[at]


def planned_stops(case):
    """Return the stops that the paper's search plans within the budget, as shares of the box, in flight order."""
    row, column = np.divmod(searched_stops(BUDGET, ITERATIONS, case.model), GRID.shape[1])
    return np.array([(column + 0.5) / GRID.shape[1], 1 - (row + 0.5) / GRID.shape[0]])


def flown(route, number, model, shape, planned):
    """Return the figures of each decoder for one flight."""
    draw = stream(2026, number, 3)
    t90_s = draw.uniform(*T90_S)
    flight = Flight(t90_s, NOISE_PPB, DRIFT_SD_PPB_H * draw.standard_normal(), across=route == "across")
    truth = LEVEL_PPB + SPREAD_PPB * (shape - shape.mean()) / shape.std()
    stops = planned if route == "planned" else line_stops(flight)
    samples = fly(flight, surface(truth), draw, stops).samples
    profile = SensorProfile(name="simulated", t90_s=t90_s, noise_sd=NOISE_PPB, drift_sd_per_h=DRIFT_SD_PPB_H)
    with one_blas_thread():  # the processes share the cores
        measured = measure(samples, GRID, profile, altitude_m=ALTITUDE_M)
        found = dict(decode_each(measured.measurements, model))
    found["auto"] = min(found.values(), key=lambda one: one.expected_relative_error)
    return {name: figures(truth, one) for name, one in found.items()}


def figures(truth, one):
    missed = np.abs(truth - one.values)
    reach = 1.96 * one.standard_deviation
    return (
        centred_relative_error(truth[None], one.values[None])[0],
        one.expected_relative_error,
        np.mean(missed <= reach / one.recalibration),
        np.mean(missed <= reach),
    )


def surface(cells):
    """Return a field (FINE, FINE), linear between the middles of cells, whose means over cells are these."""
    side = GRID.shape[0]
    # The mean of a broken line over a cell: 3/4 of its own middle, 1/8 of each neighbour's; beyond the edge it is flat.
    means = 0.75 * np.eye(side) + 0.125 * (np.eye(side, k=1) + np.eye(side, k=-1))
    means[0, 0] = means[-1, -1] = 0.875
    middles = np.linalg.solve(means, np.linalg.solve(means, cells.reshape(side, side)).T).T
    at = (np.arange(FINE) + 0.5) * side / FINE - 0.5
    return map_coordinates(middles, np.meshgrid(at, at, indexing="ij"), order=1, mode="nearest")


if __name__ == "__main__":
    main()
