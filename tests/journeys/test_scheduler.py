"""Missions and models are the same bytes whoever worked on them: threads, processes, processes that died."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin

from sparsor.core.schedulers import workers_at
from sparsor.journeys.folder import write_mission
from sparsor.journeys.learning import LearnRequest, learn_from_fields
from sparsor.journeys.planning import plan_mission
from sparsor.mission.specification import changed, specification

BOX = (51.50, 25.27, 51.53, 25.30)
SPEC = specification({"name": "m", "area": {"bbox": BOX}, "search": {"iterations": 600}}, base=Path("/"))
REFINED = changed(SPEC, {"search": {"planner": "refined", "iterations": 40_000}}, base=Path("/"))


@pytest.fixture(scope="module")
def one():
    with workers_at("local", 1) as hands:
        yield hands


@pytest.fixture(scope="module")
def two():
    with workers_at("local", 2) as hands:
        yield hands


def written(mission, folder):
    paths = write_mission(mission, folder, preview=False)
    return {name: path.read_bytes() for name, path in paths.items()}


@pytest.mark.parametrize("spec", [SPEC, REFINED], ids=["monte-carlo", "refined"])
def test_a_mission_is_the_same_whoever_searched_for_it(spec, one, two, tmp_path):
    by_threads = written(plan_mission(spec, workers=2), tmp_path / "threads")
    assert written(plan_mission(spec, workers=one), tmp_path / "one") == by_threads
    shares = []
    found = plan_mission(spec, workers=two, progress=lambda _task, done, total: shares.append(done / total))
    assert written(found, tmp_path / "two") == by_threads
    assert len(shares) > 3
    assert shares[-1] == max(shares) == 1


@pytest.mark.parametrize("spec", [SPEC, REFINED], ids=["monte-carlo", "refined"])
def test_a_mission_is_the_same_when_a_worker_is_killed_in_the_middle(spec, two, tmp_path):
    left = two.processes()

    def kill(_task, done, total):
        if left and done > total * (0.6 - 0.2 * len(left)):
            os.kill(left.pop(), signal.SIGKILL)

    found = plan_mission(spec, workers=two, progress=kill)
    assert not left
    assert written(found, tmp_path / "two") == written(plan_mission(spec, workers=2), tmp_path / "threads")


def test_a_search_for_a_time_ends_with_processes_too(two):
    spec = changed(SPEC, {"search": {"time_s": 0.5}}, base=Path("/"))
    assert plan_mission(spec, workers=two).candidate.stops.size > 1


def test_a_model_is_the_same_whoever_learned_it(one, two, tmp_path):
    row, column = np.mgrid[:88, :88]
    values = 5 + np.sin(row / 7) * np.cos(column / 9) + np.sin((row + 2 * column) / 23)
    field = tmp_path / "field.tif"
    placed = {"crs": "EPSG:4326", "transform": from_origin(51.0, 26.0, 0.01, 0.01)}
    with rasterio.open(field, "w", driver="GTiff", height=88, width=88, count=1, dtype="float32", **placed) as file:
        file.write(values.astype(np.float32), 1)
    models = [tmp_path / f"{name}.npz" for name in ("threads", "one", "two")]
    for path, hands in zip(models, (2, one, two), strict=True):
        learn_from_fields(LearnRequest((field,), atoms=20), path, workers=hands)
    assert len({path.read_bytes() for path in models}) == 1
