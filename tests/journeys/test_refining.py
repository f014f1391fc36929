"""A mission planned with the refined search."""

from __future__ import annotations

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
    plain = plan_mission(asked(iterations=60), workers=2)
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


def test_each_planner_has_its_own_number_of_iterations():
    spec = asked(planner="refined")
    assert spec.search.iterations == DEFAULT_ITERATIONS
    assert changed(asked(), {"search": {"planner": "refined"}}, base=Path("/")).search.iterations == DEFAULT_ITERATIONS
    assert changed(spec, {"search": {"planner": "monte-carlo"}}, base=Path("/")).search.iterations == 4000
    assert changed(spec, {"search": {"seed": 3}}, base=Path("/")).search.iterations == DEFAULT_ITERATIONS


@pytest.mark.parametrize("search", [{"paper": True}, {"lambda_path": 1.0}])
def test_without_a_budget_there_is_nothing_to_refine(search):
    with pytest.raises(MissionError, match="refined planner searches within a budget"):
        asked(planner="refined", **search)
