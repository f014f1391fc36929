"""Second-order statistics of maps: the covariance of their shapes, variogram and its exponential kernel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import ModelError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

_MAX_RANK = 384  # a smooth field's routes of 20 % of full coverage tell details apart that 128 leave out
_ROUNDING = 1e-12  # of the largest eigenvalue
_NO_SILL_CELLS = 100
_LEAST_SHARE = 1e-9  # white noise is all nugget; a kernel still needs a variance
_LARGEST_LAG = 0.5  # of the shorter side: beyond it a variogram rests on too few pairs


@dataclass(frozen=True)
class Kernel:
    """A stationary exponential covariance ``variance exp(-d / length)`` plus a nugget at distance 0.

    Parameters
    ----------
    variance, nugget : float
        On the square of the 0..1 scale.
    length_cells : float
        Decay length, cells.
    """

    variance: float
    length_cells: float
    nugget: float

    def __post_init__(self) -> None:
        values = (self.variance, self.length_cells, self.nugget)
        if not (np.isfinite(values).all() and self.variance > 0 and self.length_cells > 0 and self.nugget >= 0):
            raise ModelError(f"{self} is not a kernel: variance and length have to be above 0, the nugget 0 or above")

    @property
    def words(self) -> str:
        """The kernel as people read it."""
        nugget = self.nugget / (self.nugget + self.variance)
        # Maps without a sill push the fit against its upper end: the number there means nothing more.
        decay = f"{self.length_cells:.1f}" if self.length_cells < _NO_SILL_CELLS else f"more than {_NO_SILL_CELLS}"
        return f"exponential, decay over {decay} cells, nugget {nugget:.1%} of the sill"


def unit_shapes(maps: NDArray[np.float64], allowed: NDArray[np.bool_] | None = None) -> NDArray[np.float64]:
    """Return maps less their mean, over their spread; maps without contrast are left out.

    Parameters
    ----------
    maps : array of float64 (n, N)
    allowed : array of bool (N,), optional
        Cells that mean and spread are taken over; all by default.
    """
    inside = maps if allowed is None else maps[:, allowed]
    contrast = np.ptp(inside, axis=1) > 0
    shifted = maps[contrast] - inside[contrast].mean(axis=1, keepdims=True)
    return np.asarray(shifted / inside[contrast].std(axis=1, keepdims=True))


class ShapeCovariance:
    """The mean of ``x x^T`` over the shapes x of maps that come set by set: none has to be kept.

    Each map counts as much as its spread. That is between maps as they are, of which a few strong ones decide all, and
    bare shapes, of which the many weak ones do; see docs/decisions/0012-refined-search.md.
    """

    def __init__(self) -> None:
        self._weight = 0.0
        self._total: NDArray[np.float64] | float = 0.0

    def add(self, maps: NDArray[np.float64]) -> None:
        """Count maps in, (n, N)."""
        shapes, spread = unit_shapes(maps), maps[np.ptp(maps, axis=1) > 0].std(axis=1)
        self._total = self._total + (shapes * spread[:, None]).T @ shapes
        self._weight += float(spread.sum())

    @property
    def known(self) -> bool:
        """Whether a map with contrast was among them."""
        return self._weight > 0

    def value(self) -> NDArray[np.float64]:
        """Return the covariance of the maps so far, (N, N).

        Raises
        ------
        ModelError
            When not one map has contrast.
        """
        if not self.known:
            raise ModelError("the training maps have no contrast: there is no covariance to learn")
        return np.asarray(self._total / self._weight)


def shape_covariance(sets: Iterable[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the mean of ``x x^T`` over the shapes x of maps, (N, N), see `ShapeCovariance`.

    Parameters
    ----------
    sets : iterable of arrays of float64 (n, N)
        Taken one by one: none has to be kept.

    Raises
    ------
    ModelError
        When not one map has contrast.
    """
    covariance = ShapeCovariance()
    for maps in sets:
        covariance.add(maps)
    return covariance.value()


def covariance_factor(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return F, (N, R) with R <= 384, so that ``F F^T`` is a covariance in its leading components.

    Parameters
    ----------
    covariance : array of float64 (N, N)
    """
    values, axes = np.linalg.eigh(covariance)
    leading = np.flatnonzero(values > _ROUNDING * values[-1])[::-1][:_MAX_RANK]
    return np.ascontiguousarray(axes[:, leading] * np.sqrt(values[leading]))


def variogram(maps: NDArray[np.float64], shape: tuple[int, int], lags: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return half the mean squared difference between cells `lags` apart along rows and columns.

    Parameters
    ----------
    maps : array of float64 (n, N)
    shape : tuple of int
        Rows and columns of a map.
    lags : array of int64 (m,)
        Cells, 1 to the shorter side less 1.

    Returns
    -------
    array of float64 (m,)
        In the square of the maps' unit.
    """
    cube = maps.reshape(-1, *shape)
    half = [
        (np.square(cube[:, lag:] - cube[:, :-lag]).mean() + np.square(cube[:, :, lag:] - cube[:, :, :-lag]).mean()) / 4
        for lag in lags.tolist()
    ]
    return np.array(half)


def fit_kernel(maps: NDArray[np.float64], shape: tuple[int, int]) -> Kernel:
    """Fit the exponential kernel to the variogram of maps by weighted least squares.

    Raises
    ------
    ModelError
        When the maps have no contrast.
    """
    from scipy.optimize import nnls

    lags = np.arange(1, min(*shape, max(3, int(_LARGEST_LAG * min(shape)) + 1)))
    measured = variogram(maps, shape, lags)
    if not measured.max() > 0:
        raise ModelError("the training maps have no contrast: no kernel can be fitted to them")
    lags, measured = lags[measured > 0], measured[measured > 0]  # a pattern may repeat itself exactly
    best = (np.inf, 1.0, np.array([1.0, 0.0]))
    for length in np.geomspace(0.5, 8.0 * max(shape), 60):
        # Weighted by 1/gamma^2 (Cressie 1985), so that the short lags, which kriging leans on, count.
        columns = np.stack([1 - np.exp(-lags / length), np.ones(lags.size)], axis=1) / measured[:, None]
        weights, misfit = nnls(columns, np.ones(lags.size))
        if misfit < best[0]:
            best = (misfit, float(length), weights)
    variance, nugget = (float(part) for part in best[2])
    return Kernel(max(variance, _LEAST_SHARE * nugget), best[1], nugget)
