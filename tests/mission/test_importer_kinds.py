"""MAVSDK's own importer takes the plans of every kind of vehicle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from mission_strategies import AUTOPILOT_NAMES, KINDS, example_plan
from sparsor.mission import plan_bytes
from sparsor.vehicle import SteadyWind, load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.mark.parametrize("hold_s", [0, 6])
@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
@pytest.mark.parametrize("kind", KINDS)
def test_every_item_arrives(
    kind: str, autopilot: str, hold_s: float, importers: dict[str, Callable[[str], Any]]
) -> None:
    plan = example_plan(autopilot, vehicle=load_vehicle(kind), hold_s=hold_s, wind=SteadyWind(3, 310))
    got = list(importers[autopilot](plan_bytes(plan).decode()).mission_items)
    if autopilot == "ardupilot":  # MAVSDK puts home first
        got.pop(0)
    for item, received in zip(plan.items, got, strict=True):
        assert (received.command, received.frame) == (item.command, item.frame)
        if item.has_position:
            assert (received.x, received.y) == (round(item.lat_deg * 1e7), round(item.lon_deg * 1e7))
        params = [received.param1, received.param2, received.param3, received.param4]
        assert params == pytest.approx(list(item.params[:4]), nan_ok=True)
