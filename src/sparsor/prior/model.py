"""A model: what maps of one ground size look like, and its file."""

from __future__ import annotations

import io
import json
import struct
import tokenize
import zipfile
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.errors import ModelError
from sparsor.prior.statistics import Kernel

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

FORMAT = "sparsor model 2"

# What numpy, zipfile and the parsers below them raise for files that are damaged or made up.
_DAMAGED = (
    OSError,
    EOFError,
    LookupError,
    MemoryError,
    NotImplementedError,
    OverflowError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


@dataclass(frozen=True)
class Model:
    """A dictionary with the statistics and validation maps that go with it.

    Maps are on a 0..1 scale: the least and the largest value of the training windows (method.md).

    Parameters
    ----------
    shape : tuple of int
        Rows and columns of the grid.
    dictionary : array of float64 (N, K)
        Psi, atoms of unit l2 norm.
    mean : array of float64 (N,)
        Taken off the maps before they are coded; zeros where the model is not centred (the paper's).
    covariance_factor : array of float64 (N, R)
        F with ``F F^T`` the covariance of training windows, each less its mean and over its spread.
    kernel : Kernel
        Exponential covariance fitted to the training maps.
    lasso_weight : float
        lambda, chosen on the validation maps.
    validation : array of float64 (n, N)
        Validation maps, which the dictionary has not seen.
    scale : tuple of float
        Values in `unit` that 0 and 1 stand for.
    unit : str
        Of the field the maps come from.
    window_m : tuple of float
        East and north extent of the training windows, metres.
    provenance : mapping of str to str
        Where the maps come from and how the model was learned.

    Raises
    ------
    ModelError
        When the parts do not fit each other.
    """

    shape: tuple[int, int]
    dictionary: NDArray[np.float64]
    mean: NDArray[np.float64]
    covariance_factor: NDArray[np.float64]
    kernel: Kernel
    lasso_weight: float
    validation: NDArray[np.float64]
    scale: tuple[float, float]
    unit: str
    window_m: tuple[float, float]
    provenance: Mapping[str, str]

    def __post_init__(self) -> None:
        if not min(self.shape) >= 1:
            raise ModelError(f"its grid is {self.shape[0]} x {self.shape[1]}; each side has to be 1 or more")
        N = self.shape[0] * self.shape[1]
        for name, array, axes, cells in (
            ("dictionary", self.dictionary, 2, self.dictionary.shape[0]),
            ("mean", self.mean, 1, self.mean.size),
            ("covariance factor", self.covariance_factor, 2, self.covariance_factor.shape[0]),
            ("validation maps", self.validation, 2, self.validation.shape[-1]),
        ):
            if array.ndim != axes or cells != N:
                raise ModelError(f"the {name} of shape {array.shape} does not fit a grid of {self.shape}")
            if not np.isfinite(array).all():
                raise ModelError(f"the {name} holds values that are not numbers")
        if self.dictionary.shape[1] < 2 or not len(self.validation):
            raise ModelError("a model needs at least two atoms and one validation map")
        if np.abs(np.linalg.norm(self.dictionary, axis=0) - 1).max() > 0.01:
            raise ModelError("the dictionary's atoms are not of unit norm")
        if not np.isfinite([*self.scale, *self.window_m, self.lasso_weight]).all():
            raise ModelError(f"scale {self.scale}, window {self.window_m} or lambda is not a number")
        if not (self.scale[1] > self.scale[0] and self.lasso_weight > 0 and min(self.window_m) > 0):
            raise ModelError(
                f"scale {self.scale}, lambda {self.lasso_weight:g} or window {self.window_m} is out of range"
            )

    @property
    def atoms(self) -> int:
        """K, the number of atoms."""
        return int(self.dictionary.shape[1])

    @property
    def centred(self) -> bool:
        """Whether a mean is taken off the maps before they are coded."""
        return bool(self.mean.any())


def model_arrays(model: Model, dtype: type[np.floating[Any]] = np.float32) -> dict[str, NDArray[Any]]:
    """Return a model as plain arrays, for a file; `dtype` is that of the large ones."""
    about = {
        "format": FORMAT,
        "unit": model.unit,
        "lasso_weight": model.lasso_weight,
        "kernel": [model.kernel.variance, model.kernel.length_cells, model.kernel.nugget],
        "scale": list(model.scale),
        "window_m": list(model.window_m),
        "shape": list(model.shape),
        "provenance": dict(model.provenance),
    }
    return {
        "model": np.array(json.dumps(about, sort_keys=True)),
        "dictionary": model.dictionary.astype(dtype),
        "mean": model.mean.astype(np.float32),
        "covariance_factor": model.covariance_factor.astype(dtype),
        "validation": model.validation.astype(dtype),
    }


def model_from_arrays(arrays: Mapping[str, NDArray[Any]], source: str) -> Model:
    """Make a model from the arrays of `model_arrays`.

    Raises
    ------
    ModelError
        When something is missing or does not fit; `source` is named in the message.
    """
    try:
        about = json.loads(str(arrays["model"]))
        _check_format(about["format"])
        kernel = Kernel(*(float(value) for value in about["kernel"]))
        return Model(
            shape=(_whole(about["shape"][0]), _whole(about["shape"][1])),
            dictionary=np.ascontiguousarray(arrays["dictionary"], dtype=np.float64),
            mean=arrays["mean"].astype(np.float64),
            covariance_factor=arrays["covariance_factor"].astype(np.float64),
            kernel=kernel,
            lasso_weight=float(about["lasso_weight"]),
            validation=arrays["validation"].astype(np.float64),
            scale=(float(about["scale"][0]), float(about["scale"][1])),
            unit=str(about["unit"]),
            window_m=(float(about["window_m"][0]), float(about["window_m"][1])),
            provenance={str(key): str(value) for key, value in about["provenance"].items()},
        )
    except ModelError as error:
        raise ModelError(f"{source}: {error}") from None
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        raise ModelError(f"{source} is not a sparsor model ({error}); make one with 'sparsor learn'") from error


def _whole(value: object) -> int:
    if not isinstance(value, int):
        raise TypeError(f"{value!r} is not a whole number")
    return value


def _check_format(found: str) -> None:
    if found != FORMAT:
        raise ModelError(f"made as '{found}'; this version reads '{FORMAT}'")


def arrays_to_npz(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return arrays as the bytes of a compressed .npz: plain arrays, the same bytes every time."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def npz_to_arrays(content: bytes, source: str) -> dict[str, NDArray[Any]]:
    """Return all arrays of an .npz file's contents.

    Raises
    ------
    ModelError
        When it is damaged or holds anything but plain arrays; `source` is named in the message.
    """
    try:
        loaded = np.load(io.BytesIO(content), allow_pickle=False)
        if isinstance(loaded, np.lib.npyio.NpzFile):
            with loaded as stored:
                return {name: stored[name] for name in stored.files}
    except _DAMAGED as error:
        raise ModelError(f"{source} cannot be read as .npz; is it damaged, cut short, or something else?") from error
    raise ModelError(f"{source} is not an .npz file but one array; make a model with 'sparsor learn'")


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """Read all arrays of an .npz file.

    Raises
    ------
    ModelError
        When the file is missing, damaged or holds anything but plain arrays.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ModelError(f"cannot read '{path}': {error.strerror or error}") from error
    return npz_to_arrays(content, f"'{path}'")


def model_from_npz(content: bytes, source: str) -> Model:
    """Make a model from the contents of its file.

    Raises
    ------
    ModelError
        When it is damaged or not a model; `source` is named in the message.
    """
    return model_from_arrays(npz_to_arrays(content, source), source)


def read_model(path: Path) -> Model:
    """Read a model file.

    Raises
    ------
    ModelError
        When it is missing, damaged or not a model.
    """
    return model_from_arrays(read_npz(path), f"'{path}'")
