from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.design.basis import aligned, append, combine, remove


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.lists(st.booleans(), min_size=1, max_size=40))
def test_the_factor_stays_that_of_the_active_atoms(seed, joins):
    rng = np.random.default_rng(seed)
    M, K = int(rng.integers(2, 15)), int(rng.integers(2, 30))
    atoms = rng.normal(size=(K, M))
    gram = atoms @ atoms.T
    n = min(M, K)
    factor, fit, signs = np.empty((n, K + n)), np.empty(n), rng.choice([-1.0, 1.0], size=K)
    active, places = [], list(range(n))
    free = list(range(n))
    for joining in joins:
        if joining and len(active) < n:
            atom = int(rng.choice(np.setdiff1d(np.arange(K), active)))
            place = free.pop(0)
            assert append(factor, gram, len(active), atom, place)
            left = signs[atom] - factor[: len(active), atom] @ fit[: len(active)]
            fit[len(active)] = left / factor[len(active), atom]
            active, places = [*active, atom], [*places[: len(active)], place]
        elif active:
            position = int(rng.integers(len(active)))
            free.append(places.pop(position))
            active.pop(position)
            remove(factor, fit, np.array(active, dtype=np.int64), len(active) + 1, position)
            factor[: len(active), K + free[-1]] = 0.0
        count = len(active)
        places = places[:count]
        triangle = factor[:count, active].T
        scale = max(np.linalg.cond(gram[np.ix_(active, active)]), 1.0) if count else 1.0
        np.testing.assert_allclose(triangle, np.tril(triangle), atol=1e-13 * scale)
        np.testing.assert_allclose(triangle @ triangle.T, gram[np.ix_(active, active)], atol=1e-12 * scale)
        np.testing.assert_allclose(triangle @ factor[:count, :K], gram[active], atol=1e-11 * scale)
        inverse = factor[:count, [K + place for place in places]]
        np.testing.assert_allclose(triangle @ inverse, np.eye(count), atol=1e-11 * scale)
        np.testing.assert_allclose(triangle @ fit[:count], signs[active], atol=1e-11 * scale)


def test_a_collinear_atom_does_not_join():
    atoms = np.array([[1.0, 0, 0], [0, 1, 0], [2, -3, 0], [0, 0, 0]])
    gram = atoms @ atoms.T
    factor = np.empty((3, 7))
    assert append(factor, gram, 0, 0, 0)
    assert append(factor, gram, 1, 1, 1)
    assert not append(factor, gram, 2, 2, 2)
    assert not append(factor, gram, 2, 3, 2)


def test_rows_are_combined_whatever_their_number():
    rng = np.random.default_rng(0)
    for rows in (1, 6, 7, 8, 35):
        matrix, weights, out = rng.normal(size=(rows, 13)), rng.normal(size=rows), np.empty(16)
        combine(matrix, weights, out)
        np.testing.assert_allclose(out[:13], weights @ matrix, atol=1e-12)


def test_arrays_start_on_a_cache_line():
    for shape in ((5,), (3, 8), (35, 296)):
        array = aligned(*shape)
        assert array.shape == shape
        assert array.ctypes.data % 64 == 0
        assert array.flags.c_contiguous
