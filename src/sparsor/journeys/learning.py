"""From fields on file to a model on file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast, get_args

from sparsor.core.files import write_file
from sparsor.core.progress import Progress, silent
from sparsor.core.workers import Workers, workers_of
from sparsor.errors import FieldError, ModelError
from sparsor.geodesy import BoundingBox
from sparsor.journeys.modelling import learn_model, representation_error, with_sources
from sparsor.prior.archive import FieldFile, maps_of_files
from sparsor.prior.builtin import SHAPE
from sparsor.prior.dictionary import DictionaryName
from sparsor.prior.learning import DEFAULT_ATOMS
from sparsor.prior.model import Model, arrays_to_npz, model_arrays, model_from_npz
from sparsor.prior.windows import nearest_resolved_m

if TYPE_CHECKING:
    from pathlib import Path

_SMALLEST_M = 1.0  # asks for windows of no size: the answer is the smallest that the field resolves


@dataclass(frozen=True)
class LearnRequest:
    """What to learn, from what.

    Parameters
    ----------
    fields : tuple of Path
    window_km : tuple of float, optional
        East and north side of the maps; `bbox` gives the size of a box instead.
    bbox : tuple of float, optional
        West, south, east, north in degrees.
    variable, time, field_bbox, field_colormap, field_range
        As `sparsor.prior.archive.FieldFile` takes them.
    atoms : int
    dictionary : str
    centred : bool
    seed : int
    """

    fields: tuple[Path, ...]
    window_km: tuple[float, float] | None = None
    bbox: tuple[float, float, float, float] | None = None
    variable: str | None = None
    time: str | None = None
    field_bbox: tuple[float, float, float, float] | None = None
    field_colormap: str | None = None
    field_range: tuple[float, float] | None = None
    atoms: int = DEFAULT_ATOMS
    dictionary: str = "learned"
    centred: bool = True
    seed: int = 0


@dataclass(frozen=True)
class LearnedModel:
    """A model and how it came about.

    Parameters
    ----------
    model : Model
    maps, dropped, filled : int
        Windows cut, left out for their gaps, kept with gaps filled.
    validation_relative_error : float
        See `sparsor.journeys.modelling.representation_error`.
    warnings : tuple of str
    """

    model: Model
    maps: int
    dropped: int
    filled: int
    validation_relative_error: float
    warnings: tuple[str, ...]


def learn_from_fields(
    request: LearnRequest, output: Path, *, workers: Workers | int | None = None, progress: Progress = silent
) -> LearnedModel:
    """Learn a model from fields and write it.

    Parameters
    ----------
    request : LearnRequest
    output : Path
    workers : Workers or int, optional
        Who learns, see `sparsor.core.schedulers.workers_at`; a number is one of threads, one a core by default. The
        model is the same for any.
    progress : Progress

    Raises
    ------
    FieldError, ModelError
        When a field cannot be read, fields do not go together, or there is nothing to learn from.
    OutputError
        When the model cannot be written.
    """
    if request.dictionary not in get_args(DictionaryName):
        raise ModelError(f"dictionary '{request.dictionary}'; known are {', '.join(get_args(DictionaryName))}")
    if output.suffix != ".npz":
        raise ModelError(f"'{output}' has to end in .npz")
    files = [_file(path, request) for path in request.fields]
    asked = _asked_m(request)
    window_m = asked or (_SMALLEST_M, _SMALLEST_M)
    sources: dict[Path, str] = {}
    notes: list[str] = []
    for file in files:  # the size that all of them resolve
        field = file.first()
        window_m = nearest_resolved_m(field, *window_m, SHAPE)
        sources[file.path] = file.source(field)
        notes += field.notes
    maps, cut = maps_of_files(files, window_m, SHAPE, progress)
    model = learn_model(
        maps,
        atoms=request.atoms,
        centred=request.centred,
        dictionary=cast("DictionaryName", request.dictionary),
        seed=request.seed,
        workers=workers_of(workers),
        progress=progress,
    )
    content = arrays_to_npz(model_arrays(with_sources(model, sources)))
    write_file(output, content)
    model = model_from_npz(content, f"'{output}'")
    return LearnedModel(
        model=model,
        maps=cut.maps,
        dropped=cut.dropped,
        filled=cut.filled,
        validation_relative_error=representation_error(model),
        warnings=(*notes, *cut.words, *_said(request, asked, model)),
    )


def _file(path: Path, request: LearnRequest) -> FieldFile:
    return FieldFile(
        path, request.variable, request.time, request.field_bbox, request.field_colormap, request.field_range
    )


def _asked_m(request: LearnRequest) -> tuple[float, float] | None:
    if request.window_km is not None and request.bbox is not None:
        raise ModelError("give either --window or --bbox, not both")
    if request.bbox is not None:
        box = BoundingBox(*request.bbox)
        return box.east_m, box.north_m
    if request.window_km is None:
        return None
    if not all(0.2 <= side <= 3000 for side in request.window_km):
        raise FieldError(f"a window of {request.window_km[0]:g} x {request.window_km[1]:g} km; 0.2..3000 km a side")
    return request.window_km[0] * 1000, request.window_km[1] * 1000


def _said(request: LearnRequest, asked: tuple[float, float] | None, model: Model) -> tuple[str, ...]:
    said = []
    if asked is not None and max(model.window_m[0] / asked[0], asked[0] / model.window_m[0]) > 1.001:
        said.append(
            f"Windows of {asked[0] / 1000:.4g} x {asked[1] / 1000:.4g} km were asked for; the nearest that the "
            f"field resolves, {model.window_m[0] / 1000:.4g} x {model.window_m[1] / 1000:.4g} km, were used."
        )
    if model.atoms < request.atoms:
        said.append(
            f"There are {model.provenance['training_maps']} training windows, so the dictionary has {model.atoms} "
            f"atoms, not {request.atoms}."
        )
    return tuple(said)
