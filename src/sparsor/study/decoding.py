"""Decoders as the study compares them: each setting chosen on the validation maps, then the test maps decoded once.

The linear decoders are universal kriging with an unknown level: `kriging` by an exponential kernel, `mmse` by the
training maps' covariance, `blend` by a mixture of both. Unlike `sparsor.design.decoders`, which after a flight
estimates a map's amplitude from its readings, they take all maps to be of the training maps' amplitude: the noise
matters relative to it. `lasso` is the paper's, over a dictionary.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from sparsor.core.metrics import squared_error
from sparsor.design import lasso
from sparsor.design.decoders.covariance import kernel_covariance
from sparsor.design.tuning import LASSO_WEIGHTS
from sparsor.prior.statistics import Kernel

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from sparsor.study.cases import Case
    from sparsor.study.observing import Readings

    Metric = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]

SHARES = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.99, 1.0)
DECAYS = (1.5, 3.0, 6.0, 12.0, 24.0, 96.0)
NUGGETS = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 3e-2, 0.1)
LINEAR: dict[str, tuple[float, ...]] = {"kriging": (0.0,), "mmse": (1.0,), "blend": SHARES}
_MOST_VALIDATION = 24  # maps that choose lambda: one LASSO of many rows takes as long as all linear decoders
_WORSE = 2  # smaller lambdas in a row that do not help: the smaller, the slower


class Choice(NamedTuple):
    """Settings of a linear decoder: the covariance's share, the kernel's decay, the nugget, which covariance."""

    share: float
    decay: float
    nugget: float
    covariance: str


@dataclass(frozen=True)
class _Seen:
    """A covariance as readings see it: between cells and readings, and between readings."""

    towards: NDArray[np.float64]
    inner: NDArray[np.float64]

    @classmethod
    def of(cls, covariance: NDArray[np.float64], made: Readings) -> _Seen:
        towards = np.asarray(made.rows @ covariance).T
        return cls(towards, np.asarray(made.rows @ towards))

    def decode(
        self, other: _Seen, share: float, noise: NDArray[np.float64], values: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the maps (n, N) of readings (n, m), by a share of this covariance and the rest of another."""
        inner = share * self.inner + (1 - share) * other.inner
        inner[np.diag_indices_from(inner)] += noise
        factor = cho_factor(inner, lower=True, overwrite_a=True)
        solved = cho_solve(factor, np.column_stack([values.T, np.ones(len(inner))]))
        ones = solved[:, -1]
        level = solved[:, :-1].sum(axis=0) / ones.sum()
        pull = solved[:, :-1] - np.outer(ones, level)
        mixed = share * (self.towards @ pull) + (1 - share) * (other.towards @ pull)
        return np.asarray((level + mixed).T)


def decode_linear(case: Case, made: Readings, decoder: str, metric: Metric = squared_error) -> NDArray[np.float64]:
    """Return the test maps decoded by a linear decoder, (n, N).

    Parameters
    ----------
    case : Case
    made : Readings
    decoder : str
        A name in `LINEAR`.
    metric : callable
        The error that the settings are chosen by.
    """
    chooser = _Chooser(case, made, metric)
    choice = chooser.best(LINEAR[decoder])
    part = _Seen.of(case.final[choice.covariance], made)
    return chooser.decode(part, choice, made.of(case.sets.test, "test"))


def validation_error(case: Case, made: Readings, decoder: str, metric: Metric = squared_error) -> float:
    """Return the mean error on the validation maps of a linear decoder with the settings chosen there."""
    chooser = _Chooser(case, made, metric)
    return chooser.error(chooser.best(LINEAR[decoder]))


class _Chooser:
    """The choice of a linear decoder's settings on the validation maps."""

    def __init__(self, case: Case, made: Readings, metric: Metric) -> None:
        self.metric, self.truth = metric, case.sets.validation
        self.values = made.of(self.truth, "validation")
        self.parts = {name: _Seen.of(one, made) for name, one in case.training.items()}
        self.kernels = {decay: _Seen.of(_kernel(case.shape, decay), made) for decay in DECAYS}
        even = np.ones(made.variance.size)
        self.noise = made.variance / made.variance.mean() if made.variance.any() else even
        self.known: dict[Choice, float] = {}

    def best(self, shares: tuple[float, ...]) -> Choice:
        """Return the settings of least error: one is chosen at a time, until none changes."""
        decays = DECAYS if min(shares) < 1 else DECAYS[:1]
        names = tuple(self.parts) if max(shares) > 0 else tuple(self.parts)[:1]
        best = Choice(shares[len(shares) // 2], decays[len(decays) // 2], 1e-4, names[0])
        before = None
        while best != before:
            before = best
            best = min([best, *(best._replace(share=one) for one in shares)], key=self.error)
            best = min([best, *(best._replace(decay=one) for one in decays)], key=self.error)
            best = min([best, *(best._replace(nugget=one) for one in NUGGETS)], key=self.error)
            best = min([best, *(best._replace(covariance=one) for one in names)], key=self.error)
        return best

    def error(self, one: Choice) -> float:
        if one not in self.known:
            try:
                decoded = self.decode(self.parts[one.covariance], one, self.values)
                self.known[one] = float(self.metric(self.truth, decoded).mean())
            except LinAlgError:  # too smooth for readings without noise
                self.known[one] = np.inf
        return self.known[one]

    def decode(self, part: _Seen, one: Choice, values: NDArray[np.float64]) -> NDArray[np.float64]:
        return part.decode(self.kernels[one.decay], one.share, one.nugget * self.noise, values)


@cache
def _kernel(shape: tuple[int, int], decay: float) -> NDArray[np.float64]:
    return kernel_covariance(shape, Kernel(1.0, decay, 0.0), np.ones(shape[0] * shape[1], dtype=np.bool_))


def decode_lasso(
    case: Case,
    made: Readings,
    psi: NDArray[np.float64],
    *,
    sums: NDArray[np.bool_] | None = None,
    metric: Metric = squared_error,
) -> NDArray[np.float64]:
    """Return the test maps decoded by the LASSO over a dictionary, (n, N); lambda is chosen on validation maps.

    Parameters
    ----------
    case : Case
    made : Readings
    psi : array of float64 (N, K)
        For maps less the training mean.
    sums : array of bool (M, m), optional
        Phi over the readings: decode their sums, as the paper does.
    metric : callable
    """
    count = min(_MOST_VALIDATION, len(case.sets.validation))
    truth = case.sets.validation[np.linspace(0, len(case.sets.validation) - 1, count).round().astype(int)]
    values = made.of(truth, "validation")
    best, least, worse = LASSO_WEIGHTS[-1], np.inf, 0
    for weight in reversed(LASSO_WEIGHTS):
        error = float(metric(truth, _lasso_maps(case, made, psi, sums, weight, values)).mean())
        best, least, worse = (weight, error, 0) if error < least else (best, least, worse + (error > least))
        if worse == _WORSE:
            break
    return _lasso_maps(case, made, psi, sums, best, made.of(case.sets.test, "test"))


def _lasso_maps(
    case: Case,
    made: Readings,
    psi: NDArray[np.float64],
    sums: NDArray[np.bool_] | None,
    weight: float,
    values: NDArray[np.float64],
) -> NDArray[np.float64]:
    mean = case.mean
    atoms, targets = np.asarray(made.rows @ psi), values - made.rows @ mean
    if sums is not None:
        rows = sums.astype(np.float64)
        atoms, targets = rows @ atoms, targets @ rows.T
    return np.asarray(lasso(atoms, targets, weight) @ psi.T + mean)
