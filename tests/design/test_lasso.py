from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.decomposition import sparse_encode

from sparsor.design import lasso


def violation(A, y, weight, code):
    """Largest violation of the optimality (KKT) conditions of 1/2 |A c - y|^2 + weight |c|_1."""
    pull = A.T @ (y - A @ code)
    at_zero = np.abs(pull[code == 0]) - weight
    elsewhere = np.abs(pull[code != 0] - weight * np.sign(code[code != 0]))
    return max(at_zero.max(initial=0.0), elsewhere.max(initial=0.0))


def problems(kind):
    """Measured atoms and targets of different difficulty."""

    @st.composite
    def draw(draw_from):
        rng = np.random.default_rng(draw_from(st.integers(0, 10**6)))
        M, K = draw_from(st.integers(1, 25)), draw_from(st.integers(2, 60))
        A = rng.normal(size=(M, K))
        if kind == "coherent":  # nearly parallel atoms, as an uncentred dictionary has
            A = rng.normal(size=(M, 1)) + 0.1 * A
        if kind == "repeated":  # the same atom more than once, its mirror image, and one of zeros
            A[:, K // 2] = A[:, 0]
            A[:, K // 3] = -A[:, 0]
            A[:, -1] = 0.0
        if kind == "sums":  # rows of small whole numbers, as sums of equal atoms give
            A = rng.integers(-2, 3, size=(M, K)).astype(float)
        return A, rng.normal(size=(3, M)), 10.0 ** draw_from(st.floats(-5, 0.5))

    return draw()


@pytest.mark.parametrize("kind", ["plain", "coherent", "repeated", "sums"])
def test_solutions_meet_their_optimality_conditions(kind):
    @settings(max_examples=60, deadline=None)
    @given(problems(kind))
    def check(case):
        A, targets, weight = case
        for y, code in zip(targets, lasso(A, targets, weight), strict=True):
            assert violation(A, y, weight, code) <= 1e-8 * max(np.abs(A.T @ y).max(), 1e-12)

    check()


@settings(max_examples=30, deadline=None)
@given(problems("plain"))
def test_the_objective_is_that_of_scikit_learn_or_lower(case):
    A, targets, weight = case

    def objective(codes):
        return 0.5 * ((codes @ A.T - targets) ** 2).sum(axis=1) + weight * np.abs(codes).sum(axis=1)

    reference = sparse_encode(targets, A.T, algorithm="lasso_lars", alpha=weight)
    ours = objective(lasso(A, targets, weight))
    assert (ours <= objective(reference) * (1 + 1e-9) + 1e-12).all()


def test_a_weight_above_every_correlation_gives_zeros():
    A = np.random.default_rng(0).normal(size=(6, 9))
    y = np.ones((1, 6))
    assert not lasso(A, y, 1.001 * np.abs(A.T @ y[0]).max()).any()


def test_the_solution_scales_with_target_and_weight():
    rng = np.random.default_rng(1)
    A, y = rng.normal(size=(8, 20)), rng.normal(size=(1, 8))
    np.testing.assert_allclose(lasso(A, 3 * y, 0.3), 3 * lasso(A, y, 0.1), atol=1e-12)


def test_uncentred_square_dictionaries_are_solved(problem):
    """As many atoms as cells, all nearly parallel: the paper's own case."""
    psi = np.hstack([np.ones((problem.psi.shape[0], 1)), problem.psi])
    psi = psi + 0.3
    psi /= np.linalg.norm(psi, axis=0)
    phi = (np.random.default_rng(0).random((12, psi.shape[0])) < 0.1).astype(float)
    A, targets = phi @ psi, (problem.maps + 0.3) @ phi.T
    for y, code in zip(targets, lasso(A, targets, 1e-3), strict=True):
        assert violation(A, y, 1e-3, code) <= 1e-8 * np.abs(A.T @ y).max()
