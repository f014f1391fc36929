"""From training maps to everything of a model but its lambda."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.errors import ModelError
from sparsor.prior.dictionary import (
    DictionaryName,
    dct_dictionary,
    learned_dictionary,
    polynomial_dictionary,
)
from sparsor.prior.model import Model
from sparsor.prior.statistics import covariance_factor, fit_kernel, shape_covariance
from sparsor.prior.windows import MapSet, ground_windows

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from sparsor.prior.field import Field

DEFAULT_ATOMS = 256
_VALIDATION_SHARE = 0.15
_OVERLAP_COLUMNS = 3  # windows a quarter side apart overlap as far as this
_MOST_VALIDATION = 56  # maps the search scores candidates on: 5 % of the paper's 1120
_FEWEST_MAPS = 8
# Windows a sixteenth of a side apart give up to 13 % less error than a quarter apart, closer ones no less: see
# docs/decisions/0012-refined-search.md.
_DENSE_PER_SIDE = 16
_UNTUNED = 1e-3  # stands in for lambda until it is chosen on the validation maps


@dataclass(frozen=True)
class TrainingMaps:
    """Maps split into training and validation, in the field's unit.

    Parameters
    ----------
    training, validation : array of float64 (n, N)
    shape : tuple of int
    window_m : tuple of float
        East and north extent of a window, metres.
    unit, source : str
    shapes : array of float64 (N, N), optional
        Covariance of shapes (see `shape_covariance`) of more windows than those for training; None: of these.
    """

    training: NDArray[np.float64]
    validation: NDArray[np.float64]
    shape: tuple[int, int]
    window_m: tuple[float, float]
    unit: str
    source: str
    shapes: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        low, high = float(self.training.min()), float(self.training.max())
        if not high > low:
            raise ModelError(f"{self.source}: the training windows hold one value only, {low:g}: nothing to learn")


def maps_of_fields(
    fields: Sequence[Field], sets: Sequence[MapSet], shape: tuple[int, int], progress: Progress = silent
) -> TrainingMaps:
    """Split the windows of fields, and lay more of them for the covariance, none on ground kept for validation.

    Parameters
    ----------
    fields : sequence of Field
    sets : sequence of MapSet
        Windows of each, from `ground_windows`.
    shape : tuple of int
    progress : Progress

    Raises
    ------
    ModelError
        As `split_maps`.
    """
    maps = split_maps(sets, shape)

    def dense() -> Iterator[NDArray[np.float64]]:
        for done, (field, windows) in enumerate(zip(fields, sets, strict=True), start=1):
            west = field.west_of(float(windows.west[windows.column >= _first_held(windows)].min()))
            yield ground_windows(west, *maps.window_m, shape, per_side=_DENSE_PER_SIDE).maps
            progress("learning the covariance", done, len(fields))

    return replace(maps, shapes=shape_covariance(dense()))


def split_maps(sets: Sequence[MapSet], shape: tuple[int, int]) -> TrainingMaps:
    """Split the windows of fields by window column, so that validation windows overlap no training window.

    The eastmost columns, about 15 %, are for validation; the three columns between are left out.

    Raises
    ------
    ModelError
        When the fields differ in unit, or hold too few windows.
    """
    units = sorted({maps.unit for maps in sets})
    if len(units) != 1:
        raise ModelError(f"the fields differ in unit ({', '.join(map(repr, units))}); learn from fields of one unit")
    sizes = sorted({maps.window_m for maps in sets})
    if len(sizes) != 1:
        raise ModelError(f"windows of different sizes, {sizes} m, do not go together; cut all of one size")
    training, validation = [], []
    for maps in sets:
        first = _first_held(maps)
        validation.append(maps.maps[maps.column >= first])
        training.append(maps.maps[maps.column < first - _OVERLAP_COLUMNS])
    held_out, learned_from = np.concatenate(validation), np.concatenate(training)
    if len(learned_from) < _FEWEST_MAPS or not len(held_out):
        raise ModelError(
            f"the field holds {len(learned_from)} training and {len(held_out)} validation windows of "
            f"{sets[0].window_m[0] / 1000:.3g} x {sets[0].window_m[1] / 1000:.3g} km; at least "
            f"{_FEWEST_MAPS} and 1 are needed: take a larger or finer field, several fields, or a smaller box"
        )
    spread = np.linspace(0, len(held_out) - 1, min(_MOST_VALIDATION, len(held_out))).round().astype(int)
    source = "; ".join(maps.source for maps in sets)
    return TrainingMaps(learned_from, held_out[spread], shape, sets[0].window_m, units[0], source)


def _first_held(maps: MapSet) -> int:
    """Return the first window column kept for validation."""
    columns = int(maps.column.max()) + 1
    return columns - max(1, round(_VALIDATION_SHARE * columns))


def with_mirror_images(maps: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.float64]:
    """Return maps with their mirror images east-west, north-south and both ways, (4 n, N).

    A field that gives few windows says as much mirrored; without them a dictionary could only repeat it.
    """
    cube = maps.reshape(-1, *shape)
    images = (cube, cube[:, :, ::-1], cube[:, ::-1], cube[:, ::-1, ::-1])
    return np.concatenate([image.reshape(maps.shape) for image in images])


def untuned_model(
    maps: TrainingMaps,
    *,
    atoms: int = DEFAULT_ATOMS,
    centred: bool = True,
    dictionary: DictionaryName = "learned",
    seed: int = 0,
    provenance: Mapping[str, str] | None = None,
    progress: Progress = silent,
) -> Model:
    """Learn a model from maps; its lambda is a stand-in until `design` chooses one.

    Parameters
    ----------
    maps : TrainingMaps
    atoms : int
        K.
    centred : bool
        Whether the training mean is taken off.
    dictionary : {"learned", "dct", "polynomial"}
    seed : int
    provenance : mapping of str to str, optional
        Added to what is known here.
    progress : Progress

    Raises
    ------
    ModelError
        When the maps have no contrast, or the number of atoms is out of range.
    """
    low, high = float(maps.training.min()), float(maps.training.max())
    training, validation = ((part - low) / (high - low) for part in (maps.training, maps.validation))
    if not (np.ptp(validation, axis=1) > 0).any():
        raise ModelError(f"{maps.source}: the validation windows have no contrast: nothing can be judged on them")
    windows = len(training)
    if windows < atoms:
        training = with_mirror_images(training, maps.shape)
    mean = training.mean(axis=0) if centred else np.zeros(training.shape[1])
    if dictionary == "learned":
        psi = learned_dictionary(training - mean, atoms, seed=seed, progress=progress)
    else:
        make = dct_dictionary if dictionary == "dct" else polynomial_dictionary
        psi = make(maps.shape, atoms)
    about = {
        "source": maps.source,
        "dictionary": dictionary,
        "training_maps": str(windows),
        "mirror_images": str(len(training) - windows),
        "validation_maps": str(len(validation)),
        "seed": str(seed),
    }
    return Model(
        shape=maps.shape,
        dictionary=psi,
        mean=mean,
        covariance_factor=covariance_factor(shape_covariance([training]) if maps.shapes is None else maps.shapes),
        kernel=fit_kernel(training, maps.shape),
        lasso_weight=_UNTUNED,
        validation=validation,
        scale=(low, high),
        unit=maps.unit,
        window_m=maps.window_m,
        provenance={**about, **(provenance or {})},
    )
