"""The protocol by which every figure is reported: maps, splits, scale (method.md, Protocol)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.streams import stream
from sparsor.errors import InputError
from sparsor.prior.resampling import resample_bilinear
from sparsor.prior.windows import MapSet, pixel_windows

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from sparsor.prior.field import Field

PAPER_PIXELS = (994, 1390)
WINDOW, STRIDE, FACTOR = 128, 32, 4
DENSE_STRIDE = 8  # of the windows that a covariance is learned from: a sixteenth of a side
OVERLAP_NOTE = (
    "random split: neighbouring windows overlap by 75 %, so test maps have near-twins in training; "
    "the paper's protocol, not the accuracy to expect"
)

# Window columns of each fold as (test, validation, training); three columns are dropped between sets that
# would touch, because windows up to three columns apart overlap.
BLOCKED_FOLDS = (
    ((0, 12), ((36, 39),), ((16, 32),)),
    ((13, 26), ((36, 39),), ((0, 9), (30, 32))),
    ((27, 39), ((0, 3),), ((7, 23),)),
)


@dataclass(frozen=True)
class Split:
    """Indices of the maps of each set.

    Parameters
    ----------
    training, validation, test : array of int64
    name : str
        Of the protocol, with fold or seed.
    """

    training: NDArray[np.int64]
    validation: NDArray[np.int64]
    test: NDArray[np.int64]
    name: str


@dataclass(frozen=True)
class SplitMaps:
    """The maps of a split on the 0..1 scale of the training windows.

    Parameters
    ----------
    training, validation, test : array of float64 (n, N)
    scale : tuple of float
        Values that 0 and 1 stand for, in the field's unit.
    """

    training: NDArray[np.float64]
    validation: NDArray[np.float64]
    test: NDArray[np.float64]
    scale: tuple[float, float]


def study_maps(field: Field, pixels: tuple[int, int] | None = PAPER_PIXELS) -> MapSet:
    """Return the windows of a field as the paper cuts them.

    Parameters
    ----------
    field : Field
    pixels : tuple of int, optional
        Rows and columns it is first resampled to (bilinear); None keeps the native pixels.
    """
    values = _pixels(field, pixels)
    return pixel_windows(values, window=WINDOW, stride=STRIDE, factor=FACTOR, unit=field.unit, source=field.source)


def dense_maps(
    field: Field, fold: int, pixels: tuple[int, int] | None = PAPER_PIXELS, *, validation: bool = False
) -> Iterator[NDArray[np.float64]]:
    """Yield maps of windows `DENSE_STRIDE` apart, on the ground of a blocked fold's training windows alone.

    Parameters
    ----------
    field : Field
    fold : int
    pixels : tuple of int, optional
        As for `study_maps`.
    validation : bool
        Whether the ground of the validation windows is taken too, for a final model.
    """
    values = _pixels(field, pixels)
    _, held, training = BLOCKED_FOLDS[fold]
    for first, last in (*training, *held) if validation else training:
        ground = values[:, STRIDE * first : STRIDE * last + WINDOW]
        yield pixel_windows(ground, window=WINDOW, stride=DENSE_STRIDE, factor=FACTOR, source=field.source).maps


def _pixels(field: Field, pixels: tuple[int, int] | None) -> NDArray[np.float64]:
    return field.in_memory if pixels is None else resample_bilinear(field.in_memory, pixels)


def random_split(maps: MapSet, seed: int) -> Split:
    """Return the paper's split: 70 % training, 5 % validation, 25 % test, at random (see `OVERLAP_NOTE`)."""
    order = stream(seed).permutation(len(maps.maps))
    first, second = round(0.70 * order.size), round(0.75 * order.size)
    return Split(order[:first], order[first:second], order[second:], f"random, seed {seed}")


def blocked_split(maps: MapSet, fold: int) -> Split:
    """Return one of the three blocked folds: no test window overlaps one of training or validation.

    Raises
    ------
    InputError
        When the fold is not 0, 1 or 2, or the maps are not of 40 window columns.
    """
    if not 0 <= fold < len(BLOCKED_FOLDS):
        raise InputError(f"fold is {fold}; the blocked protocol has folds 0..{len(BLOCKED_FOLDS) - 1}")
    if (columns := int(maps.column.max()) + 1) != 40:
        raise InputError(
            "the blocked protocol is made for the 40 window columns of a raster of "
            f"{PAPER_PIXELS[1]} pixels; there are {columns}"
        )
    test, validation, training = BLOCKED_FOLDS[fold]
    return Split(
        _in_columns(maps.column, training),
        _in_columns(maps.column, validation),
        _in_columns(maps.column, (test,)),
        f"blocked, fold {fold}",
    )


def scaled(maps: MapSet, split: Split) -> SplitMaps:
    """Return the sets of a split, scaled by the least and largest value of the training windows."""
    training = maps.maps[split.training]
    low, high = float(training.min()), float(training.max())
    if not high > low:
        raise InputError(f"{maps.source}: the training windows hold one value only, {low:g}: there is no scale")

    def on_scale(index: NDArray[np.int64]) -> NDArray[np.float64]:
        return (maps.maps[index] - low) / (high - low)

    return SplitMaps(on_scale(split.training), on_scale(split.validation), on_scale(split.test), (low, high))


def _in_columns(column: NDArray[np.int64], bands: tuple[tuple[int, int], ...]) -> NDArray[np.int64]:
    inside = np.zeros(column.shape, dtype=np.bool_)
    for first, last in bands:
        inside |= (column >= first) & (column <= last)
    return np.flatnonzero(inside)
