"""Dictionaries: unit atoms, the spaces they span, and that a learned one fits what it learned from."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.fft import dctn
from sklearn.decomposition import sparse_encode

from sparsor.errors import ModelError
from sparsor.prior.dictionary import dct_dictionary, learned_dictionary, polynomial_dictionary

SHAPE = (8, 9)
FIXED = {"dct": dct_dictionary, "polynomial": polynomial_dictionary}
shapes = st.tuples(st.integers(2, 12), st.integers(2, 12))


def plume_maps(count=60, sources=10, seed=5):
    """Maps with a few of the same narrow plumes in each, less their mean."""
    rng = np.random.default_rng(seed)
    row, column = np.indices(SHAPE)
    at = rng.uniform(0, 1, (sources, 2)) * SHAPE
    plumes = np.exp(-((row - at[:, :1, None]) ** 2 + 0.3 * (column - at[:, 1:, None]) ** 2)).reshape(sources, -1)
    maps = (rng.random((count, sources)) * (rng.random((count, sources)) < 0.3)) @ plumes
    return maps - maps.mean(axis=0)


def coding_error(psi, maps, weight=1e-2):
    codes = sparse_encode(maps, psi.T, algorithm="lasso_lars", alpha=weight)
    return np.square(maps - codes @ psi.T).sum() / np.square(maps).sum()


@pytest.mark.parametrize("kind", FIXED)
@settings(max_examples=25, deadline=None)
@given(shapes, st.data())
def test_pre_defined_atoms_are_orthonormal(kind, shape, data):
    atoms = data.draw(st.integers(2, shape[0] * shape[1]))
    psi = FIXED[kind](shape, atoms)
    assert psi.shape == (shape[0] * shape[1], atoms)
    np.testing.assert_allclose(psi.T @ psi, np.eye(atoms), atol=1e-10)


@pytest.mark.parametrize("kind", FIXED)
def test_the_first_atom_is_constant_and_more_atoms_only_add(kind):
    whole = FIXED[kind](SHAPE, SHAPE[0] * SHAPE[1])
    assert np.ptp(whole[:, 0]) < 1e-12
    for atoms in (2, 5, 40):
        np.testing.assert_array_equal(FIXED[kind](SHAPE, atoms), whole[:, :atoms])


def test_dct_atoms_are_those_of_the_transform():
    psi = dct_dictionary(SHAPE, SHAPE[0] * SHAPE[1])
    coefficients = dctn(psi.T.reshape(-1, *SHAPE), type=2, norm="ortho", axes=(1, 2))
    # Each atom is one coefficient of the transform, and each coefficient has its atom.
    flat = coefficients.reshape(len(coefficients), -1)
    np.testing.assert_allclose(np.sort(np.abs(flat), axis=1)[:, -2], 0, atol=1e-12)
    assert sorted(np.abs(flat).argmax(axis=1).tolist()) == list(range(flat.shape[1]))
    # Lowest frequency first: the sum of the orders never falls.
    order = np.add(*np.unravel_index(np.abs(flat).argmax(axis=1), SHAPE))
    assert (np.diff(order) >= 0).all()


@settings(max_examples=25, deadline=None)
@given(shapes, st.integers(0, 6), st.integers(0, 10**6))
def test_polynomials_up_to_a_degree_are_spanned_exactly(shape, degree, seed):
    """All monomials of total degree up to d (and below the sides) lie in the first (d + 1)(d + 2) / 2 atoms."""
    degree = min(degree, min(shape) - 1)
    atoms = max((degree + 1) * (degree + 2) // 2, 2)
    row, column = (np.linspace(-1, 1, side) for side in shape)
    weights = np.random.default_rng(seed).normal(size=(degree + 1, degree + 1))
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    surface = sum(weights[i, j] * np.outer(row**i, column**j) for i, j in powers).ravel()
    psi = polynomial_dictionary(shape, atoms)
    np.testing.assert_allclose(psi @ (psi.T @ surface), surface, atol=1e-9 * np.abs(surface).max())


@pytest.mark.parametrize("kind", FIXED)
@pytest.mark.parametrize("atoms", [-1, 0, 1, 73])
def test_pre_defined_dictionaries_say_how_many_atoms_they_have(kind, atoms):
    with pytest.raises(ModelError, match=rf"atoms is {atoms}; this dictionary has 2\.\.72"):
        FIXED[kind](SHAPE, atoms)


@pytest.fixture(scope="module")
def learned():
    return learned_dictionary(plume_maps(), 12, seed=3)


def test_learned_atoms_are_of_unit_norm_and_finite(learned):
    assert learned.shape == (72, 12)
    assert np.isfinite(learned).all()
    np.testing.assert_allclose(np.linalg.norm(learned, axis=0), 1, atol=1e-12)


def test_the_same_seed_learns_the_same_dictionary_whatever_was_drawn_before(learned):
    np.random.default_rng(3).random(10)
    np.testing.assert_array_equal(learned_dictionary(plume_maps(), 12, seed=3), learned)
    assert not np.array_equal(learned_dictionary(plume_maps(), 12, seed=4), learned)


def test_learning_leaves_its_maps_and_the_global_random_state_alone():
    maps = plume_maps()
    before, state = maps.copy(), np.random.get_state()[1].copy()  # noqa: NPY002 (the global state is what is looked at)
    learned_dictionary(maps, 4, seed=0)
    np.testing.assert_array_equal(maps, before)
    np.testing.assert_array_equal(np.random.get_state()[1], state)  # noqa: NPY002


@pytest.mark.parametrize("kind", FIXED)
def test_a_learned_dictionary_represents_its_maps_better_than_a_pre_defined_one(learned, kind):
    """Of the same size: those it learned from by far, and unseen maps of the same plumes as well."""
    fixed = FIXED[kind](SHAPE, learned.shape[1])
    training, unseen = plume_maps(), plume_maps(count=90)[60:]
    assert coding_error(learned, training) < 0.3 * coding_error(fixed, training)
    assert coding_error(learned, unseen) < 0.5 * coding_error(fixed, unseen)


def test_learned_atoms_lie_in_the_span_of_the_maps(learned):
    axes = np.linalg.svd(plume_maps(), full_matrices=False)[2][:10]  # ten plumes
    np.testing.assert_allclose(axes.T @ (axes @ learned), learned, atol=1e-6)


@pytest.mark.parametrize("count", [2, 3, 7])
def test_there_are_no_more_atoms_than_maps(count):
    psi = learned_dictionary(plume_maps()[:count], 256, seed=0)
    assert psi.shape[1] == count
    np.testing.assert_allclose(np.linalg.norm(psi, axis=0), 1, atol=1e-12)


def test_progress_counts_up_to_its_total():
    said = []
    learned_dictionary(plume_maps(), 4, seed=0, progress=lambda *step: said.append(step))
    tasks, done, totals = zip(*said, strict=True)
    assert set(tasks) == {"learning the dictionary"}
    assert list(done) == list(range(1, totals[0] + 1))
    assert set(totals) == {len(said)}


@pytest.mark.parametrize(
    ("maps", "atoms", "words"),
    [
        (plume_maps(), 1, "atoms is 1; a dictionary needs at least 2"),
        (plume_maps(), -3, "atoms is -3; a dictionary needs at least 2"),
        (plume_maps()[:1], 8, r"cannot be learned from 1 map\(s\); at least 2 are needed"),
        (plume_maps()[:0], 8, r"cannot be learned from 0 map\(s\)"),
        (np.zeros((9, 72)), 8, "the training maps are all alike"),
    ],
)
def test_what_cannot_be_learned_from_is_said(maps, atoms, words):
    with pytest.raises(ModelError, match=words):
        learned_dictionary(maps, atoms, seed=0)


@pytest.mark.parametrize("count", [7, 10])
def test_maps_that_differ_by_rounding_alone_are_all_alike(count):
    maps = np.tile(np.random.default_rng(0).random(72), (count, 1))
    with pytest.raises(ModelError, match="the training maps are all alike"):
        learned_dictionary(maps - maps.mean(axis=0), 4, seed=0)
