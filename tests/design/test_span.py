from __future__ import annotations

import numpy as np
import pytest

from sparsor.design.candidate import Desk, allowed_phi
from sparsor.design.lars import lasso
from sparsor.design.span import span_of


def errors_over(psi, maps, allowed, codes):
    return np.square((maps - codes @ psi.T)[:, allowed]).sum(axis=1)


@pytest.mark.parametrize("cells", [120, 60, 20])  # more, and fewer, than atoms
def test_errors_in_the_span_are_those_of_the_whole_maps(problem, cells):
    rng = np.random.default_rng(cells)
    allowed = np.zeros(problem.legs.size, dtype=bool)
    allowed[rng.permutation(problem.legs.size)[:cells]] = True
    span = span_of(problem.psi, problem.maps, allowed)
    codes = rng.normal(size=(len(problem.maps), problem.psi.shape[1]))
    errors = errors_over(problem.psi, problem.maps, allowed, codes)
    inside = np.square(span.maps - codes @ span.atoms).sum(axis=1)
    np.testing.assert_allclose(inside + span.floor, errors, rtol=1e-11)
    best = np.linalg.lstsq(problem.psi[allowed], problem.maps[:, allowed].T)[0].T
    np.testing.assert_allclose(errors_over(problem.psi, problem.maps, allowed, best), span.floor, atol=1e-12)


def test_a_map_that_the_atoms_hold_has_an_error_free_of_cancellation(problem):
    codes = np.random.default_rng(1).normal(size=(3, problem.psi.shape[1]))
    span = span_of(problem.psi, codes @ problem.psi.T, problem.legs.allowed)
    assert (np.square(span.maps - codes @ span.atoms).sum(axis=1) + span.floor < 1e-24).all()


def test_the_order_of_the_maps_changes_no_error(problem):
    desk = Desk(problem)
    phi, cells = allowed_phi(problem, np.random.default_rng(0), 0.12, 3)
    desk.measure(problem, phi, cells)
    assert desk.judge(problem.span, problem.lasso_weight)
    errors = desk.errors.copy()
    codes = lasso(phi @ problem.psi, problem.maps @ phi.T, problem.lasso_weight)
    np.testing.assert_allclose(errors, errors_over(problem.psi, problem.maps, problem.legs.allowed, codes), rtol=1e-9)
    assert desk.judge(problem.span, problem.lasso_weight, order=np.arange(errors.size)[::-1].copy())
    np.testing.assert_array_equal(desk.errors, errors)


def test_what_is_given_up_is_above_the_limit_and_what_is_not_is_not(problem):
    desk = Desk(problem)
    for draw in range(10):
        desk.measure(problem, *allowed_phi(problem, np.random.default_rng(draw), 0.12, 3))
        desk.judge(problem.span, problem.lasso_weight)
        total = desk.errors.sum()
        assert desk.judge(problem.span, problem.lasso_weight, limit=total * (1 + 1e-12))
        assert not desk.judge(problem.span, problem.lasso_weight, limit=total * (1 - 1e-12))
