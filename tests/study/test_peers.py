"""Planners by others, run through their own interfaces: PySensors is in the environment of the tests."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from sparsor.core.metrics import squared_error
from sparsor.design import Budget, unit_legs
from sparsor.errors import InputError
from sparsor.study.decoding import validation_error
from sparsor.study.observing import readings
from sparsor.study.peers import Peers, best_kind, find_peers, own_python, peer_routes
from sparsor.study.scoreboard import PLANNERS, Source, scoreboard
from sparsor.study.settings import StudySettings
from sparsor.study.store import Store, field_hash

LEGS = unit_legs((32, 32))
PY_SENSORS = ("PySensors QR", "PySensors CCQR")


@pytest.fixture(scope="module")
def peers():
    assert own_python() == sys.executable
    return find_peers(sys.executable, steps=3)


@pytest.fixture(scope="module")
def routes(peers, case):
    return peer_routes(peers, case.sets.training, LEGS, [Budget(102.0, "distance"), Budget(204.6, "distance")])


def program(path, says):
    path.write_text(f"#!/bin/sh\necho '{says}'\n")
    path.chmod(0o755)
    return str(path)


def test_a_python_says_what_it_has(peers):
    assert set(PY_SENSORS) <= set(peers.planners)
    assert set(peers.versions) <= {"sgptools", "python-sensors"}


@pytest.mark.skipif(sys.platform == "win32", reason="a program that is a shell script")
def test_a_python_without_planners_and_what_is_no_python_are_refused(tmp_path):
    with pytest.raises(InputError, match="neither sgptools nor python-sensors"):
        find_peers(program(tmp_path / "bare", "{}"))
    with pytest.raises(InputError, match="cannot be started"):
        find_peers(str(tmp_path / "missing"))


@pytest.mark.parametrize(("file", "says"), [("ends", "cannot do this"), ("gone", "No such file")])
@pytest.mark.skipif(sys.platform == "win32", reason="a program that is a shell script")
def test_planners_that_fail_are_named_with_what_they_said(case, tmp_path, file, says):
    (tmp_path / "ends").write_text("#!/bin/sh\necho cannot do this >&2\nexit 3\n")
    (tmp_path / "ends").chmod(0o755)
    broken = Peers(str(tmp_path / file), {"python-sensors": "0"})
    with pytest.raises(InputError, match=f"{file}.*{says}"):
        peer_routes(broken, case.sets.training, LEGS, [Budget(102.0, "distance")])


def test_their_routes_keep_the_budget_and_visit_cells_once(routes):
    assert {name for name, _ in routes} == set(PY_SENSORS)
    for (_, limit), kinds in routes.items():
        assert len(kinds) >= 2
        for one in kinds:
            assert LEGS.path_length(one.stops) <= limit
            assert len(set(one.stops.tolist())) == one.stops.size > 3
            assert one.seconds > 0


def test_the_validation_maps_choose_the_kind(routes, case):
    kinds = routes["PySensors QR", 102.0]
    best = best_kind(kinds, case, LEGS, "legs", sd=0.0, t90_s=0.0, by=squared_error)
    errors = [validation_error(case, readings(LEGS, one.stops, "legs", sd=0.0), "blend") for one in kinds]
    assert np.array_equal(best.stops, kinds[int(np.argmin(errors))].stops)


def test_they_stand_on_the_scoreboard(field, maps, peers, tmp_path):
    settings = StudySettings(
        "tiny", shares=(0.1,), folds=(0,), seeds=(), noises=(0.0, 0.01), moves=50, samples=5, atoms=8, rows=8,
        lasso_maps=2,
    )  # fmt: skip
    source, store = Source(field, maps, None, field_hash(field)), Store(tmp_path)
    rows = scoreboard(source, settings, store, peers=peers)
    assert {row["planner"] for row in rows} == {*PLANNERS, *PY_SENSORS}
    assert all(row["length"] <= 102.3 for row in rows)
    kept = scoreboard(source, settings, store, peers=replace(peers, python="not started again"))
    assert kept == rows
    without = scoreboard(source, settings, store)
    assert without == [row for row in rows if row["planner"] in PLANNERS]
