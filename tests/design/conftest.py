"""A small learned problem that every test of the design stage can use."""

from __future__ import annotations

import numpy as np
import pytest

from sparsor.design import LegTable, Problem, unit_legs
from sparsor.prior.dictionary import learned_dictionary

SHAPE = (10, 12)


def smooth_maps(rng: np.random.Generator, count: int, shape: tuple[int, int] = SHAPE) -> np.ndarray:
    """Random sums of Gaussian bumps on the 0..1 scale, one a row."""
    row, column = np.indices(shape)
    maps = np.zeros((count, *shape))
    for _ in range(3):
        at_row, at_column = rng.uniform(0, shape[0], count), rng.uniform(0, shape[1], count)
        width, height = rng.uniform(1.5, 5, count), rng.uniform(0.2, 1, count)
        off = (row - at_row[:, None, None]) ** 2 + (column - at_column[:, None, None]) ** 2
        maps += height[:, None, None] * np.exp(-off / (2 * width[:, None, None] ** 2))
    flat = maps.reshape(count, -1)
    return flat / flat.max()


@pytest.fixture(scope="session")
def legs() -> LegTable:
    return unit_legs(SHAPE)


@pytest.fixture(scope="session")
def problem(legs: LegTable) -> Problem:
    rng = np.random.default_rng(7)
    training, validation = smooth_maps(rng, 120), smooth_maps(rng, 9)
    mean = training.mean(axis=0)
    psi = learned_dictionary(training - mean, 40, seed=1)
    return Problem(psi, validation - mean, 1e-3, legs, rows=12)
