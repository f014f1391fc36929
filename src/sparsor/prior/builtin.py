"""The built-in models of the synthetic Gulf field, one a ground size."""

from __future__ import annotations

from importlib import resources
from typing import TYPE_CHECKING

import numpy as np

from sparsor.prior.learning import TrainingMaps
from sparsor.prior.model import Model, read_model
from sparsor.prior.synthetic import UNIT, synthetic_maps

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

# Sides of the square windows, a factor of 2.45 apart: no box from 1 to 1300 km is further than 1.57 from one.
SIDES_M = (1_000.0, 2_450.0, 6_010.0, 14_700.0, 36_100.0, 88_400.0, 217_000.0, 531_000.0, 1_300_000.0)
SHAPE = (32, 32)
TRAINING_MAPS, VALIDATION_MAPS = 1120, 56
SEED = 2026


def nearest_side_m(east_m: float, north_m: float) -> float:
    """Return the side of the built-in windows nearest in size to a box, metres.

    Examples
    --------
    >>> nearest_side_m(3_000, 3_300)
    2450.0
    """
    sides = np.array(SIDES_M)
    return float(sides[np.argmin(np.abs(np.log(sides / np.sqrt(east_m * north_m))))])


def builtin_model(side_m: float) -> Model:
    """Return the packaged model of windows of one of `SIDES_M`."""
    with resources.as_file(_file(side_m)) as path:
        return read_model(path)


def builtin_maps(side_m: float) -> TrainingMaps:
    """Draw the maps that the built-in model of one size is learned from."""
    side = (side_m, side_m)
    training = synthetic_maps(side, SHAPE, TRAINING_MAPS, SEED, "training")
    validation = synthetic_maps(side, SHAPE, VALIDATION_MAPS, SEED, "validation")
    return TrainingMaps(training, validation, SHAPE, (side_m, side_m), UNIT, f"synthetic Gulf NO2 field, seed {SEED}")


def file_name(side_m: float) -> str:
    """Return the name of a packaged model's file."""
    return f"gulf-{side_m / 1000:g}km.npz"


def _file(side_m: float) -> Traversable:
    return resources.files("sparsor.prior") / "models" / file_name(side_m)
