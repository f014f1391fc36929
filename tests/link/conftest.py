"""The vehicles of these tests send heartbeats four times a second and more: no need to wait a second for another."""

from __future__ import annotations

import pytest

from sparsor.link import vehicles
from sparsor.link.flights import flying


@pytest.fixture(autouse=True)
def heartbeats_are_quick(monkeypatch):
    monkeypatch.setattr(vehicles, "OTHERS_S", 0.4)
    monkeypatch.setattr(flying, "SETTLE_S", 0.4)
