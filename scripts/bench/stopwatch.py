"""How long work takes, for the benchmarks."""

from __future__ import annotations

import time


def fastest(work, repeats: int):
    """Return the least seconds of several runs, and what the last one returned."""
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - start)
    return min(seconds), result
