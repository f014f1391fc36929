"""The error to expect of a chosen Phi, in the definition that users are shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.metrics import centred_relative_error
from sparsor.core.workers import one_blas_thread
from sparsor.design.lars import lasso
from sparsor.errors import DesignError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.design.problem import Candidate, Problem


def expected_errors(problem: Problem, candidate: Candidate, mean: NDArray[np.float64]) -> tuple[float, float]:
    """Return the mean ``|s - s_hat| / |s - mean(s)|`` over the validation maps, cells of the map only.

    The search chose Phi on these very maps, so the figure is optimistic; maps without contrast do not count.

    Parameters
    ----------
    problem : Problem
    candidate : Candidate
    mean : array of float64 (N,)
        What was taken off the maps.

    Returns
    -------
    tuple of float
        Decoded from the M sums of Phi (the paper's), and from the visited cells one by one.
    """
    truth = problem.maps + mean
    rows = (candidate.phi.astype(np.float64), np.eye(truth.shape[1])[np.sort(candidate.stops)])
    errors = []
    for phi in rows:
        with one_blas_thread():
            codes = lasso(phi @ problem.psi, problem.maps @ phi.T, problem.lasso_weight)
            estimate = codes @ problem.psi.T + mean
        counted = problem.counted
        each = centred_relative_error(truth[:, counted], estimate[:, counted])
        if np.isnan(each).all():
            raise DesignError("the validation maps have no contrast inside the area: no error can be expected of them")
        errors.append(float(np.nanmean(each)))
    return errors[0], errors[1]
