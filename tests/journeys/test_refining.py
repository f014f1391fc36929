"""A mission planned with the refined search."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sparsor.cli.summary import mission_rows
from sparsor.design.refined import DEFAULT_ITERATIONS
from sparsor.errors import MissionError
from sparsor.journeys.folder import write_mission
from sparsor.journeys.planning import plan_mission
from sparsor.mission.sidecar import read_sidecar
from sparsor.mission.specification import changed, specification

BOX = (51.50, 25.27, 51.53, 25.30)
REFINED = {"planner": "refined", "iterations": 3000}


def asked(**search):
    return specification({"name": "m", "area": {"bbox": BOX}, "search": search}, base=Path("/"))


@pytest.fixture(scope="module")
def mission():
    return plan_mission(asked(**REFINED), workers=2)


def test_the_plan_is_within_the_default_budget_and_expects_less_error_than_algorithm_1(mission):
    assert mission.coverage_fraction <= 0.10
    plain = plan_mission(asked(planner="monte-carlo", iterations=60), workers=2)
    assert mission.expected_relative_error < 0.7 * plain.expected_relative_error_cells


def test_the_sidecar_s_phi_measures_every_cell_flown_over(mission, tmp_path):
    sidecar = read_sidecar(write_mission(mission, tmp_path / "m", preview=False)["m.npz"])
    assert (sidecar.phi.sum(axis=1) == 1).all()
    measured = np.flatnonzero(sidecar.phi.any(axis=0))
    assert measured.size == mission.cells_flown_over
    assert set(sidecar.stops) <= set(measured)


def test_the_plan_is_the_same_for_any_number_of_workers(mission):
    again = plan_mission(asked(**REFINED), workers=1)
    assert again.candidate.stops.tolist() == mission.candidate.stops.tolist()


def test_the_summary_does_not_speak_of_sums(mission):
    rows = dict(mission_rows(mission, details=True))
    assert "cells flown over" in rows["expected error"]
    assert "sums" not in rows["expected error"]
    assert "sample" not in rows


def test_the_sensor_that_it_is_planned_for_is_in_the_sidecar(mission, tmp_path):
    sidecar = read_sidecar(write_mission(mission, tmp_path / "m", preview=False)["m.npz"])
    assert sidecar.sensor is not None
    assert (sidecar.sensor.t90_s, sidecar.sensor.noise_sd) == (30.0, 5.0)  # the packaged one, where nothing is said


def test_an_interrupted_search_says_so(monkeypatch):
    from sparsor.journeys import planning

    search = planning.search_refined
    monkeypatch.setattr(planning, "search_refined", lambda *a, **k: replace(search(*a, **k), interrupted=True))
    assert "interrupted" in plan_mission(asked(**REFINED), workers=2).warnings[0]


def test_each_planner_has_its_own_number_of_iterations():
    spec = asked()
    assert (spec.search.planner, spec.search.iterations) == ("refined", DEFAULT_ITERATIONS)
    plain = changed(spec, {"search": {"planner": "monte-carlo"}}, base=Path("/"))
    assert (plain.search.iterations, plain.search.rows) == (4000, 35)
    again = changed(plain, {"search": {"planner": "refined"}}, base=Path("/"))
    assert again == spec
    assert changed(spec, {"search": {"seed": 3}}, base=Path("/")).search.iterations == DEFAULT_ITERATIONS


@pytest.mark.parametrize("search", [{"paper": True}, {"lambda_path": 0.0}, {"rows": 20}, {"probability": 0.02}])
def test_who_gives_an_option_of_algorithm_1_gets_it(search):
    assert asked(**search).search.planner == "monte-carlo"
    found = changed(asked(budget="25min", seed=3), {"search": search}, base=Path("/")).search
    assert (found.planner, found.iterations, found.seed) == ("monte-carlo", 4000, 3)
    with pytest.raises(MissionError, match=f"{next(iter(search))}: the refined planner does not know"):
        asked(planner="refined", **search)
