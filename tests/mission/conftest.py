"""Let the tests here import the helpers in tests/, and start each MAVSDK importer once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from heartbeat_endpoint import plan_importer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@pytest.fixture(scope="session")
def ardupilot_importer() -> Iterator[Callable[[str], Any]]:
    with plan_importer("ardupilot") as importer:
        yield importer


@pytest.fixture(scope="session")
def px4_importer() -> Iterator[Callable[[str], Any]]:
    with plan_importer("px4") as importer:
        yield importer


@pytest.fixture
def importers(
    ardupilot_importer: Callable[[str], Any], px4_importer: Callable[[str], Any]
) -> dict[str, Callable[[str], Any]]:
    return {"ardupilot": ardupilot_importer, "px4": px4_importer}
