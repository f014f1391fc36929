"""A mission planned from Python: what the sidecar promises, and folders written whole or not at all."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sparsor.core.metrics import centred_relative_error
from sparsor.design import lasso
from sparsor.errors import BudgetError, MissionError, OutputError
from sparsor.journeys.folder import check_folder, write_mission
from sparsor.journeys.planning import plan_mission
from sparsor.mission.sidecar import read_sidecar
from sparsor.mission.specification import AreaSection, OutputSection, changed, specification

BOX = (51.50, 25.27, 51.53, 25.30)
SEARCH = {"planner": "monte-carlo", "iterations": 30}
SPEC = specification({"name": "m", "area": {"bbox": BOX}, "search": SEARCH}, base=Path("/"))


def with_search(**settings):
    return changed(SPEC, {"search": settings}, base=Path("/"))


def with_box(box):
    return changed(SPEC, {"area": {"bbox": box}}, base=Path("/"))


@pytest.fixture(scope="module")
def mission():
    return plan_mission(SPEC, workers=2)


def test_planning_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plan_mission(with_search(iterations=10))
    assert list(tmp_path.iterdir()) == []


def test_the_winner_costs_what_its_terms_say(mission):
    found, weights = mission.candidate, mission.weights
    terms = weights.valid * found.error + weights.path * found.length_cells + weights.incoherence * found.incoherence
    assert found.cost == pytest.approx(terms)
    assert set(np.flatnonzero(found.phi.any(axis=0))) == set(found.stops)
    assert mission.coverage_fraction <= 0.10


def test_the_sidecar_alone_gives_the_expected_error_again(mission, tmp_path):
    written = write_mission(mission, tmp_path / "m", preview=False)
    sidecar = read_sidecar(written["m.npz"])
    model = sidecar.model
    maps = model.validation - model.mean
    codes = lasso(sidecar.phi @ model.dictionary, maps @ sidecar.phi.T.astype(float), sidecar.lasso_weight)
    estimate = codes @ model.dictionary.T + model.mean
    error = float(centred_relative_error(model.validation, estimate).mean())
    assert mission.prior.widening * error == pytest.approx(sidecar.expected["relative_error"], rel=1e-3)


def test_more_iterations_never_cost_more():
    costs = [plan_mission(with_search(iterations=count)).candidate.cost for count in (5, 20, 60)]
    assert costs == sorted(costs, reverse=True)


def test_the_number_of_workers_makes_no_difference(mission):
    alone = plan_mission(SPEC, workers=1)
    assert alone.plan == mission.plan
    assert np.array_equal(alone.candidate.phi, mission.candidate.phi)
    assert alone.expected_relative_error == mission.expected_relative_error


def test_a_budget_that_no_route_meets_is_an_error():
    with pytest.raises(BudgetError, match="the shortest found"):
        plan_mission(with_search(budget="5m"))


def test_a_full_disk_leaves_what_was_there(mission, tmp_path, monkeypatch):
    def full(_descriptor):
        raise OSError(28, "No space left on device")

    folder = tmp_path / "deep" / "m"
    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OutputError, match="No space left"):
        write_mission(mission, folder, preview=False)
    assert list(tmp_path.iterdir()) == []


def test_what_an_earlier_mission_made_goes_and_a_strangers_files_stay(mission, tmp_path):
    with_kml = SPEC.model_copy(update={"output": OutputSection(export=("kml",)), "name": "before"})
    write_mission(replace(mission, specification=with_kml), tmp_path, preview=False)
    assert (tmp_path / "before.kml").is_file()
    (tmp_path / "m.kml").write_text("a stranger's")
    written = write_mission(mission, tmp_path, preview=False)
    assert {path.name for path in tmp_path.iterdir()} == {*written, "m.kml"}


def test_a_file_that_is_read_is_never_written_over(tmp_path):
    area = tmp_path / "site.geojson"
    spec = SPEC.model_copy(
        update={"name": "site", "area": AreaSection(file=area), "output": OutputSection(export=("geojson",))}
    )
    with pytest.raises(MissionError, match="is read for this mission and would be written over"):
        check_folder(spec, tmp_path, force=True)


def test_the_box_that_is_said_to_fit_is_flyable():
    study = plan_mission(with_box((51.30, 25.10, 51.66, 25.42)), workers=2)
    assert not study.flyable
    east_km, north_km = (
        float(side) for side in re.search(r"box of ([0-9.]+) x ([0-9.]+) km", study.warnings[0]).groups()
    )
    east_deg, north_deg = east_km / 100.8, north_km / 110.8
    small = plan_mission(with_box((51.5, 25.25, 51.5 + east_deg, 25.25 + north_deg)), workers=2)
    # Another box has another route: near the advised size it is within a tenth of what fits.
    assert small.flight_time_s < 1.1 * small.usable_s


def test_which_folders_are_free(mission, tmp_path):
    folder = tmp_path / "m"
    check_folder(SPEC, folder, force=False)
    folder.mkdir()
    check_folder(SPEC, folder, force=False)
    write_mission(mission, folder, preview=False)
    check_folder(SPEC, folder, force=False)
    another = with_search(seed=1)
    with pytest.raises(MissionError, match="--force"):
        check_folder(another, folder, force=False)
    check_folder(another, folder, force=True)
    (folder / "mission.toml").write_text("name = ")
    with pytest.raises(MissionError, match="--force"):
        check_folder(SPEC, folder, force=False)
    (tmp_path / "file").write_text("")
    for blocked in ("file", "file/below"):
        with pytest.raises(MissionError, match="is a file"):
            check_folder(SPEC, tmp_path / blocked, force=True)
