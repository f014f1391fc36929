"""A small model and maps that it has not seen."""

from __future__ import annotations

import numpy as np
import pytest

from design.conftest import SHAPE, smooth_maps
from sparsor.prior.learning import TrainingMaps, untuned_model


@pytest.fixture(scope="session")
def model():
    rng = np.random.default_rng(11)
    maps = TrainingMaps(smooth_maps(rng, 200), smooth_maps(rng, 40), SHAPE, (1.0, 1.0), "ppb", "bumps")
    return untuned_model(maps, atoms=60)


@pytest.fixture(scope="session")
def fresh(model):
    low, high = model.scale
    return (smooth_maps(np.random.default_rng(12), 30) - low) / (high - low)
