#!/usr/bin/env python3
"""Sorties over 300 stops: ours against PyVRP alone and two cuts of the route, in minutes used.

The simple cut flies on until the battery says turn back; the best cut is the one that uses least of all.

    scripts/bench/sorties.py [--stops 300] [--seeds 3]

A 3 km box, a quadrotor of 28 usable minutes at 10 m/s, 8 s at each stop, home in the middle of the south side; the
route is nearest neighbour with 2-opt.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from sparsor.mission.sorties import ITERATIONS, SortieCosts, best_sorties, cut_route, routed

SIDE_M, SPEED_M_S, STOP_S, FIXED_S, LIMIT_S = 3000.0, 10.0, 8.0, 70.0, 1680.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stops", type=int, default=300)
    parser.add_argument("--seeds", type=int, default=3)
    asked = parser.parse_args()
    print("| seed | simple cut | best cut | PyVRP alone | ours | sorties | seconds |\n|---|---|---|---|---|---|---|")
    for seed in range(asked.seeds):
        costs = problem(asked.stops, seed)
        cut = cut_route(costs)
        alone = routed(costs, seed=seed, iterations=ITERATIONS, sorties=len(cut) + 1)
        began = time.perf_counter()
        ours = best_sorties(costs, seed=seed)
        took_s = time.perf_counter() - began
        minutes = [f"{costs.total_s(one) / 60:.1f}" if one else "none" for one in (simple(costs), cut, alone, ours)]
        print(f"| {seed} | {' | '.join(minutes)} | {len(ours)} | {took_s:.1f} |")


def simple(costs: SortieCosts) -> list[list[int]]:
    flights: list[list[int]] = []
    for stop in range(costs.count):
        if flights and costs.used_s([*flights[-1], stop]) <= costs.limit_s:
            flights[-1].append(stop)
        else:
            flights.append([stop])
    return flights


def problem(stops: int, seed: int) -> SortieCosts:
    rng = np.random.default_rng(seed)
    places = rng.uniform(0, SIDE_M, (stops, 2))
    apart = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    order = improved(nearest(apart), apart)
    seconds = apart[np.ix_(order, order)] / SPEED_M_S
    ways = np.hypot(*(places[order] - np.array([SIDE_M / 2, 0.0])).T) / SPEED_M_S
    return SortieCosts(seconds, ways, ways, np.full(stops, STOP_S), FIXED_S, LIMIT_S)


def nearest(apart: np.ndarray) -> list[int]:
    order, left = [0], set(range(1, len(apart)))
    while left:
        order.append(min(left, key=lambda other: apart[order[-1], other]))
        left.remove(order[-1])
    return order


def improved(order: list[int], apart: np.ndarray) -> list[int]:
    found = True
    while found:
        found = False
        for first in range(1, len(order) - 2):
            for second in range(first + 1, len(order) - 1):
                a, b, c, d = order[first - 1], order[first], order[second], order[second + 1]
                if apart[a, c] + apart[b, d] < apart[a, b] + apart[c, d] - 1e-9:
                    order[first : second + 1] = order[first : second + 1][::-1]
                    found = True
    return order


if __name__ == "__main__":
    main()
