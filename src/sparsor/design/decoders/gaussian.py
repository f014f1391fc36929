"""Linear decoding with unknown level and amplitude: universal kriging, averaged over the amplitude.

``y = a + H f + e`` with ``f ~ N(0, tau^2 C)``, ``e ~ N(0, R + tau^2 W)``, a flat prior on the level a and on log tau.
Given tau this is generalised least squares for a and the conditional mean and variance of a Gaussian for the map
(Rasmussen & Williams 2006, section 2.7; Chiles & Delfiner 2012, chapter 3). tau is integrated out on a grid of log tau
weighted by the restricted likelihood (Patterson & Thompson 1971). One eigendecomposition serves all tau and all maps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array

from sparsor.design.decoders.noise import Noise
from sparsor.design.decoders.setting import Estimate, value_scale

if TYPE_CHECKING:
    from numpy.typing import NDArray

_REACH = 100.0  # tau is sought from this many times below to above the spread of the values
_STEP = 1.05
_NODES = 15
_DEPTH = 12.5  # log likelihood below its peak: five standard deviations


class System:
    """The linear system of one covariance and one set of measurements.

    Parameters
    ----------
    covariance : array of float64 (N, N)
        C, for amplitude 1.
    weights : array of float64 (m, N)
        H.
    noise : array of float64 (m,)
        Variances D, all above 0.
    nugget : array of float64 (m,) or float
        W: variance of the readings around what H says, as a share of the amplitude's square.
    drift : array of float64 (m,), optional
        u: ``R = D + u u^T``.
    """

    def __init__(
        self,
        covariance: NDArray[np.float64],
        weights: NDArray[np.float64],
        noise: NDArray[np.float64],
        nugget: NDArray[np.float64] | float = 0.0,
        drift: NDArray[np.float64] | None = None,
    ) -> None:
        self._noise = Noise(noise, np.zeros_like(noise) if drift is None else drift)
        rows = csr_array(weights)
        towards = np.asarray(rows @ covariance).T
        inner = np.asarray(rows @ towards)
        inner[np.diag_indices_from(inner)] += nugget
        eigenvalues, self._axes = np.linalg.eigh(self._noise.whitened(self._noise.whitened(inner).T))
        self._strength = np.maximum(eigenvalues, 0.0)
        self._towards = self._noise.whitened(towards) @ self._axes  # N x m
        self._ones = self._noise.whitened(np.ones_like(noise)) @ self._axes
        self._own = covariance.diagonal()

    def posterior(self, values: NDArray[np.float64]) -> Estimate:
        """Return the posterior of the maps measured as `values`, (n, m): one map a row."""
        rotated = self._noise.whitened(values) @ self._axes
        tau, share = self._amplitudes(rotated, value_scale(values, self._noise.variance))
        damping = 1 / (tau[:, :, None] ** 2 * self._strength + 1)  # n x nodes x m
        precision = damping @ self._ones**2
        level = (damping * self._ones) @ rotated[:, :, None]
        level = level[:, :, 0] / precision
        off = rotated[:, None, :] - level[:, :, None] * self._ones
        pulls = tau[:, :, None] ** 2 * damping * off
        deviations = pulls @ self._towards.T  # n x nodes x N
        maps = level[:, :, None] + deviations
        pull = np.einsum("nk,nkm->nm", share, pulls)
        mean = np.einsum("nk,nkc->nc", share, maps)
        between = np.einsum("nk,nkc->nc", share, np.square(maps - mean[:, None, :]))
        within = self._variances(tau, damping, precision)
        return Estimate(
            mean=mean,
            variance=between + np.einsum("nk,nkc->nc", share, within),
            level=(share * level).sum(axis=1),
            pull=self._noise.transposed(pull @ self._axes.T),
        )

    def _variances(
        self, tau: NDArray[np.float64], damping: NDArray[np.float64], precision: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the variance of each cell given tau, (n, nodes, N): of the field, and what the level adds."""
        square = tau[:, :, None] ** 2
        explained = square**2 * (damping @ np.square(self._towards).T)
        unexplained = 1 - (square * damping * self._ones) @ self._towards.T
        known = np.maximum(square * self._own - explained, 0.0)
        return np.asarray(known + np.square(unexplained) / precision[:, :, None])

    def _amplitudes(
        self, rotated: NDArray[np.float64], scale: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return nodes of tau where the restricted likelihood lies, and their shares, both (n, nodes)."""
        lowest, highest = np.log(scale.min() / _REACH), np.log(scale.max() * _REACH)
        coarse = np.linspace(lowest, highest, int((highest - lowest) / np.log(_STEP)) + 2)
        height = self.log_likelihood(rotated, np.exp(coarse)[None])
        height[np.abs(coarse - np.log(scale)[:, None]) > np.log(_REACH)] = -np.inf
        inside = height > height.max(axis=1, keepdims=True) - _DEPTH
        first, last = inside.argmax(axis=1), coarse.size - 1 - inside[:, ::-1].argmax(axis=1)
        span = coarse[np.maximum(first - 1, 0)], coarse[np.minimum(last + 1, coarse.size - 1)]
        tau = np.exp(np.linspace(*span, _NODES, axis=1))
        height = self.log_likelihood(rotated, tau)
        share = np.exp(height - height.max(axis=1, keepdims=True))
        return tau, share / share.sum(axis=1, keepdims=True)

    def log_likelihood(self, rotated: NDArray[np.float64], tau: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the restricted log likelihood, up to a constant, of tau (n, k) or (1, k) for each map, (n, k)."""
        total = tau[:, :, None] ** 2 * self._strength + 1
        damping = 1 / total
        precision = damping @ self._ones**2
        cross = np.matmul(damping * self._ones, rotated[:, :, None])[:, :, 0]
        square = np.matmul(damping, np.square(rotated)[:, :, None])[:, :, 0]
        misfit = square - cross**2 / precision
        return np.asarray(-0.5 * (np.log(total).sum(axis=2) + np.log(precision) + misfit))
