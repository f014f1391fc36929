"""The virtual environment that `scripts/demo` and `scripts/test` make for themselves; standard library only."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDER = Path(os.environ.get("SPARSOR_VENV", ROOT / ".venv"))
LEAST = (3, 11)
# `pip install --group` is newer than the pip that comes with Python 3.11.
PIP = "pip>=25.1"


def require_python() -> None:
    """Go on with Python 3.11 or newer: this one, else one found on the path, else say what is missing."""
    if sys.version_info >= LEAST:
        return
    for minor in range(14, 10, -1):
        if found := shutil.which(f"python3.{minor}"):
            os.execv(found, [found, *sys.argv])
    sys.exit(f"sparsor needs Python 3.11 or newer; this is {sys.version.split()[0]}, and no newer one is on the path")


def python(*groups: str) -> Path:
    """Return the environment's Python with sparsor and the dependency groups installed; quick when nothing changed."""
    executable = FOLDER / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    state = hashlib.sha256((ROOT / "pyproject.toml").read_bytes() + sys.version.encode()).hexdigest()
    mark = FOLDER / f"ready-{'-'.join(groups) or 'base'}"
    if mark.is_file() and mark.read_text() == state and executable.is_file():
        return executable
    print(f"setting up {FOLDER} (once; a few minutes)", flush=True)
    if Path(sys.prefix) != FOLDER.resolve():  # run by its own Python it is there, and cannot be written over
        venv.create(FOLDER, with_pip=True, clear=not executable.is_file())
    run(executable, "-m", "pip", "install", "--quiet", "--upgrade", PIP)
    chosen = [word for group in groups for word in ("--group", group)]
    run(executable, "-m", "pip", "install", "--quiet", "--editable", str(ROOT), *chosen)
    mark.write_text(state)
    return executable


def run(*command: object) -> None:
    """Run a command in the project's folder; end with its exit code when it fails."""
    done = subprocess.run([str(word) for word in command], cwd=ROOT, check=False)
    if done.returncode:
        sys.exit(done.returncode)
