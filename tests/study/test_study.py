"""The study on a small field: resumed as if it had not stopped, the same again, and honest about `random`."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from sparsor.core.schedulers import workers_at
from sparsor.core.workers import workers_of
from sparsor.design import Weights, fixed_sparsity, search
from sparsor.journeys import studying
from sparsor.journeys.studying import StudyRequest, study
from sparsor.study.figures import _lower_at_same_length, figures
from sparsor.study.protocol import OVERLAP_NOTE
from sparsor.study.scoreboard import PLANNERS, Source, scoreboard
from sparsor.study.settings import StudySettings
from sparsor.study.store import Store, code_hash, field_hash, versions
from sparsor.study.summary import all_rows, by_length, headline, means
from sparsor.study.tables import Table
from sparsor.study.trials import Draws, Variant, trial, trial_given, winner

TINY = StudySettings(
    "tiny",
    shares=(0.1, 0.2),
    folds=(0,),
    seeds=(0,),
    noises=(0.0, 0.01),
    moves=200,
    samples=30,
    atoms=12,
    paper_atoms=16,
    rows=12,
    lasso_maps=4,
    probabilities=(0.06, 0.15),
    trials=(0, 1),
    draws=2,
    sweep_draws=5,
    weights=(0.0, 1.0, 100.0),
)


@pytest.fixture(scope="module")
def source(field, maps):
    return Source(field, maps, None, field_hash(field))


@pytest.fixture(scope="module")
def rows(source, tmp_path_factory):
    return scoreboard(source, TINY, Store(tmp_path_factory.mktemp("pieces")), workers=2)


def without_seconds(rows):
    return [{name: value for name, value in row.items() if name != "seconds"} for row in rows]


class StopsAfter(Store):
    """A store that is interrupted when so many pieces are kept."""

    def __init__(self, folder, left):
        super().__init__(folder)
        self.left = left

    def put(self, key, piece):
        if not self.left:
            raise KeyboardInterrupt
        self.left -= 1
        return super().put(key, piece)


def test_a_scoreboard_that_was_interrupted_is_the_one_that_was_not(source, rows, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        scoreboard(source, TINY, StopsAfter(tmp_path, 5), workers=1)
    kept = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert len([path for path in kept if path.suffix == ".json"]) == 5
    again = scoreboard(source, TINY, Store(tmp_path), workers=1)
    assert without_seconds(again) == without_seconds(rows)  # and two workers came to the same as one
    assert all(path.read_bytes() == content for path, content in kept.items())


def test_processes_come_to_the_same_as_threads(source, rows, tmp_path):
    with workers_at("local", 2) as hands:
        found = scoreboard(source, replace(TINY, seeds=()), Store(tmp_path), workers=hands)
    assert without_seconds(found) == without_seconds(row for row in rows if row["protocol"] == "blocked")


def test_the_scoreboard_has_every_planner_decoder_protocol_noise_and_way_of_measuring(rows):
    assert {row["planner"] for row in rows} == set(PLANNERS)
    assert {row["decoder"] for row in rows} == {"kriging", "mmse", "blend", "lasso"}
    assert {(row["protocol"], row["noise"]) for row in rows} == set(product(("blocked", "random"), TINY.noises))
    assert {row["measured"] for row in rows if row["planner"] == "Algorithm 1"} == {"legs", "stops", "sums"}
    assert all(row["length"] <= row["share"] * 1023 + 1e-6 for row in rows)


def test_figures_are_those_of_their_definitions(rows):
    for row in rows:
        assert row["relative"] > 0 and row["squared"] > 0 and row["centred"] > 0
    best = by_length(rows, "relative", protocol="blocked", noise=0.0, measured="legs", decoder="blend")
    assert all(len(points) == 2 for name, points in best.items() if name != "Algorithm 1")


def test_random_figures_come_with_the_note_that_windows_overlap(rows):
    blocked = [row for row in rows if row["protocol"] == "blocked"]
    for table in (all_rows(rows, "ppb"), means(rows, "ppb"), headline(rows, "relative", protocol="random", noise=0.0)):
        assert OVERLAP_NOTE in table.notes
        assert all(OVERLAP_NOTE in words for words in (table.csv().decode(), table.markdown(), table.text()))
    assert OVERLAP_NOTE not in means(blocked, "ppb").notes


def test_tables_keep_every_digit_and_their_columns():
    table = Table("t", ("a", "|b|"), ((1 / 3, None), ("x", 2.0)), ("note",))
    lines = [line for line in table.csv().decode().splitlines() if not line.startswith("#")]
    read = list(csv.reader(io.StringIO("\n".join(lines))))
    assert float(read[1][0]) == 1 / 3
    rows = [line for line in table.markdown().splitlines() if line.startswith("|")]
    assert {line.replace("\\|", "").count("|") for line in rows} == {3}


def test_the_winner_of_a_trial_is_algorithm_1s(source, tmp_path):
    store, asked = Store(tmp_path), Draws(0.15, 3, 12)
    (samples,) = trial(source, Variant(), 0, [asked], TINY, store, workers_of(1))
    problem = trial_given(source, Variant(), 0, TINY, store).problem
    for weights in (Weights(), Weights(path=1e-2), Weights(incoherence=5.0)):
        best = search(problem, fixed_sparsity(0.15, 3), weights, seed=TINY.seed, iterations=12)
        won = winner(samples, weights)
        assert (won["sample"], won["length"]) == (best.sample, pytest.approx(best.length_cells))


def test_larger_weights_never_raise_their_term(source, tmp_path):
    made = {one.name: one for one in figures(source, TINY, Store(tmp_path), workers=2)}
    for name in ("lambda-path", "lambda-incoh", "lambda-path-paper", "lambda-incoh-paper"):
        assert made[name].numbers["last"] <= made[name].numbers["first"] + 1e-12
    assert {"error-against-length", "error-against-length-paper", "dictionaries", "dictionaries-paper"} <= set(made)
    assert all(OVERLAP_NOTE in one.table.notes for one in made.values())


def test_errors_at_equal_length_are_compared_where_both_curves_are():
    def rows(lengths, errors):
        return [(0, 0, 0, length, 0, error, 0, 0, 0) for length, error in zip(lengths, errors, strict=True)]

    assert _lower_at_same_length(rows([1, 3], [0.2, 0.2]), rows([2, 4], [0.5, 0.5])) == pytest.approx(-0.6)
    assert math.isnan(_lower_at_same_length(rows([1, 2], [1, 1]), rows([3, 4], [1, 1])))


def test_pieces_are_told_apart_by_all_that_decides_them_and_damaged_ones_made_again(tmp_path, field):
    store = Store(tmp_path)
    assert store.put({"a": 1}, {"x": np.float64(0.1)}) == {"x": 0.1}
    assert store.get({"a": 1}) == {"x": 0.1}
    assert store.get({"a": 2}) is None
    next(tmp_path.iterdir()).write_text("{")
    assert store.get({"a": 1}) is None
    assert len(field_hash(field)) == len(code_hash()) == 16
    assert {"sparsor", "numpy", "python"} <= set(versions())


def test_the_whole_study_writes_the_same_bytes_again_and_says_what_made_it(source, tmp_path, monkeypatch):
    monkeypatch.setattr(studying, "_sources", lambda _paths: {"made": source})
    tiny = replace(TINY, shares=(0.1,), noises=(0.0,))
    pages, files = [], []
    for turn in ("one", "two"):
        folder = tmp_path / turn
        where = (folder, folder / "results.md")
        request = StudyRequest((), *where, "sparsor study", pieces=folder / "pieces", settings=tiny)
        done = study(request, workers=2)
        pages.append(done.page.read_text())
        files.append({path.name: path.read_bytes() for path in done.files if path.name != "seconds.csv"})
    assert files[0] == files[1]
    page = pages[0]
    assert "Written by `sparsor study`" in page
    assert source.digest in page and f"seed {TINY.seed}" in page and f"numpy {np.__version__}" in page
    assert page.count(OVERLAP_NOTE) >= 3
    for name in ("scoreboard.png", "example.png", "against-ipp.png", "dictionaries-paper.png"):
        assert f"made/{name}" in page
        assert files[0][name].startswith(b"\x89PNG")
    assert "no online optimisation" in page
