"""A small field, and a case of it, for the study's tests."""

from __future__ import annotations

import numpy as np
import pytest

from sparsor.prior.field import Field
from sparsor.study import study_maps
from sparsor.study.cases import random_case


@pytest.fixture(scope="session")
def field():
    """A field of waves and blobs with 2 x 40 windows of the protocol, cut without resampling."""
    rng = np.random.default_rng(5)
    down, across = np.mgrid[0:160, 0:1390]
    values = np.zeros(down.shape)
    for row, column, width in zip(
        rng.uniform(0, 160, 90), rng.uniform(0, 1390, 90), rng.uniform(9, 30, 90), strict=True
    ):
        values += rng.uniform(0.3, 1.0) * np.exp(-((down - row) ** 2 + (across - column) ** 2) / (2 * width**2))
    return Field(values, 45 + 0.01 * np.arange(1390), 30 - 0.01 * np.arange(160), "ppb", "made")


@pytest.fixture(scope="session")
def maps(field):
    return study_maps(field, None)


@pytest.fixture(scope="session")
def case(maps):
    return random_case(maps, 0)
