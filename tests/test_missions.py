"""The missions that are committed reproduce themselves, and their plans have no faults."""

from __future__ import annotations

from pathlib import Path

import pytest

from sparsor.journeys.checking import check_plans
from sparsor.journeys.planning import plan_mission
from sparsor.mission import plan_faults, read_plan
from sparsor.mission.sidecar import content_hash, read_sidecar
from sparsor.mission.specification import read_specification

MISSIONS = Path(__file__).parents[1] / "missions"


@pytest.mark.parametrize("name", ["doha", "gulf", "doha-shore"])
def test_a_committed_mission_reproduces_itself(name):
    folder = MISSIONS / name
    sidecar = read_sidecar(folder / f"{name}.npz")
    mission = plan_mission(read_specification(folder / "mission.toml"))
    # Another processor may round otherwise, and the search then take another turn to a route about as good.
    assert mission.candidate.cost == pytest.approx(sidecar.expected["cost"], rel=0.05)
    assert mission.expected_relative_error == pytest.approx(sidecar.expected["relative_error"], rel=0.05)


@pytest.mark.parametrize("name", ["doha", "gulf", "doha-sea", "doha-shore"])
def test_committed_plans_are_what_their_sidecar_remembers_and_have_no_faults(name):
    folder = MISSIONS / name
    plans = read_sidecar(folder / f"{name}.npz").plans
    assert {one.name for one in folder.glob("*.plan")} == plans.keys()
    for file, remembered in plans.items():
        assert content_hash((folder / file).read_bytes()) == remembered
        assert not plan_faults(read_plan(folder / file))
    assert not check_plans(folder).faults
