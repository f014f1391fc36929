"""Which p and theta Algorithm 1 draws with when a budget, not the user, has to choose them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.special import betaincinv

from sparsor.errors import DesignError

if TYPE_CHECKING:
    from sparsor.design.problem import Sparsity

THETAS = (1, 2, 3, 4)
# Draws aim at this range of visited cells, relative to what a shortest tour through random cells allows.
_FEWEST, _MOST = 0.4, 1.6
_STEPS = 24


def check_sparsity(probability: float | None, theta: int | None, rows: int) -> None:
    """Refuse a p or theta outside its range.

    Raises
    ------
    DesignError
    """
    if probability is not None and not 0 < probability <= 1:
        raise DesignError(f"probability is {probability:g}; it has to be above 0 and at most 1")
    if theta is not None and not 0 <= theta <= rows:
        raise DesignError(f"theta is {theta}; it has to be 0..{rows}, the number of rows of Phi")


def searched_sparsity(
    stops: int, cells: int, rows: int, *, probability: float | None = None, theta: int | None = None
) -> Sparsity:
    """Return a sampling that draws p and theta anew for every sample.

    theta is drawn from 1..4; p is the one at which about n cells are visited, n drawn evenly on a log scale
    around `stops`. A value that is given stays fixed.

    Parameters
    ----------
    stops : int
        How many random cells a route within the budget can visit, about.
    cells, rows : int
        Cells that may be visited, and rows of Phi.
    probability, theta : float, int, optional
        Fixed values.
    """
    fewest = max(2.0, _FEWEST * stops)
    most = min(max(4.0, _MOST * stops), 0.98 * cells)
    visited = np.geomspace(min(fewest, most), most, _STEPS)
    thetas = [t for t in THETAS if t <= rows] if theta is None else [max(theta, 1)]
    # P(at least theta ones among M) = I_p(theta, M - theta + 1): its inverse gives p for a share of cells.
    table = {t: betaincinv(t, rows - t + 1, visited / cells) for t in thetas}

    def draw(rng: np.random.Generator) -> tuple[float, int]:
        chosen = thetas[int(rng.integers(len(thetas)))]
        step = int(rng.integers(_STEPS))
        return (float(table[chosen][step]) if probability is None else probability), chosen

    return draw
