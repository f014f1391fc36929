"""A split of a field's maps with all that decoders and planners may learn from it: training and validation, no test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.design.decoders.covariance import contrasts, with_symmetries
from sparsor.prior.dictionary import learned_dictionary
from sparsor.prior.statistics import shape_covariance
from sparsor.study.protocol import (
    PAPER_PIXELS,
    SplitMaps,
    blocked_split,
    dense_maps,
    random_split,
    scaled,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from sparsor.prior.field import Field
    from sparsor.prior.windows import MapSet

Covariances = dict[str, "NDArray[np.float64]"]


@dataclass(frozen=True)
class Case:
    """One split and what is learned from it.

    Parameters
    ----------
    name : str
        Of the split.
    shape : tuple of int
    sets : SplitMaps
    training : dict of str to array of float64 (N, N)
        Covariances of the training maps, by name: of their shapes, and of the maps as they are.
    final : dict of str to array of float64 (N, N)
        The same of training and validation maps together, for the test maps once all is chosen.
    """

    name: str
    shape: tuple[int, int]
    sets: SplitMaps
    training: Covariances
    final: Covariances

    @property
    def typical_variance(self) -> float:
        """Mean variance of a training map around its own mean, on the square of the 0..1 scale."""
        return float(self.sets.training.var(axis=1).mean())

    @property
    def mean(self) -> NDArray[np.float64]:
        """Mean of the training maps, (N,)."""
        return np.asarray(self.sets.training.mean(axis=0))

    def dictionary(self, atoms: int, seed: int) -> NDArray[np.float64]:
        """Learn a dictionary from the training maps less their mean, (N, K)."""
        return learned_dictionary(self.sets.training - self.mean, atoms, seed=seed)


def blocked_case(maps: MapSet, field: Field, fold: int, pixels: tuple[int, int] | None = PAPER_PIXELS) -> Case:
    """Return a fold of the blocked protocol; covariances are of windows laid densely on the training ground.

    Parameters
    ----------
    maps : MapSet
        The field's `study_maps`.
    field : Field
    fold : int
    pixels : tuple of int, optional
        As the maps were cut.
    """
    split = blocked_split(maps, fold)
    sets = scaled(maps, split)
    shapes = [dense_maps(field, fold, pixels, validation=more) for more in (False, True)]
    return _case(split.name, sets, shapes)


def random_case(maps: MapSet, seed: int) -> Case:
    """Return a split of the paper's random protocol; see `OVERLAP_NOTE` before any figure of it is believed."""
    split = random_split(maps, seed)
    sets = scaled(maps, split)
    return _case(split.name, sets, [[sets.training], [sets.training, sets.validation]])


def _case(name: str, sets: SplitMaps, shapes: Sequence[Iterable[NDArray[np.float64]]]) -> Case:
    side = round(sets.training.shape[1] ** 0.5)
    shape = (side, side)
    both = np.concatenate([sets.training, sets.validation])
    training, final = (
        _covariances(maps, laid, shape) for maps, laid in zip((sets.training, both), shapes, strict=True)
    )
    return Case(name, shape, sets, training, final)


def _covariances(
    maps: NDArray[np.float64], shapes: Iterable[NDArray[np.float64]], shape: tuple[int, int]
) -> Covariances:
    everywhere = np.ones(maps.shape[1], dtype=np.bool_)
    off = maps - maps.mean(axis=0)
    return {
        "shapes": contrasts(with_symmetries(shape_covariance(shapes), shape), everywhere),
        "maps": contrasts(with_symmetries(off.T @ off, shape), everywhere),
    }
