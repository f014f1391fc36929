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
from sparsor.prior.reservoir import Reservoir
from sparsor.prior.statistics import ShapeCovariance, covariance_factor, fit_kernel, shape_covariance
from sparsor.prior.windows import MapSet, ground_windows

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from numpy.typing import NDArray

    from sparsor.prior.field import Field

DEFAULT_ATOMS = 256
_VALIDATION_SHARE = 0.15
_OVERLAP_COLUMNS = 3  # windows a quarter side apart overlap as far as this
_MOST_VALIDATION = 56  # maps the search scores candidates on: 5 % of the paper's 1120
_FEWEST_MAPS = 8
MOST_TRAINING = 8192  # as many as one field gives: 64 MB
_MOST_HELD = 2048  # validation windows from which the 56 are taken
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
    extremes : tuple of float, optional
        Least and largest value of all training windows, where `training` is a sample of them; None: of these.
    windows : int, optional
        How many training windows there were, where `training` is a sample of them.
    """

    training: NDArray[np.float64]
    validation: NDArray[np.float64]
    shape: tuple[int, int]
    window_m: tuple[float, float]
    unit: str
    source: str
    shapes: NDArray[np.float64] | None = None
    extremes: tuple[float, float] | None = None
    windows: int | None = None

    def __post_init__(self) -> None:
        low, high = self.span
        if not high > low:
            raise ModelError(f"{self.source}: the training windows hold one value only, {low:g}: nothing to learn")

    @property
    def span(self) -> tuple[float, float]:
        """Least and largest value of the training windows."""
        return self.extremes or (float(self.training.min()), float(self.training.max()))


def maps_of_fields(
    fields: Iterable[tuple[Field, MapSet]], shape: tuple[int, int], progress: Progress = silent, count: int = 1
) -> TrainingMaps:
    """Split the windows of fields, and lay more of them for the covariance, none on ground kept for validation.

    Parameters
    ----------
    fields : iterable of (Field, MapSet)
        Fields and windows of each, from `ground_windows`. Taken one by one: what is kept of them is bounded.
    shape : tuple of int
    progress : Progress
    count : int
        How many fields there are, for the progress.

    Raises
    ------
    ModelError
        As `split_maps`.
    """
    covariance = ShapeCovariance()

    def windows_of_each() -> Iterator[MapSet]:
        for done, (field, windows) in enumerate(fields, start=1):
            yield windows
            west = field.west_of(float(windows.west[windows.column >= _first_held(windows)].min()))
            covariance.add(ground_windows(west, *windows.window_m, shape, per_side=_DENSE_PER_SIDE).maps)
            progress("learning the covariance", done, count)

    maps = split_maps(windows_of_each(), shape)
    # Without any contrast the training maps have none either, and what is learned from them says so.
    return replace(maps, shapes=covariance.value() if covariance.known else None)


def split_maps(sets: Iterable[MapSet], shape: tuple[int, int]) -> TrainingMaps:
    """Split the windows of fields by window column, so that validation windows overlap no training window.

    The eastmost columns, about 15 %, are for validation; the three columns between are left out. Of more than
    `MOST_TRAINING` training windows as many are kept, chosen evenly.

    Raises
    ------
    ModelError
        When the fields differ in unit, or hold too few windows.
    """
    cells = shape[0] * shape[1]
    training, validation = Reservoir(MOST_TRAINING, cells, 0), Reservoir(_MOST_HELD, cells, 1)
    units: set[str] = set()
    sizes: set[tuple[float, float]] = set()
    sources = []
    low, high = np.inf, -np.inf
    for maps in sets:
        units.add(maps.unit)
        sizes.add(maps.window_m)
        _check_alike(units, sizes)
        first = _first_held(maps)
        validation.add(maps.maps[maps.column >= first])
        learned_from = maps.maps[maps.column < first - _OVERLAP_COLUMNS]
        training.add(learned_from)
        low, high = learned_from.min(initial=low), learned_from.max(initial=high)
        sources.append(maps.source)
    ((unit,), (window_m,)) = units, sizes
    if training.seen < _FEWEST_MAPS or not validation.seen:
        raise ModelError(
            f"the field holds {training.seen} training and {validation.seen} validation windows of "
            f"{window_m[0] / 1000:.3g} x {window_m[1] / 1000:.3g} km; at least "
            f"{_FEWEST_MAPS} and 1 are needed: take a larger or finer field, several fields, or a smaller box"
        )
    held_out = validation.maps
    spread = np.linspace(0, len(held_out) - 1, min(_MOST_VALIDATION, len(held_out))).round().astype(int)
    parts = TrainingMaps(training.maps, held_out[spread], shape, window_m, unit, "; ".join(sources))
    if training.seen == len(training.maps):
        return parts
    return replace(parts, extremes=(float(low), float(high)), windows=training.seen)


def _check_alike(units: set[str], sizes: set[tuple[float, float]]) -> None:
    if len(units) != 1:
        named = ", ".join(map(repr, sorted(units)))
        raise ModelError(f"the fields differ in unit ({named}); learn from fields of one unit")
    if len(sizes) != 1:
        raise ModelError(f"windows of different sizes, {sorted(sizes)} m, do not go together; cut all of one size")


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
    low, high = maps.span
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
    if maps.windows is not None:
        about["training_windows"] = str(maps.windows)
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
