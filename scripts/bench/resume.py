#!/usr/bin/env python3
"""Flights cut at 40 % and resumed, against the uninterrupted flight of the same length: the error of the map.

Held-out maps, in ppb with a spread of 13, are laid over a box of 2.45 km and flown at 10 m/s by the packaged sensor
(t90 30 s, noise 5 ppb, a drift of sd 5 ppb an hour), which loses a tenth of its samples. Each map is flown three times
with the same sensor: the refined route without a break; the same cut at 40 % of its length, and what `generate-mission
--resume` plans for the length that is left, flown after a pause in which the sensor goes on drifting; and, cut alike,
the rest of the old route after the pause. Home is the route's first stop; the ways from and to it are measured as they
are in the air, but the log that was cut ends at the cut. What is logged goes through `measure` and one decoder as a
user's logs do. Printed as Markdown for each split: the mean error |s - s'| / |s - mean(s)| of each, its mean ratio to
the uninterrupted flight's map by map, with the standard error of that, the same as the decoder states it, and the
kilometres flown over the stops and with the ways that are logged.

    scripts/bench/resume.py                                   the built-in field
    scripts/bench/resume.py --field FIELD.tif                 splits `random` and `blocked` of a field
    scripts/bench/resume.py --field FIELD.nc --native         at its own pixels
    scripts/bench/resume.py --validation                      on the model's validation maps: what choices are made on
    scripts/bench/resume.py --maps 10 --iterations 20000      quicker
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from decoders import LEVEL_PPB, SPREAD_PPB, cases_of
from journey import surface
from measuring import ALTITUDE_M, GRID, SIDE_M, SPEED_M_S, Flight, fly

from sparsor.core.metrics import centred_relative_error
from sparsor.core.streams import stream
from sparsor.core.workers import one_blas_thread
from sparsor.design import Budget, LegTable, Problem, unit_legs
from sparsor.design.decoders import decode
from sparsor.design.refined import refine
from sparsor.fieldmap.measuring import measure
from sparsor.journeys.covered import covered
from sparsor.journeys.refining import refined_task
from sparsor.journeys.resuming import known_of
from sparsor.vehicle import load_sensor

WAYS = ("uninterrupted", "resumed", "rest of the old route")
COLUMNS = ("split", "flight", "error", "ratio", "+-", "stated", "stated ratio", "km over the stops", "with the ways")
SENSOR = load_sensor()
BUDGET, CUT = 0.10, 0.4
CELL_M = SIDE_M / GRID.shape[0]
EVERYWHERE = np.ones(GRID.size, dtype=bool)


@dataclass(frozen=True)
class Job:
    """One map to be flown over."""

    number: int
    model: object
    shape: np.ndarray
    stops: np.ndarray
    pause_s: float
    ways: bool
    sensor: object
    iterations: int
    decoder: str


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--field", type=Path, help="instead of the built-in field")
    parser.add_argument("--native", action="store_true", help="windows of the field's own pixels, not the paper's")
    parser.add_argument("--validation", action="store_true", help="fly over the model's validation maps")
    parser.add_argument("--maps", type=int, default=40, help="flown over in each split")
    parser.add_argument("--iterations", type=int, default=60_000, help="of every search")
    parser.add_argument("--pause-s", type=float, default=1200.0)
    parser.add_argument("--bare", action="store_true", help="without the ways from and to home")
    parser.add_argument("--drift", type=float, default=SENSOR.drift_sd_per_h, help="sd of the sensor's, ppb an hour")
    parser.add_argument("--decoder", default="blend")
    parser.add_argument("--random-seeds", type=int, default=3, help="how many of the random splits")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--split", choices=("random", "blocked"), help="of a field, only this one")
    options = parser.parse_args()
    options.atoms, options.side_m = 64, SIDE_M  # the dictionary does not matter here
    print(f"| {' | '.join(COLUMNS)} |")
    print("|---" * len(COLUMNS) + "|")
    with ProcessPoolExecutor(options.workers) as pool:
        for protocol, cases in cases_of(options).items():
            if options.split and not protocol.endswith(options.split):
                continue
            routes = list(pool.map(planned, [case.model for case in cases], [options.iterations] * len(cases)))
            jobs = [job(cases, routes, number, options) for number in range(options.maps)]
            report(protocol, np.array(list(pool.map(flown, jobs))))


def report(protocol, found) -> None:
    """Print the figures of flights (n, ways, 4): errors, as they are stated, and lengths."""
    ratio = found / found[:, :1]
    for k, way in enumerate(WAYS):
        error, stated, stops_m, flown_m = found[:, k].mean(axis=0)
        apart = ratio[:, k, 0].std(ddof=1) / np.sqrt(len(found))
        print(
            f"| {protocol} | {way} | {error:.3f} | {ratio[:, k, 0].mean():.3f} | {apart:.3f} | {stated:.3f} | "
            f"{ratio[:, k, 1].mean():.3f} | {stops_m / 1000:.2f} | {flown_m / 1000:.2f} |",
            flush=True,
        )


def job(cases, routes, number, options):
    turn, at = divmod(number, len(cases))
    case = cases[at]
    maps = case.model.validation if options.validation else case.test
    turns = -(-options.maps // len(cases))
    shape = maps[turn * len(maps) // turns]
    sensor = SENSOR.model_copy(update={"drift_sd_per_h": options.drift})
    return Job(
        number,
        case.model,
        shape,
        routes[at],
        options.pause_s,
        not options.bare,
        sensor,
        options.iterations,
        options.decoder,
    )


def planned(model, iterations):
    """Return the stops of the uninterrupted route."""
    return refine(task_of(model, BUDGET * (GRID.size - 1) * CELL_M), seed=0, iterations=iterations).stops


def task_of(model, limit_m, known=None):
    """Return what is to be searched within a length; without dwells."""
    unit = unit_legs(GRID.shape)
    metres = CELL_M * unit.length
    legs = LegTable(GRID.shape, metres, metres / SPEED_M_S, CELL_M, unit.allowed)
    limit = Budget(limit_m, "distance")
    problem = Problem(model.dictionary, model.validation - model.mean, model.lasso_weight, legs, budget=limit)
    return refined_task(model, problem, SENSOR, hold_s=0.0, braking_s=0.0, known=known)


def flown(job):
    """Return errors of the three flights over one map, and as they are stated."""
    draw = stream(2026, job.number, 6)
    flight = Flight(SENSOR.t90_s, SENSOR.noise_sd, job.sensor.drift_sd_per_h * draw.standard_normal())
    truth = LEVEL_PPB + SPREAD_PPB * (job.shape - job.shape.mean()) / job.shape.std()
    air = surface(truth)
    home = job.stops[:1] if job.ways else job.stops[:0]
    whole = fly(flight, air, draw, shares(np.concatenate((job.stops, home))), 0.0).samples
    whole = replace(whole, unix_s=whole.time_s)
    part = taken(whole, whole.time_s <= CUT * length_m(job.stops) / SPEED_M_S)
    begin_s = part.time_s[-1] + job.pause_s
    with one_blas_thread():  # the processes share the cores
        measured = measured_of(part, job)
        done = covered(GRID, job.stops, part, np.ones(part.value.size, dtype=bool))
        known = known_of(measured, job.model, EVERYWHERE, job.sensor.drift_sd_per_h)
        known = replace(known, home=int(home[0]) if home.size else None)
        task = task_of(job.model, BUDGET * (GRID.size - 1) * CELL_M - done.length_m, known)
        route = refine(task, seed=0, iterations=job.iterations, begin=(done.left,))
        made = [figures(whole, truth, job, job.stops, home, 0.0)]
        for stops in (route.stops, done.left):
            further = fly(flight, air, draw, shares(np.concatenate((home, stops, home))), 0.0).samples
            log = joined(part, later(further, begin_s, flight.drift_ppb_h))
            made.append(figures(log, truth, job, stops, home, done.length_m))
        return made


def figures(log, truth, job, stops, home, before_m):
    found = decode(measured_of(log, job).measurements, job.model, job.decoder)
    error = centred_relative_error(truth[None], found.values[None])[0]
    way = np.concatenate((home, stops, home))
    return error, found.expected_relative_error, before_m + length_m(stops), before_m + length_m(way)


def measured_of(log, job):
    return measure(log, GRID, job.sensor, altitude_m=ALTITUDE_M)


def later(samples, begin_s, drift_ppb_h):
    """Return the samples of another boot, whose sensor has drifted meanwhile."""
    return replace(
        samples,
        value=samples.value + drift_ppb_h * begin_s / 3600.0,
        unix_s=samples.time_s + begin_s,
        boot=samples.boot + 1,
    )


def joined(one, other):
    rows = {row.name: getattr(one, row.name) for row in fields(one)}
    both = {
        name: np.concatenate((row, getattr(other, name))) for name, row in rows.items() if isinstance(row, np.ndarray)
    }
    return replace(one, **both)


def taken(samples, rows):
    every = {row.name: getattr(samples, row.name) for row in fields(samples)}
    return replace(samples, **{name: row[rows] for name, row in every.items() if isinstance(row, np.ndarray)})


def length_m(stops):
    return CELL_M * float(np.hypot(*np.diff(np.divmod(stops, GRID.shape[1]))).sum())


def shares(stops):
    """Return the middles of cells as shares of the box, east and north."""
    row, column = np.divmod(stops, GRID.shape[1])
    return np.array([(column + 0.5) / GRID.shape[1], 1 - (row + 0.5) / GRID.shape[0]])


if __name__ == "__main__":
    main()
