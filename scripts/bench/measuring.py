#!/usr/bin/env python3
"""How well a flight's samples become measurements: response, noise, faults and drift of simulated flights.

Maps of the built-in field, 2.45 km wide and 60 ppb high, are flown along eight lines with stops, by a slow and noisy
sensor that loses a tenth of its samples. Printed: how far the air, the measured cells and the handed-on measurements
lie from the truth in their own standard deviations (1 is right); how many spikes and a freeze of 60 s are found and how
many good samples are flagged; how a drift is recovered where the lines are flown a second time, across.

    scripts/bench/measuring.py                200 flights of each kind
    scripts/bench/measuring.py --flights 20
"""

from __future__ import annotations

import argparse
import math
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.signal import lfilter

from sparsor.core.streams import stream
from sparsor.core.workers import one_blas_thread
from sparsor.fieldmap.faults import Reason
from sparsor.fieldmap.measuring import measure
from sparsor.flightlog import DroppedSamples, Samples, Sender
from sparsor.geodesy import BoundingBox, Grid
from sparsor.prior.synthetic import synthetic_maps
from sparsor.vehicle import SensorProfile

SIDE_M = 2450.0
FINE = 256  # pixels of the field a side, 8 in each cell
BOX = BoundingBox(51.5, 25.3, 51.5 + SIDE_M / 100_600.0, 25.3 + SIDE_M / 110_780.0)
GRID = Grid(BOX)
STEP_S = 0.1
SPEED_M_S, HOLD_S = 10.0, 5.0
ALTITUDE_M = 50.0


@dataclass(frozen=True)
class Flight:
    """A kind of flight.

    Parameters
    ----------
    t90_s, noise_ppb, drift_ppb_h : float
    across : bool
        Whether the lines are flown a second time, at right angles.
    lines : int
    said_t90_s : float, optional
        What the sensor's profile says instead of the truth.
    faults : bool
        Three spikes of ten standard deviations (at least 15 ppb), and a freeze of 60 s.
    """

    t90_s: float = 30.0
    noise_ppb: float = 3.0
    drift_ppb_h: float = 0.0
    across: bool = False
    lines: int = 8
    said_t90_s: float | None = None
    faults: bool = False


@dataclass(frozen=True)
class Flown:
    """A simulated flight: its samples, and the truth behind them."""

    samples: Samples
    air: np.ndarray
    cells: np.ndarray
    spiked: np.ndarray
    frozen: np.ndarray


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    maps = fields(options.flights)
    with ProcessPoolExecutor(options.workers) as pool:

        def each(task, flight):
            return np.array(list(pool.map(partial(task, flight), range(options.flights), maps, chunksize=5)))

        print_response(each)
        print_faults(each)
        print_drift(each)
        print_doubts(each)


def print_response(each):
    print(
        "| t90 s | noise ppb | air: error, ratio | cells: error, ratio | measurements: ratio | readings as they are |"
    )
    print("|---|---|---|---|---|---|")
    for t90_s, noise in ((0.0, 3.0), (20.0, 1.0), (20.0, 5.0), (30.0, 3.0), (60.0, 3.0)):
        found = each(response_figures, Flight(t90_s, noise))
        air, air_ratio, cell, cell_ratio, row_ratio, raw = np.sqrt(np.mean(np.square(found), axis=0))
        print(
            f"| {t90_s:g} | {noise:g} | {air:.2f} ppb, {air_ratio:.2f} | {cell:.2f} ppb, {cell_ratio:.2f} "
            f"| {row_ratio:.2f} | {raw:.2f} ppb |",
            flush=True,
        )
    print("\nerror: root mean square; ratio: the same of error / stated standard deviation\n")


def print_faults(each):
    print(
        "| t90 s | noise ppb | flights with all spikes found | flights with the freeze found | good samples flagged |"
    )
    print("|---|---|---|---|---|")
    for t90_s, noise in ((0.0, 3.0), (20.0, 1.0), (30.0, 5.0)):
        spikes, freeze, false = each(fault_figures, Flight(t90_s, noise, faults=True)).mean(axis=0)
        print(f"| {t90_s:g} | {noise:g} | {spikes:.1%} | {freeze:.1%} | {false:.3%} |", flush=True)
    print()


def print_drift(each):
    print("| drift ppb/h | noise ppb | route | mean recovered | sd of it | stated sd | error / stated sd | taken off |")
    print("|---|---|---|---|---|---|---|---|")
    for drift, noise, across in ((5, 1, True), (5, 3, True), (0, 3, True), (5, 3, False), (0, 3, False)):
        found = each(drift_figures, Flight(30.0, noise, drift, across))
        told = np.isfinite(found[:, 0])
        rate, sd = found[told, 0], found[told, 1]
        route = "there and across" if across else "lines"
        if told.any():
            figures = (
                f"{rate.mean():.2f} | {rate.std():.2f} | {math.sqrt(np.mean(sd**2)):.2f} "
                f"| {math.sqrt(np.mean(((rate - drift) / sd) ** 2)):.2f}"
            )
        else:
            figures = "no revisits | - | - | -"
        print(f"| {drift} | {noise} | {route} | {figures} | {found[:, 2].mean():.0%} |", flush=True)


def print_doubts(each):
    print("\n| t90 s, true | said | noise ppb | flights in which the t90 is doubted |")
    print("|---|---|---|---|")
    for true, said, noise in ((30, 30, 5), (30, 30, 1), (20, 20, 3), (10, 10, 1), (0, 30, 5), (0, 30, 1), (10, 30, 3)):
        doubted = each(doubt_figures, Flight(float(true), float(noise), said_t90_s=float(said)))
        print(f"| {true} | {said} | {noise} | {doubted.mean():.1%} |", flush=True)


def doubt_figures(flight, number, field):
    return any("change faster" in one for one in measured(flight, number, field)[1].warnings)


def response_figures(flight, number, field):
    flown, found = measured(flight, number, field)
    used = found.used
    air = (found.air - flown.air)[used]
    truth = np.bincount(GRID.cell_at(flown.samples.lon_deg, flown.samples.lat_deg)[used], flown.air[used], GRID.size)
    cell = found.cell_value - truth[found.cells] / found.counts
    rows = found.measurements
    raw = np.bincount(
        GRID.cell_at(flown.samples.lon_deg, flown.samples.lat_deg)[used], flown.samples.value[used], GRID.size
    )
    return (
        rms(air),
        rms(air / found.air_sd[used]),
        rms(cell),
        rms(cell / found.cell_sd),
        rms((rows.values - rows.weights @ flown.cells) / np.sqrt(rows.variance)),
        rms((raw[found.cells] - truth[found.cells]) / found.counts),
    )


def fault_figures(flight, number, field):
    flown, found = measured(flight, number, field)
    spikes = found.reason == Reason.SPIKE
    frozen = found.reason == Reason.FROZEN
    good = ~flown.spiked & ~flown.frozen
    return (
        spikes[flown.spiked].all(),
        frozen[flown.frozen].mean() > 0.9,
        (spikes | frozen)[good].mean(),
    )


def drift_figures(flight, number, field):
    drift = measured(flight, number, field)[1].drift
    return drift.rate_per_h, drift.sd_per_h, drift.applied


def measured(flight, number, field):
    flown = fly(flight, field, stream(2026, number))
    said_s = flight.t90_s if flight.said_t90_s is None else flight.said_t90_s
    profile = SensorProfile(name="simulated", t90_s=said_s, noise_sd=flight.noise_ppb)
    with one_blas_thread():  # the processes share the cores
        return flown, measure(flown.samples, GRID, profile, altitude_m=ALTITUDE_M)


def fields(count):
    """Return fields 60 ppb high, row 0 northmost."""
    maps = synthetic_maps((SIDE_M, SIDE_M), (FINE, FINE), count, 2026, "validation")
    low, high = maps.min(axis=1, keepdims=True), maps.max(axis=1, keepdims=True)
    return (10.0 + 60.0 * (maps - low) / (high - low)).reshape(count, FINE, FINE)


def fly(flight, field, draw, stops=None, hold_s=HOLD_S):
    """Fly over a field: a first-order sensor at a tenth of a second, read once a second, a tenth of it lost."""
    east, north = track(line_stops(flight) if stops is None else stops, hold_s)
    air = map_coordinates(field, [(1 - north) * FINE - 0.5, east * FINE - 0.5], order=1, mode="nearest")
    shown = air
    if flight.t90_s > 0:
        kept = math.exp(-STEP_S * math.log(10.0) / flight.t90_s)
        shown = lfilter([1 - kept], [1, -kept], air, zi=[air[0] * kept])[0]
    rows = np.arange(0, air.size, round(1.0 / STEP_S))
    rows = rows[draw.random(rows.size) >= 0.1]
    time_s = rows * STEP_S
    noise = flight.noise_ppb * draw.standard_normal(rows.size)
    value = shown[rows] + flight.drift_ppb_h * time_s / 3600.0 + noise
    spiked, frozen = np.zeros(rows.size, dtype=bool), np.zeros(rows.size, dtype=bool)
    if flight.faults:
        begin = time_s[-1] * draw.uniform(0.1, 0.8)
        frozen = (time_s > begin) & (time_s <= begin + 60.0)
        value[frozen] = value[np.flatnonzero(frozen)[0] - 1]
        spiked[draw.choice(np.flatnonzero(~frozen), 3, replace=False)] = True
        value[spiked] += max(10 * flight.noise_ppb, 15.0) * draw.choice([-1, 1], 3)
    samples = samples_at(
        time_s, BOX.west_deg + east[rows] * BOX.width_deg, BOX.south_deg + north[rows] * BOX.height_deg, value
    )
    cells = field.reshape(GRID.shape[0], FINE // GRID.shape[0], GRID.shape[1], FINE // GRID.shape[1]).mean((1, 3))
    return Flown(samples, air[rows], cells.ravel(), spiked, frozen)


def line_stops(flight):
    """Return the stops of a flight along lines as shares of the box, east and north."""
    line = (np.arange(flight.lines) + 0.5) / flight.lines
    stops = [(along, across) for k, across in enumerate(line) for along in (line if k % 2 == 0 else line[::-1])]
    if flight.across:
        stops += [(across, along) for along, across in stops[::-1]]
    return np.array(stops).T


def track(stops, hold_s=HOLD_S):
    """Return the way from stop to stop at every `STEP_S` as shares of the box, east and north, with a dwell at each."""
    east, north = stops
    dwell = round(hold_s / STEP_S)
    pieces = []
    for i in range(east.size - 1):
        steps = round(math.hypot(east[i + 1] - east[i], north[i + 1] - north[i]) * SIDE_M / SPEED_M_S / STEP_S)
        share = np.concatenate((np.zeros(dwell), np.arange(steps) / max(steps, 1)))
        pieces.append((east[i] + share * (east[i + 1] - east[i]), north[i] + share * (north[i + 1] - north[i])))
    return np.concatenate(pieces, axis=1)


def samples_at(time_s, lon_deg, lat_deg, value):
    return Samples(
        sensor="NO2",
        sender=Sender(1, 1),
        system=1,
        time_s=time_s,
        lon_deg=lon_deg,
        lat_deg=lat_deg,
        alt_m=np.full(time_s.size, ALTITUDE_M),
        value=value,
        clock=np.full(time_s.size, "vehicle"),
        boot=np.zeros(time_s.size, dtype=np.int64),
        unix_s=np.full(time_s.size, np.nan),
        height_m=np.full(time_s.size, ALTITUDE_M),
        clocks=(),
        track="",
        dropped=DroppedSamples(),
        others=(),
    )


def rms(values):
    return math.sqrt(np.mean(np.square(values)))


if __name__ == "__main__":
    main()
