"""The paper's decoder: the LASSO over the learned dictionary, with unknown level and amplitude.

The level is a constant atom without a penalty; it is projected out. The amplitude is free because lambda is a share of
the largest correlation between atoms and values: scaling the values scales the map. The mean map is one more atom.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.streams import stream
from sparsor.design.decoders.noise import Noise
from sparsor.design.decoders.setting import Estimate, value_scale
from sparsor.design.lars import lasso
from sparsor.errors import DesignError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design.decoders.measurements import Measurements
    from sparsor.design.decoders.rehearsal import Rehearsal
    from sparsor.design.decoders.setting import Setting

SHARES = (0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4)
_MOST_REPLICATES, _LEAST_REPLICATES = 40, 3
_STREAM = 5  # not one of the search's
_LEAST_ROWS = 2


@dataclass(frozen=True)
class SparseDecoder:
    """The LASSO for one set of measurements.

    Parameters
    ----------
    setting : Setting
    dictionary : array of float64 (N, K)
        With the mean map as its last atom where the model is centred.
    sums : array of float64 (M, m)
        What is summed before decoding: the identity, or the rows of Phi over the measured cells.
    share : float
        lambda over the largest correlation.
    misfits : array of float64 (n, N)
        Squared errors on the validation maps, as shares of the squared spread of their measured values.
    """

    setting: Setting
    dictionary: NDArray[np.float64]
    sums: NDArray[np.float64]
    share: float
    misfits: NDArray[np.float64]

    def maps(self, values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the maps and levels of measured values (n, m)."""
        noise = self._noise_of_sums()
        level_row = noise.whitened(self.sums.sum(axis=1))  # a row of H sums to 1
        atoms = noise.whitened((self.sums @ (self.setting.measurements.weights @ self.dictionary)).T).T
        targets = noise.whitened(values @ self.sums.T)
        direction = level_row / np.linalg.norm(level_row)
        contrast_atoms = atoms - np.outer(direction, direction @ atoms)
        contrast = targets - np.outer(targets @ direction, direction)
        largest = np.abs(contrast @ contrast_atoms).max(axis=1)
        largest[largest == 0] = 1.0
        codes = _codes(contrast_atoms, contrast / largest[:, None], self.share) * largest[:, None]
        level = (targets - codes @ atoms.T) @ direction / np.linalg.norm(level_row)
        return level[:, None] + codes @ self.dictionary.T, level

    def decode(self, values: NDArray[np.float64]) -> Estimate:
        """Return the maps measured as `values`, (n, m): one map a row.

        The variance is that of a residual bootstrap plus the misfit seen on the validation maps.
        """
        return self._estimate(values, self.misfits.mean(axis=0))

    def trial(self, rehearsal: Rehearsal) -> Estimate:
        """Return the rehearsed validation maps, decoded; what each map itself adds to the misfit is left out."""
        count = len(self.misfits)
        others = (self.misfits.sum(axis=0) - self.misfits) / (count - 1) if count > 1 else self.misfits
        return self._estimate(rehearsal.values, others)

    def _estimate(self, values: NDArray[np.float64], misfit: NDArray[np.float64]) -> Estimate:
        maps, level = self.maps(values)
        scale = value_scale(values, self.setting.measurements.variance)
        variance = self._bootstrap(maps, values) + misfit * scale[:, None] ** 2
        return Estimate(maps, variance, level)

    def finer(self, estimate: Estimate, factor: int) -> None:
        """Return None: the dictionary knows cells only."""

    @property
    def settings(self) -> dict[str, float]:
        """What was chosen on the validation maps."""
        return {"lambda_share": self.share}

    def _bootstrap(self, maps: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the variance of maps decoded from fitted values plus residuals drawn with replacement.

        Residuals are drawn on the scale of their noise (Freedman 1981; Chatterjee & Lahiri 2011 for the LASSO); a
        drift, which all of them share, is taken off before and drawn by itself.
        """
        fitted = maps @ self.setting.measurements.weights.T
        noise = self.setting.measurements.variance
        spread = np.sqrt(noise / noise.mean()) if noise.min() > 0 else np.ones(noise.size)
        residuals = values - fitted
        residuals = (residuals - self.setting.noise.drift_in(residuals)) / spread
        residuals -= residuals.mean(axis=1, keepdims=True)
        count = max(_MOST_REPLICATES // len(values), _LEAST_REPLICATES)
        draw = stream(self.setting.seed, _STREAM)
        drawn = draw.integers(0, noise.size, (count, noise.size))
        replicates = fitted + residuals[:, drawn].swapaxes(0, 1) * spread  # replicates x n x m
        replicates += draw.standard_normal((count, 1, 1)) * self.setting.measurements.drift_sd
        again, _ = self.maps(replicates.reshape(-1, noise.size))
        return np.asarray(again.reshape(count, *maps.shape).var(axis=0, ddof=1))

    def _noise_of_sums(self) -> Noise:
        """Return the noise of the decoded rows, of mean variance 1; all alike where some reading has none."""
        noise = self.setting.noise
        variance = np.square(self.sums) @ noise.variance
        scale = variance.mean()
        without = self.setting.measurements.variance.min() == 0
        return Noise(np.ones_like(variance) if without else variance / scale, self.sums @ noise.drift / np.sqrt(scale))


def sparse_decoder(setting: Setting, rehearsal: Rehearsal, phi: NDArray[np.bool_] | None = None) -> SparseDecoder:
    """Return the LASSO with the lambda that decodes the rehearsed validation maps best.

    Parameters
    ----------
    setting : Setting
    rehearsal : Rehearsal
    phi : array of bool (M, N), optional
        The planned measurement matrix: decode its sums over the measured cells, as the paper does.

    Raises
    ------
    DesignError
        When fewer than two rows of `phi` hold a measured cell.
    """
    model, measurements = setting.model, setting.measurements
    norm = np.linalg.norm(model.mean)
    dictionary = np.column_stack([model.dictionary, model.mean / norm]) if norm > 0 else model.dictionary
    sums = np.eye(measurements.count) if phi is None else _sums(phi, measurements)
    best = SparseDecoder(setting, dictionary, sums, SHARES[0], np.zeros((1, len(dictionary))))
    maps = best.maps(rehearsal.values)[0]
    for share in SHARES[1:]:  # the smaller, the slower: stop where it no longer helps
        other = replace(best, share=share)
        tried = other.maps(rehearsal.values)[0]
        if rehearsal.mean_error(tried) >= rehearsal.mean_error(maps):
            break
        best, maps = other, tried
    missed = (maps - rehearsal.maps) / value_scale(rehearsal.values, measurements.variance)[:, None]
    return replace(best, misfits=np.square(missed))


def _codes(atoms: NDArray[np.float64], targets: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Return the LASSO codes of targets; the compiled solver runs on all cores."""
    parts = np.array_split(targets, min(os.cpu_count() or 1, len(targets)))
    with ThreadPoolExecutor(len(parts)) as pool:
        return np.concatenate(list(pool.map(lambda part: lasso(atoms, part, share), parts)))


def _sums(phi: NDArray[np.bool_], measurements: Measurements) -> NDArray[np.float64]:
    """Return the matrix that turns measurements into the sums of Phi over the cells that were measured.

    A measurement counts for the cell of its largest share; several of one cell are averaged by their precision. The
    column of a missed cell is zero, and rows left empty are dropped.
    """
    if phi.shape[1] != measurements.weights.shape[1]:
        raise DesignError(f"Phi has {phi.shape[1]} columns, the measurements {measurements.weights.shape[1]} cells")
    cell = measurements.weights.argmax(axis=1)
    noise = measurements.variance
    precision = 1 / noise if noise.min() > 0 else np.ones(noise.size)
    in_cell = np.bincount(cell, weights=precision, minlength=phi.shape[1])
    sums = phi[:, cell] * (precision / in_cell[cell])
    sums = sums[sums.any(axis=1)]
    if len(sums) < _LEAST_ROWS:
        raise DesignError(
            f"{len(sums)} row(s) of Phi hold a measured cell; at least {_LEAST_ROWS} are needed: "
            "decode the single cells"
        )
    return np.asarray(sums)
