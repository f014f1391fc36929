"""Compiled functions in a cache that several processes write."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

SOURCES = Path(__file__).parents[2] / "src" / "sparsor"
# The same function, compiled first by one process and second by the other.
COMPILE = """
import sys
from sparsor.core.compiled import njit

def other(x):
    return x - 1

def twice(x):
    return 2 * x

if sys.argv[1] == "second":
    njit(other)(1)
compiled = njit(twice)
assert compiled(4) == 8
print(next(iter(compiled.overloads.values())).fndesc.mangled_name)
"""


def test_no_two_processes_give_a_function_one_name():
    names = {
        subprocess.run(
            [sys.executable, "-c", COMPILE, order], capture_output=True, text=True, check=True
        ).stdout.strip()
        for order in ("first", "first", "second", "second")
    }
    assert len(names) == 4
    assert all(len(re.findall(r"\d{30,}", name)) == 1 for name in names)


def test_nothing_is_compiled_by_another_name():
    for path in SOURCES.rglob("*.py"):
        if path.name != "compiled.py":
            assert not re.search(r"(from|import) numba\b", path.read_text(encoding="utf-8")), path
