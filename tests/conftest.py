"""What a run leaves out because this machine lacks it, and that it says so; which examples property tests draw."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from hypothesis import HealthCheck, settings

from browser import BROWSER, NAMES

if TYPE_CHECKING:
    import pytest

# Who runs the tests learns whether this code works here, not what luck finds, nor how busy the machine is.
_ANY_TIME = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("same", derandomize=True, database=None, **_ANY_TIME)
settings.register_profile("new", **_ANY_TIME)
SITL = "SPARSOR_SITL_URL"
NOTICES = {
    "sitl": f"{SITL} names no autopilot: the tests marked 'sitl' are left out (docs/sitl.md says how to run them)",
    "browser": f"there is no {' or '.join(NAMES)}: the tests marked 'browser' are left out",
}


def missing() -> list[str]:
    """The marks of the tests that cannot run here."""
    there = {"sitl": os.environ.get(SITL), "browser": BROWSER}
    return [mark for mark, found in there.items() if not found]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--examples", type=int, metavar="K", help="let property tests draw new examples, K times as many as usual"
    )


def pytest_configure(config: pytest.Config) -> None:
    settings.load_profile("new" if config.getoption("examples") else "same")
    config.addinivalue_line("markers", f"sitl: flies the autopilot that {SITL} names; left out when it names none")
    config.addinivalue_line("markers", f"browser: opens a page in {', '.join(NAMES)}; left out where there is none")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    left_out = [item for item in items if any(item.get_closest_marker(mark) for mark in missing())]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]
    for test in {getattr(item, "function", None) for item in items if config.getoption("examples")}:
        if hasattr(test, "hypothesis"):
            used = test._hypothesis_internal_use_settings
            more = used.max_examples * config.getoption("examples")
            test._hypothesis_internal_use_settings = settings(used, max_examples=more)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    for mark in missing():
        terminalreporter.write_line(NOTICES[mark])
