"""What Algorithm 1 is given, and what it finds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray  # noqa: TC002

from sparsor.design.budget import Budget  # noqa: TC001
from sparsor.design.legs import LegTable  # noqa: TC001
from sparsor.design.span import Span, span_of
from sparsor.errors import DesignError

Sparsity = Callable[[np.random.Generator], tuple[float, int]]


@dataclass(frozen=True)
class Weights:
    """The three weights of the cost C (the paper's Eq. 6)."""

    valid: float = 1.0
    path: float = 0.0
    incoherence: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("valid", self.valid), ("path", self.path), ("incoh", self.incoherence)):
            if not (np.isfinite(value) and value >= 0):
                raise DesignError(f"lambda_{name} is {value:g}; it has to be 0 or above")


@dataclass(frozen=True)
class Problem:
    """What Algorithm 1 is given.

    Parameters
    ----------
    psi : array of float64 (N, K)
        Dictionary.
    maps : array of float64 (n, N)
        Validation maps on the dictionary's scale, its mean taken off.
    lasso_weight : float
        lambda of the LASSO.
    legs : LegTable
    rows : int
        M, rows of Phi.
    budget : Budget, optional
        Routes beyond it are rejected.
    unit_rows, improve : bool
        The default reading of mu and of the path; both False is the paper's.
    mapped : array of bool (N,), optional
        Cells that the error counts, those among them that may not be flown too; default: those that may be flown.
    """

    psi: NDArray[np.float64]
    maps: NDArray[np.float64]
    lasso_weight: float
    legs: LegTable
    rows: int = 35
    budget: Budget | None = None
    unit_rows: bool = True
    improve: bool = True
    mapped: NDArray[np.bool_] | None = None

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Cells that the error counts."""
        return self.legs.allowed if self.mapped is None else self.mapped

    @cached_property
    def span(self) -> Span:
        """The maps and atoms as the search compares them."""
        return span_of(self.psi, self.maps, self.counted)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.lasso_weight) and self.lasso_weight > 0):
            raise DesignError(f"lasso weight is {self.lasso_weight:g}; it has to be above 0")
        if not 1 <= self.rows <= self.legs.size:
            raise DesignError(f"rows is {self.rows}; a measurement matrix has 1..{self.legs.size} rows")
        if self.maps.shape[1] != self.legs.size or self.psi.shape[0] != self.legs.size:
            raise DesignError(
                f"maps of {self.maps.shape[1]} cells and atoms of {self.psi.shape[0]} do not fit a grid of "
                f"{self.legs.size} cells"
            )


@dataclass(frozen=True)
class Candidate:
    """One Monte-Carlo sample that was evaluated to the end.

    Parameters
    ----------
    sample : int
        r, counted from 0.
    cost, error, length_cells, incoherence : float
        C, E (mean squared l2 error), L in cell units, mu.
    phi : array of bool (M, N)
    stops : array of int64 (n,)
        The visited cells in path order.
    probability, theta : float, int
        What the sample was drawn with.
    dwells : array of int64 (n,), optional
        How many holds long the vehicle stays at each stop; None: one at every stop.
    """

    sample: int
    cost: float
    error: float
    length_cells: float
    incoherence: float
    phi: NDArray[np.bool_]
    stops: NDArray[np.int64]
    probability: float
    theta: int
    dwells: NDArray[np.int64] | None = None
