"""From measurements to a map, by the decoder asked for or the one that the validation maps choose."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from sparsor.core.workers import one_blas_thread
from sparsor.design.decoders.covariance import within_cell_variance
from sparsor.design.decoders.linear import blend, kriging, mmse
from sparsor.design.decoders.measurements import LEAST_CELLS
from sparsor.design.decoders.rehearsal import rehearse
from sparsor.design.decoders.setting import Setting
from sparsor.design.decoders.sparse import sparse_decoder
from sparsor.errors import DesignError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from sparsor.design.decoders.measurements import Measurements
    from sparsor.design.decoders.rehearsal import Rehearsal
    from sparsor.design.decoders.setting import Decoder
    from sparsor.prior.model import Model

DecoderName = Literal["auto", "lasso", "lasso-sums", "mmse", "kriging", "blend"]
CHOICES: tuple[DecoderName, ...] = ("kriging", "mmse", "blend", "lasso")


@dataclass(frozen=True)
class Decoded:
    """A map decoded from measurements, in the sensor's unit.

    Parameters
    ----------
    values, standard_deviation : array of float64 (N,)
        Posterior mean of each cell and how far it may be off; level and amplitude included.
    decoder : str
        The one that was used.
    level, amplitude : float
        Mean of the map over the cells that count, and the field's spread around it, that of the map and of what its
        uncertainty leaves open together.
    expected_relative_error : float
        Mean ``|s - s_hat| / |s - mean(s)|`` of the validation maps, measured and decoded the same way.
    recalibration : float
        Factor that the standard deviation holds so that it covered 95 % of the validation maps' cells.
    scores : mapping of str to float
        `expected_relative_error` of each decoder that was tried.
    settings : mapping of str to float
        What was chosen for the decoder on the validation maps.
    finer : array of float64 (N * finer**2,) or None
        The map on a finer grid, where one was asked for and the decoder allows it.
    """

    values: NDArray[np.float64]
    standard_deviation: NDArray[np.float64]
    decoder: str
    level: float
    amplitude: float
    expected_relative_error: float
    recalibration: float
    scores: Mapping[str, float]
    settings: Mapping[str, float]
    finer: NDArray[np.float64] | None


@dataclass(frozen=True)
class Candidate:
    """A decoder with what it did on the validation maps.

    Parameters
    ----------
    decoder : Decoder
    error : float
        Mean ``|s - s_hat| / |s - mean(s)|``.
    widening : float
        Factor on the standard deviation that makes it cover 95 % of their cells.
    """

    decoder: Decoder
    error: float
    widening: float


def decode(
    measurements: Measurements,
    model: Model,
    decoder: DecoderName = "auto",
    *,
    allowed: NDArray[np.bool_] | None = None,
    phi: NDArray[np.bool_] | None = None,
    within_cell: float = 0.0,
    widening: float = 1.0,
    finer: int = 1,
    seed: int = 0,
) -> Decoded:
    """Decode measurements to the map that they are of.

    The validation maps of the model, given the amplitude of the flown field, are measured with the same weights and
    noise and decoded first. What they say of each decoder picks the one that `auto` uses, and for every decoder its
    settings, its expected error and the recalibration of its standard deviation.

    Parameters
    ----------
    measurements : Measurements
    model : Model
    decoder : {"auto", "lasso", "lasso-sums", "mmse", "kriging", "blend"}
        `lasso` decodes the measurements, `lasso-sums` the sums of `phi` over the measured cells (the paper's).
    allowed : array of bool (N,), optional
        Cells inside the area; the others do not count in any choice or error.
    phi : array of bool (M, N), optional
        The planned measurement matrix, for `lasso-sums`.
    within_cell : float
        0 where readings are cell means, 1 where each is taken at a point: then the field's variance inside a cell
        counts as noise. A track across a cell lies between.
    widening : float
        Factor, 1 or above, on uncertainty and expected error: what the model is known to fall short of.
    finer : int
        Also return the map on a grid this many times finer.
    seed : int
        Of the noise on the validation maps and of the bootstrap.

    Raises
    ------
    DesignError
        When an option is out of range or the measurements do not fit the model.

    Examples
    --------
    >>> from sparsor.design.decoders.measurements import Measurements
    >>> from sparsor.prior.builtin import builtin_model
    >>> model, cells = builtin_model(14_700.0), np.arange(5, 1024, 11)
    >>> truth = 20 + 60 * model.validation[0]  # in ppb, say
    >>> measured = Measurements(np.eye(1024)[cells], truth[cells], np.full(cells.size, 0.01))
    >>> decoded = decode(measured, model, "kriging")
    >>> bool(np.linalg.norm(decoded.values - truth) < 0.5 * np.linalg.norm(truth - truth.mean()))
    True
    """
    each = decode_each(
        measurements,
        model,
        CHOICES if decoder == "auto" else (decoder,),
        allowed=allowed,
        phi=phi,
        within_cell=within_cell,
        widening=widening,
        finer=finer,
        seed=seed,
    )
    return min(each.values(), key=lambda one: one.expected_relative_error)


def decode_each(
    measurements: Measurements,
    model: Model,
    decoders: Sequence[DecoderName] = CHOICES,
    *,
    allowed: NDArray[np.bool_] | None = None,
    phi: NDArray[np.bool_] | None = None,
    within_cell: float = 0.0,
    widening: float = 1.0,
    finer: int = 1,
    seed: int = 0,
) -> dict[str, Decoded]:
    """Return what each of several decoders makes of the same measurements; see `decode`."""
    _check(decoders, phi, widening, finer)
    setting = _setting(measurements, model, allowed, within_cell, seed)
    with one_blas_thread():  # the same digits on any number of cores
        return _decoded(setting, decoders, phi, widening, finer)


def _decoded(
    setting: Setting,
    decoders: Sequence[DecoderName],
    phi: NDArray[np.bool_] | None,
    widening: float,
    finer: int,
) -> dict[str, Decoded]:
    values = setting.measurements.values[None]
    tried = candidates(setting, decoders, phi)
    scores = {name: one.error * widening for name, one in tried.items()}
    found = {}
    for name, one in tried.items():
        estimate = one.decoder.decode(values)
        found[name] = Decoded(
            values=estimate.mean[0],
            standard_deviation=np.sqrt(estimate.variance[0]) * one.widening * widening,
            decoder=name,
            level=float(estimate.mean[0, setting.allowed].mean()),
            amplitude=estimate.spread(setting.allowed),
            expected_relative_error=scores[name],
            recalibration=one.widening,
            scores=scores,
            settings=one.decoder.settings,
            finer=one.decoder.finer(estimate, finer) if finer > 1 else None,
        )
    return found


def candidates(
    setting: Setting,
    decoders: Sequence[DecoderName] = CHOICES,
    phi: NDArray[np.bool_] | None = None,
    amplitude: float | None = None,
) -> dict[str, Candidate]:
    """Return decoders made for a setting, each with what it did on the rehearsed validation maps.

    Those are given the amplitude, in the sensor's unit, that kriging finds in the setting's values unless it is given.
    """
    first = kriging(setting)
    if amplitude is None:
        amplitude = first.decode(setting.measurements.values[None]).spread(setting.allowed)
    rehearsal = rehearse(setting, amplitude)
    make: dict[str, Callable[[], Decoder]] = {
        "kriging": lambda: first,
        "mmse": lambda: mmse(setting),
        "blend": lambda: blend(setting, rehearsal),
        "lasso": lambda: sparse_decoder(setting, rehearsal),
        "lasso-sums": lambda: sparse_decoder(setting, rehearsal, phi),
    }
    with ThreadPoolExecutor(min(os.cpu_count() or 1, len(decoders))) as pool:
        tried = pool.map(lambda name: _tried(make[name](), rehearsal), decoders)
        return dict(zip(map(str, decoders), tried, strict=True))


def _tried(decoder: Decoder, rehearsal: Rehearsal) -> Candidate:
    trial = decoder.trial(rehearsal)
    return Candidate(decoder, rehearsal.mean_error(trial.mean), rehearsal.widening(trial.mean, trial.variance))


def _setting(
    measurements: Measurements, model: Model, allowed: NDArray[np.bool_] | None, within_cell: float, seed: int
) -> Setting:
    cells = model.shape[0] * model.shape[1]
    if measurements.weights.shape[1] != cells:
        raise DesignError(
            f"the measurements weigh {measurements.weights.shape[1]} cells, the model's grid has {cells}: take the "
            "model that the mission was planned with"
        )
    count = np.ones(cells, dtype=np.bool_) if allowed is None else allowed
    if count.shape != (cells,) or np.count_nonzero(count) < LEAST_CELLS:
        raise DesignError(
            f"allowed marks {np.count_nonzero(count)} of {count.size} cells; it has to mark at least {LEAST_CELLS} of "
            f"the grid's {cells}"
        )
    if not 0 <= within_cell <= 1:
        raise DesignError(f"within_cell is {within_cell:g}; it has to be in 0..1")
    ordered = measurements.in_order()
    inside = within_cell * within_cell_variance(model, count) if within_cell > 0 else 0.0
    nugget = inside * np.square(ordered.weights).sum(axis=1)
    return Setting(model, ordered, count, nugget, seed)


def _check(decoders: Sequence[str], phi: NDArray[np.bool_] | None, widening: float, finer: int) -> None:
    known = get_args(DecoderName)
    if unknown := [name for name in decoders if name not in known]:
        raise DesignError(f"decoder '{unknown[0]}'; known are {', '.join(known)}")
    if "lasso-sums" in decoders and phi is None:
        raise DesignError("lasso-sums decodes the sums of the planned Phi: give it, or take lasso")
    if not (np.isfinite(widening) and widening >= 1):
        raise DesignError(f"widening is {widening:g}; it has to be 1 or above")
    if finer < 1:
        raise DesignError(f"finer is {finer}; it has to be 1 or above")
