"""Which model a mission gets: built in by size, learned once and kept, or refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sparsor.errors import ModelError
from sparsor.geodesy import BoundingBox
from sparsor.journeys import modelling
from sparsor.journeys.modelling import cache_folder, choose_prior, learn_model, representation_error
from sparsor.mission.specification import PriorSection
from sparsor.prior.builtin import builtin_model
from sparsor.prior.learning import TrainingMaps
from sparsor.prior.model import arrays_to_npz, model_arrays

BOX = BoundingBox(51.50, 25.27, 51.53, 25.30)
TINY = BoundingBox(51.50, 25.27, 51.503, 25.273)  # 300 m: below the smallest built-in windows


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SPARSOR_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_the_built_in_model_is_that_of_the_nearest_size():
    prior = choose_prior(PriorSection(), BOX)
    assert prior.model.window_m == (2450.0, 2450.0)
    assert (prior.synthetic, prior.field) == (True, None)
    assert 1 <= prior.widening < 1.1  # 2.45 km windows, a box of about 3.2 km
    assert len(prior.warnings) == 1
    assert "synthetic" in prior.warnings[0]


def test_beyond_the_built_in_sizes_the_error_is_widened_and_said():
    prior = choose_prior(PriorSection(), TINY)
    assert prior.widening > 1
    assert any("widened" in warning for warning in prior.warnings)


def test_a_dictionary_of_another_size_is_learned_once(cache, monkeypatch):
    calls = []
    usual = builtin_model(2450.0)

    def learn(*_, **asked):
        calls.append(asked)
        return replace(usual, dictionary=usual.dictionary[:, : asked["atoms"]])

    monkeypatch.setattr(modelling, "builtin_maps", lambda _side: None)
    monkeypatch.setattr(modelling, "learn_model", learn)
    for _ in range(2):
        assert choose_prior(PriorSection(atoms=40), BOX).model.atoms == 40
    assert [(call["atoms"], call["centred"]) for call in calls] == [(40, True)]
    choose_prior(PriorSection(atoms=40), BOX, paper=True)  # uncentred: another model
    assert [(call["atoms"], call["centred"]) for call in calls[1:]] == [(40, False)]

    for path in cache.iterdir():
        path.write_bytes(b"damaged")
    assert choose_prior(PriorSection(atoms=40), BOX).model.atoms == 40
    assert len(calls) == 3


def test_a_cache_that_cannot_be_written_costs_time_only(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SPARSOR_CACHE_DIR", str(tmp_path / "file" / "cache"))
    monkeypatch.setattr(modelling, "builtin_maps", lambda _side: None)
    monkeypatch.setattr(modelling, "learn_model", lambda *_, **__: builtin_model(2450.0))
    assert choose_prior(PriorSection(atoms=40), BOX).model.atoms == 256


def test_the_cache_is_the_users_unless_told(monkeypatch):
    monkeypatch.delenv("SPARSOR_CACHE_DIR", raising=False)
    assert cache_folder().name.lower() in ("sparsor", "cache")


def test_a_model_file_has_to_hold_what_is_asked_for(tmp_path):
    path = tmp_path / "m.npz"
    path.write_bytes(arrays_to_npz(model_arrays(builtin_model(2450.0))))
    prior = choose_prior(PriorSection(model=path, atoms=256), BOX)
    assert not prior.synthetic
    assert prior.widening > 1  # 2.45 km windows, a 3.2 km box
    with pytest.raises(ModelError, match="holds 256 atoms, --atoms asks for 64"):
        choose_prior(PriorSection(model=path, atoms=64), BOX)
    with pytest.raises(ModelError, match="--paper needs an uncentred dictionary of 1024 atoms"):
        choose_prior(PriorSection(model=path), BOX, paper=True)


def planes(count, rng):
    """Return maps that three atoms represent: a constant and two slopes."""
    row, column = np.mgrid[:6, :6] / 5
    parts = np.stack([np.ones(36), row.ravel(), column.ravel()])
    return rng.random((count, 3)) @ parts


def test_maps_that_a_dictionary_spans_are_represented():
    rng = np.random.default_rng(0)
    maps = TrainingMaps(planes(40, rng), planes(6, rng), (6, 6), (100.0, 100.0), "ppb", "planes")
    model = learn_model(maps, atoms=3, dictionary="polynomial", seed=1)
    assert representation_error(model) < 0.05
    assert model.lasso_weight in (1e-5, 3e-5, 1e-4, 3e-4, 1e-3)  # the truth is exact: little is shrunk
    again = learn_model(maps, atoms=3, dictionary="polynomial", seed=1)
    assert again.lasso_weight == model.lasso_weight
