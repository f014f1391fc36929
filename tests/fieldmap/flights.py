"""Simulated flights over a field that is known, for the tests of what is measured."""

from __future__ import annotations

import math

import numpy as np

from sparsor.flightlog import DroppedSamples, Samples, Sender
from sparsor.geodesy import BoundingBox, Grid
from sparsor.geodesy.lengths import offset_deg
from sparsor.vehicle import SensorProfile

SIDE_M = 1600.0  # cells of 50 m
CORNER = (51.5, 25.3)
_NORTH_EAST = tuple(float(side) for side in offset_deg(*CORNER, SIDE_M, SIDE_M))
GRID = Grid(BoundingBox(*CORNER, *_NORTH_EAST))
TAU_PER_T90 = 1 / math.log(10)


def profile(**changes):
    return SensorProfile(**{"name": "simulated", "t90_s": 0.0, "noise_sd": 2.0} | changes)


def field(east, north):
    """A smooth field over shares of the box, 10 to 70 ppb."""
    return 40 + 20 * np.sin(3 * east + 1) * np.cos(2 * north) + 10 * np.sin(5 * north * east)


def lines(count=6, *, step_m=8.0, across=False):
    """The way along lines as shares of the box, east and north, one row a second at 8 m/s."""
    share = (np.arange(count) + 0.37) / count
    corners = [(end, one) for k, one in enumerate(share) for end in ((0.05, 0.95) if k % 2 == 0 else (0.95, 0.05))]
    if across:
        corners += [(one, end) for end, one in corners[::-1]]
    corners = np.array(corners)
    way = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T)))) * SIDE_M
    at = np.arange(0, way[-1], step_m)
    return np.interp(at, way, corners[:, 0]), np.interp(at, way, corners[:, 1])


def shown(air, t90_s, interval_s=1.0):
    """What a first-order sensor shows of air that is linear between samples, from a steady beginning."""
    if t90_s == 0:
        return air.copy()
    ratio = interval_s / (t90_s * TAU_PER_T90)
    kept, ramp = math.exp(-ratio), -math.expm1(-ratio) / ratio
    out = air.copy()
    for i in range(1, air.size):
        out[i] = kept * out[i - 1] + (ramp - kept) * air[i - 1] + (1 - ramp) * air[i]
    return out


def samples_at(east, north, value, *, time_s=None, height_m=50.0, boot=0, unix_s=np.nan):
    """Samples at places given as shares of the box."""
    n = np.size(value)
    box = GRID.box

    def row(one):
        return np.broadcast_to(np.asarray(one, dtype=np.float64), n).copy()

    return Samples(
        sensor="NO2",
        sender=Sender(1, 1),
        system=1,
        time_s=np.arange(n, dtype=np.float64) if time_s is None else time_s,
        lon_deg=box.west_deg + row(east) * box.width_deg,
        lat_deg=box.south_deg + row(north) * box.height_deg,
        alt_m=row(height_m) + 10.0,
        value=row(value),
        clock=np.full(n, "vehicle"),
        boot=np.broadcast_to(np.asarray(boot, dtype=np.int64), n).copy(),
        unix_s=row(unix_s),
        height_m=row(height_m),
        clocks=(),
        track="GLOBAL_POSITION_INT",
        dropped=DroppedSamples(),
        others=(),
    )


def flight(seed, *, t90_s=0.0, noise=2.0, drift_ppb_h=0.0, across=False, keep=1.0):
    """Samples of a flight along lines, and the air at each."""
    draw = np.random.default_rng(seed)
    east, north = lines(across=across)
    air = field(east, north)
    time_s = np.arange(air.size, dtype=np.float64)
    value = shown(air, t90_s) + noise * draw.standard_normal(air.size) + drift_ppb_h * time_s / 3600
    kept = draw.random(air.size) < keep
    return samples_at(east[kept], north[kept], value[kept], time_s=time_s[kept]), air[kept]
