"""Which model a mission is planned with: built in, learned from a field, or a file."""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.files import sha256_of, write_file
from sparsor.core.metrics import centred_relative_error
from sparsor.core.progress import Progress, silent
from sparsor.core.workers import Workers, one_blas_thread
from sparsor.design import unit_legs
from sparsor.design.lars import lasso
from sparsor.design.tuning import choose_lasso_weight
from sparsor.errors import ModelError, OutputError
from sparsor.prior.archive import FieldFile, maps_of_files
from sparsor.prior.builtin import (
    SEED,
    SHAPE,
    TRAINING_MAPS,
    VALIDATION_MAPS,
    builtin_maps,
    builtin_model,
    nearest_side_m,
)
from sparsor.prior.learning import DEFAULT_ATOMS, TrainingMaps, untuned_model
from sparsor.prior.mismatch import mismatch_factor
from sparsor.prior.model import Model, arrays_to_npz, model_arrays, model_from_npz, read_model
from sparsor.prior.resampling import sample_at
from sparsor.prior.synthetic import covers
from sparsor.prior.windows import nearest_resolved_m

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from sparsor.geodesy import BoundingBox
    from sparsor.mission.specification import PriorSection
    from sparsor.prior.dictionary import DictionaryName
    from sparsor.prior.field import Field

# Bumped whenever learning gives other models, so that cached ones are not taken for them.
_LEARNING_VERSION = 3
_SAME_SIZE = 1.02
_BETWEEN_SIDES = 1.6  # no box between the built-in sizes is further from one than this


@dataclass(frozen=True)
class PriorChoice:
    """A model for a box, and what has to be said about it.

    Parameters
    ----------
    model : Model
    field : Field or None
        What it was learned from, when that is at hand.
    synthetic : bool
        Whether the model is the built-in one.
    widening : float
        Factor, 1 or above, on the expected error where the model's windows are not of the box's size.
    warnings : tuple of str
    """

    model: Model
    field: Field | None
    synthetic: bool
    widening: float
    warnings: tuple[str, ...]


def choose_prior(
    request: PriorSection,
    box: BoundingBox,
    *,
    paper: bool = False,
    workers: Workers | int = 1,
    progress: Progress = silent,
) -> PriorChoice:
    """Return the model that a mission over `box` is planned with.

    Parameters
    ----------
    request : PriorSection
    box : BoundingBox
    paper : bool
        The paper's dictionary: as many atoms as cells, learned without centring.
    workers : Workers or int
        Who learns; a number is one of threads.
    progress : Progress

    Raises
    ------
    FieldError, ModelError
        When the field or model cannot be used, or a model does not hold the dictionary asked for.
    """
    if request.model is not None:
        return _from_file(request, box, paper=paper)
    atoms = request.atoms or (SHAPE[0] * SHAPE[1] if paper else DEFAULT_ATOMS)
    if request.field is None:
        return _built_in(box, atoms, paper=paper, workers=workers, progress=progress)
    return _from_field(request, box, atoms, paper=paper, workers=workers, progress=progress)


def learn_model(
    maps: TrainingMaps,
    *,
    atoms: int = DEFAULT_ATOMS,
    centred: bool = True,
    dictionary: DictionaryName = "learned",
    seed: int = 0,
    workers: Workers | int = 1,
    progress: Progress = silent,
) -> Model:
    """Learn a model from maps and choose its lambda on the validation maps.

    What the workers share is the choice of lambda; the dictionary is learned in one go, batch after batch.

    Raises
    ------
    ModelError
        When the maps have no contrast, or the number of atoms is out of range.
    """
    with one_blas_thread():
        model = untuned_model(maps, atoms=atoms, centred=centred, dictionary=dictionary, seed=seed, progress=progress)
    weight = choose_lasso_weight(
        model.dictionary,
        model.validation - model.mean,
        unit_legs(model.shape),
        seed=seed,
        workers=workers,
        progress=progress,
    )
    return replace(model, lasso_weight=weight)


def representation_error(model: Model) -> float:
    """Return how well the dictionary represents validation maps that are wholly known.

    Mean of ``|s - s_hat| / |s - mean(s)|`` with each map coded by the LASSO over all its cells, at the
    model's lambda: what is left when nothing but the dictionary limits the reconstruction.
    """
    coded = lasso(model.dictionary, model.validation - model.mean, model.lasso_weight)
    return float(np.nanmean(centred_relative_error(model.validation, coded @ model.dictionary.T + model.mean)))


def with_sources(model: Model, sources: Mapping[Path, str]) -> Model:
    """Return a model that names the files it was learned from: by name and contents, not by where they lay."""
    names = [
        f"{source.replace(str(path), path.name)}, sha256 {sha256_of(path)[:16]}" for path, source in sources.items()
    ]
    return replace(model, provenance={**model.provenance, "source": "; ".join(names)})


def cache_folder() -> Path:
    """Return the folder for models learned on the way: ``SPARSOR_CACHE_DIR``, else the user's cache."""
    if given := os.environ.get("SPARSOR_CACHE_DIR"):
        return Path(given)
    from platformdirs import user_cache_path

    return user_cache_path("sparsor", appauthor=False)


def _from_file(request: PriorSection, box: BoundingBox, *, paper: bool) -> PriorChoice:
    path = request.model
    assert path is not None
    model = read_model(path)
    cells = model.shape[0] * model.shape[1]
    if request.atoms is not None and request.atoms != model.atoms:
        raise ModelError(
            f"'{path}' holds {model.atoms} atoms, --atoms asks for {request.atoms}: leave --atoms out, or "
            "learn a model with that many ('sparsor learn --atoms')"
        )
    if paper and (model.centred or model.atoms != cells):
        raise ModelError(
            f"--paper needs an uncentred dictionary of {cells} atoms; '{path}' holds "
            f"{'a centred' if model.centred else 'an uncentred'} one of {model.atoms}: learn it with "
            f"'sparsor learn --uncentred --atoms {cells}', or leave --model out"
        )
    widening, said = size_difference(model, box)
    return PriorChoice(model, None, False, widening, said)


def _built_in(box: BoundingBox, atoms: int, *, paper: bool, workers: Workers | int, progress: Progress) -> PriorChoice:
    side = nearest_side_m(box.east_m, box.north_m)
    if atoms == DEFAULT_ATOMS and not paper:
        model = builtin_model(side)
    else:
        key = {"built-in": [side, SEED, TRAINING_MAPS, VALIDATION_MAPS], "atoms": atoms, "centred": not paper}
        model = _cached(
            key,
            lambda: learn_model(builtin_maps(side), atoms=atoms, centred=not paper, workers=workers, progress=progress),
        )
    warnings = ["The prior is the built-in synthetic Gulf NO2 field, not a measurement: give --field or --model."]
    if not covers(box.as_tuple()):
        warnings.append(
            f"The built-in field is the Gulf's, the box lies at {box.centre_lon_deg:.4g} E, {box.centre_lat_deg:.4g} N "
            "(are longitude and latitude swapped? The order is west south east north)."
        )
    widening, said = size_difference(model, box, said_from=_BETWEEN_SIDES)
    return PriorChoice(model, None, True, widening, (*warnings, *said))


def _from_field(
    request: PriorSection, box: BoundingBox, atoms: int, *, paper: bool, workers: Workers | int, progress: Progress
) -> PriorChoice:
    assert request.field is not None
    file = FieldFile(
        request.field,
        request.variable,
        request.time,
        request.field_bbox,
        request.field_colormap,
        request.field_range,
    )
    field = file.first()
    window_m = nearest_resolved_m(field, box.east_m, box.north_m, SHAPE)
    key = {
        **request.model_dump(mode="json", exclude={"field", "model"}),
        "field": sha256_of(request.field),
        "window_m": [round(side, 3) for side in window_m],
        "atoms": atoms,
        "centred": not paper,
    }

    def learn() -> Model:
        maps, _ = maps_of_files([file], window_m, SHAPE, progress)
        return learn_model(maps, atoms=atoms, centred=not paper, workers=workers, progress=progress)

    model = _cached(key, learn)
    model = with_sources(model, {request.field: file.source(field)})
    widening, said = size_difference(model, box)
    notes = [*field.notes, *said]
    if not np.isfinite(sample_at(field, box.centre_lon_deg, box.centre_lat_deg)):
        notes.append(
            "The middle of the box lies outside the field, or in a gap of it: maps there are taken to look alike."
        )
    if model.atoms < atoms:
        notes.append(
            f"The field gave {model.provenance['training_maps']} training windows, so the dictionary has "
            f"{model.atoms} atoms, not {atoms}."
        )
    return PriorChoice(model, field, False, widening, tuple(notes))


def size_difference(model: Model, box: BoundingBox, *, said_from: float = _SAME_SIZE) -> tuple[float, tuple[str, ...]]:
    """Return the factor on the expected error, and the sentence for windows `said_from` times off or more."""
    east_m, north_m = model.window_m
    ratio = max(east_m / box.east_m, box.east_m / east_m, north_m / box.north_m, box.north_m / north_m)
    widening = mismatch_factor(ratio)
    if ratio <= said_from:
        return widening, ()
    sentence = (
        f"The model was learned from windows of {east_m / 1000:.4g} x {north_m / 1000:.4g} km, the box is "
        f"{box.east_m / 1000:.4g} x {box.north_m / 1000:.4g} km: the expected error is widened "
        f"{widening:.2f} times."
    )
    return widening, (sentence,)


def _cached(key: Mapping[str, object], learn: Callable[[], Model]) -> Model:
    """Return the model of `key` from the user's cache, learning it when it is not there."""
    text = json.dumps({**key, "learning": _LEARNING_VERSION}, sort_keys=True)
    path = cache_folder() / f"model-{hashlib.sha256(text.encode()).hexdigest()[:32]}.npz"
    try:
        return read_model(path)
    except ModelError:
        pass  # not there, or damaged: learn it again
    content = arrays_to_npz(model_arrays(learn()))
    # A cache that cannot be written costs time the next time, no more.
    with suppress(OutputError):
        write_file(path, content)
    return model_from_npz(content, "the model just learned")
