"""What a run leaves out because this machine lacks it, and that it says so."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from browser import BROWSER, NAMES

if TYPE_CHECKING:
    import pytest

SITL = "SPARSOR_SITL_URL"
NOTICES = {
    "sitl": f"{SITL} names no autopilot: the tests marked 'sitl' are left out (docs/sitl.md says how to run them)",
    "browser": f"there is no {' or '.join(NAMES)}: the tests marked 'browser' are left out",
}


def missing() -> list[str]:
    """The marks of the tests that cannot run here."""
    there = {"sitl": os.environ.get(SITL), "browser": BROWSER}
    return [mark for mark, found in there.items() if not found]


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", f"sitl: flies the autopilot that {SITL} names; left out when it names none")
    config.addinivalue_line("markers", f"browser: opens a page in {', '.join(NAMES)}; left out where there is none")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    left_out = [item for item in items if any(item.get_closest_marker(mark) for mark in missing())]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    for mark in missing():
        terminalreporter.write_line(NOTICES[mark])
