#!/usr/bin/env python3
"""Time one dask worker against two, and against threads, side by side in one run, and compare what they find.

    scripts/bench/workers.py [--samples 6000] [--moves 120000] [--repeats 3]

Algorithm 1 and the refined search within 10 % of full coverage, on the built-in field's model of 14.7 km. The workers
are processes of this machine with one thread each, started before and warmed up; in the last column one of two is
killed when half of the work is done, and dask starts another one. The fastest of the repeats counts.
"""

from __future__ import annotations

import argparse
import operator
import os
import signal
import time

import psutil

from sparsor.core.progress import silent
from sparsor.core.schedulers import workers_at
from sparsor.core.workers import Threads
from sparsor.design import Budget, Problem, Weights, search, searched_sparsity, unit_legs
from sparsor.design.decoders.covariance import training_covariance
from sparsor.design.refined import Task, refine
from sparsor.prior.builtin import builtin_model

SIDE_M = 14_700.0
ROWS = 35
SHARE = 0.1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=6_000)
    parser.add_argument("--moves", type=int, default=120_000)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    model = builtin_model(SIDE_M)
    legs = unit_legs(model.shape)
    budget = Budget(SHARE * (legs.size - 1), "distance")
    problem = Problem(model.dictionary, model.validation - model.mean, model.lasso_weight, legs, ROWS, budget)
    sparsity = searched_sparsity(budget.stops_within(legs), legs.size, ROWS)
    task = Task(training_covariance(model, legs.allowed), legs, budget)

    def algorithm_1(workers, samples=options.samples, progress=silent):
        found = search(problem, sparsity, Weights(), seed=0, iterations=samples, workers=workers, progress=progress)
        return found.sample, found.stops.tolist()

    def refined(workers, moves=options.moves, progress=silent):
        return refine(task, seed=0, iterations=moves, workers=workers, progress=progress).stops.tolist()

    with workers_at("local", 1) as one, workers_at("local", 2) as two:
        for name, work in (("Algorithm 1", algorithm_1), ("refined search", refined)):
            columns = {"1 thread": Threads(1), "2 threads": Threads(2), "1 worker": one, "2 workers": two}
            for workers in columns.values():
                work(workers, 256)  # compiled, or loaded, now
            report(name, work, columns, options.repeats)


def report(name: str, work, columns, repeats: int) -> None:
    print(f"{name}: seconds with {', '.join(columns)}, 2 workers of which one is killed; then processor seconds of")
    print("  the one worker and of the busier of the two, which do not depend on what else the machine does")
    fastest, found, busy = [float("inf")] * (len(columns) + 1), [], []
    for _ in range(repeats):
        runs, used = [], []
        for workers in columns.values():
            before = processor_seconds(workers)
            runs.append(timed(work, workers))
            used.append(max(map(operator.sub, processor_seconds(workers), before), default=0.0))
        runs.append(timed(work, columns["2 workers"], killing(columns["2 workers"])))
        print(
            "  " + "".join(f"{seconds:9.2f}" for seconds in (*(seconds for seconds, _ in runs), *used[2:])), flush=True
        )
        fastest = [min(pair) for pair in zip(fastest, (seconds for seconds, _ in runs), strict=True)]
        found += [result for _, result in runs]
        busy.append(used[2] / used[3])
    same = "the same" if all(result == found[0] for result in found) else "NOT the same"
    print(f"  two workers against one: {fastest[2] / fastest[3]:.2f} times as fast, by the processors' clocks", end=" ")
    print(f"{sorted(busy)[len(busy) // 2]:.2f} times; the result is {same} in all runs\n")


def processor_seconds(workers) -> list[float]:
    if isinstance(workers, Threads):
        return []
    return [psutil.Process(process).cpu_times().user for process in sorted(workers.processes())]


def timed(work, workers, progress=silent) -> tuple[float, object]:
    start = time.perf_counter()
    result = work(workers, progress=progress)
    return time.perf_counter() - start, result


def killing(workers):
    """Return a progress that kills a worker when half of the work is done."""
    left = [workers.processes()[0]]

    def progress(_task: str, done: int, total: int) -> None:
        if left and done >= total / 2:
            os.kill(left.pop(), signal.SIGKILL)

    return progress


if __name__ == "__main__":
    main()
