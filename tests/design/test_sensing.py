from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from sparsor.core.streams import stream
from sparsor.design.sensing import draw_phi, incoherence, measured_atoms
from sparsor.design.sparsity import check_sparsity, searched_sparsity
from sparsor.errors import DesignError


def test_pruning_empties_columns_with_fewer_ones_than_theta_and_no_other():
    drawn = draw_phi(stream(1), 35, 1024, 0.03, 0)
    pruned = draw_phi(stream(1), 35, 1024, 0.03, 3)
    kept = drawn.sum(axis=0) >= 3
    np.testing.assert_array_equal(pruned[:, kept], drawn[:, kept])
    assert not pruned[:, ~kept].any()


def test_about_89_cells_survive_the_papers_settings():
    visited = [draw_phi(stream(r), 35, 1024, 0.03, 3).any(axis=0).sum() for r in range(40)]
    assert np.mean(visited) == pytest.approx(1024 * binom.sf(2, 35, 0.03), rel=0.05)
    assert 84 < np.mean(visited) < 94


def test_incoherence_is_the_largest_normalised_inner_product():
    rng = np.random.default_rng(0)
    phi = rng.random((5, 30)) < 0.2
    phi[3] = False  # an empty row counts for nothing
    psi = rng.normal(size=(30, 8))
    psi /= np.linalg.norm(psi, axis=0)
    atoms = measured_atoms(phi, np.flatnonzero(phi.any(axis=0)), psi)
    np.testing.assert_allclose(atoms, (phi @ psi).T, atol=1e-12)
    rows = phi[phi.any(axis=1)].astype(float)
    raw = np.abs(rows @ psi)
    assert incoherence(atoms, phi, unit_rows=False) == pytest.approx(raw.max())
    unit = raw / np.linalg.norm(rows, axis=1, keepdims=True)
    assert incoherence(atoms, phi) == pytest.approx(unit.max())
    assert 0 <= incoherence(atoms, phi) <= 1


def test_searched_draws_visit_about_as_many_cells_as_the_budget_allows():
    draw = searched_sparsity(20, 1024, 35)
    visited = []
    for r in range(200):
        rng = stream(0, r)
        p, theta = draw(rng)
        assert 1 <= theta <= 4
        visited.append(draw_phi(rng, 35, 1024, p, theta).any(axis=0).sum())
    assert 8 <= np.median(visited) <= 32
    assert np.percentile(visited, 2) >= 1


def test_given_values_stay_fixed():
    rng = stream(0)
    draw = searched_sparsity(20, 1024, 35, probability=0.02)
    assert {draw(rng)[0] for _ in range(20)} == {0.02}
    draw = searched_sparsity(20, 1024, 35, theta=2)
    assert {draw(rng)[1] for _ in range(20)} == {2}


@pytest.mark.parametrize(("p", "theta", "message"), [(1.5, None, "probability is 1.5"), (None, 40, "theta is 40")])
def test_values_out_of_range_are_refused(p, theta, message):
    with pytest.raises(DesignError, match=message):
        check_sparsity(p, theta, 35)
