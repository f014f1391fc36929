"""What was measured: one row of weights over the cells, one value and one noise variance a measurement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import DesignError

if TYPE_CHECKING:
    from numpy.typing import NDArray

LEAST_CELLS = 2
_ROW_SUM = 1e-6
_DIGITS = 9


@dataclass(frozen=True)
class Measurements:
    """Measurements ``y = a + b (H s) + e`` of a map s, with ``e ~ N(0, diag(variance) + drift drift^T)``.

    Parameters
    ----------
    weights : array of float64 (m, N)
        H: the share of each cell in each measurement. No weight is negative and a row sums to 1; a reading inside one
        cell is a row with a single 1.
    values : array of float64 (m,)
        y, in the sensor's unit.
    variance : array of float64 (m,)
        Of the noise, in the square of the sensor's unit; 0 for readings without noise.
    drift : array of float64 (m,), optional
        What one standard deviation of the sensor's drift adds to each; None where there is none.

    Raises
    ------
    DesignError
        When fewer than two cells are measured, the shapes do not fit, a value is not a number, a variance is
        negative, or a row of weights is not of shares.

    Examples
    --------
    >>> cells = Measurements(np.eye(4)[[0, 3]], np.array([41.0, 47.0]), np.array([4.0, 4.0]))
    >>> cells.count, cells.cells.tolist()
    (2, [0, 3])
    """

    weights: NDArray[np.float64]
    values: NDArray[np.float64]
    variance: NDArray[np.float64]
    drift: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        shape = self.weights.shape
        if self.weights.ndim != 2 or not shape[:1] == self.values.shape == self.variance.shape == self.drift_sd.shape:
            raise DesignError(
                f"weights of shape {shape} do not fit {self.values.shape} values and {self.variance.shape} variances: "
                "each measurement has one row of weights, one value and one variance"
            )
        if shape[0] < LEAST_CELLS or self.cells.size < LEAST_CELLS:
            raise DesignError(
                f"a map needs at least {LEAST_CELLS} measurements in at least {LEAST_CELLS} cells, to tell its level "
                f"and its contrast; found: {_count(shape[0], 'measurement')} over {_count(self.cells.size, 'cell')}. "
                "Give a log of a longer flight over the box, or all logs of the mission"
            )
        named = {
            "weights": self.weights,
            "values": self.values,
            "variances": self.variance,
            "drift's shares": self.drift_sd,
        }
        for name, array in named.items():
            if not np.isfinite(array).all():
                raise DesignError(f"the {name} hold something that is not a number: leave those measurements out")
        if self.variance.min() < 0:
            raise DesignError(f"a noise variance is {self.variance.min():g}; it has to be 0 or above")
        sums = self.weights.sum(axis=1)
        if self.weights.min() < 0 or np.abs(sums - 1).max() > _ROW_SUM:
            raise DesignError(
                f"weights from {self.weights.min():g}, rows that sum to {sums.min():g}..{sums.max():g}: weights are "
                "shares of cells, 0 or above, and each row sums to 1"
            )

    @property
    def count(self) -> int:
        """Number of measurements, m."""
        return int(self.values.size)

    @property
    def drift_sd(self) -> NDArray[np.float64]:
        """The drift's share in each measurement, 0 where there is none."""
        return np.zeros_like(self.values) if self.drift is None else self.drift

    @property
    def cells(self) -> NDArray[np.int64]:
        """Cells that any measurement has a share of, ascending."""
        return np.flatnonzero(self.weights.any(axis=0))

    def in_order(self) -> Measurements:
        """Return the same measurements in an order that does not depend on the one they came in."""
        column = np.arange(1, self.weights.shape[1] + 1)
        # Rounded, because a sum over several cells may end in other digits when the row lies elsewhere in memory.
        place, second = (np.round(self.weights @ np.sqrt(column * scale), _DIGITS) for scale in (2.0, 3.0 * column))
        order = np.lexsort((self.drift_sd, self.variance, self.values, second, place))
        return Measurements(self.weights[order], self.values[order], self.variance[order], self.drift_sd[order])


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
