"""The vehicles of these tests send heartbeats four times a second: no need to wait a second for another."""

from __future__ import annotations

import pytest

from sparsor.link import vehicles


@pytest.fixture(autouse=True)
def heartbeats_are_quick(monkeypatch):
    monkeypatch.setattr(vehicles, "OTHERS_S", 0.4)
