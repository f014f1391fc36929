"""The commands as processes of their own: start-up, a terminal's progress bar, Ctrl-C."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

BOX = ("--bbox", "51.50", "25.27", "51.53", "25.30")
HEAVY = ("mavsdk", "rasterio", "matplotlib", "numba", "sklearn", "scipy", "pyproj", "shapely", "pydantic", "numpy")


def start(*words, **options):
    if sys.platform != "win32":  # a shell's background job, as these tests may be, leaves Ctrl-C ignored
        options["preexec_fn"] = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)
    command = [sys.executable, "-c", "from sparsor.cli.main import generate_mission as run; run()", *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, **options)


def test_help_needs_nothing_heavy():
    code = (
        "import sys; from sparsor.cli import main\n"
        "sys.argv = ['generate-mission', '--help']\n"
        "try: main.generate_mission()\n"
        f"except SystemExit as end: print(end.code, sorted(set({HEAVY}) & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "--bbox" in done.stdout
    # pydantic comes with typer.
    assert done.stderr.split("\n")[0] in ("0 []", "0 ['pydantic']")


def test_the_installed_commands_answer():
    done = subprocess.run([sys.executable, "-m", "sparsor", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("sparsor ")
    usage = subprocess.run([sys.executable, "-m", "sparsor", "fly-away"], capture_output=True, text=True, check=False)
    assert usage.returncode == 2
    assert "fly-away" in usage.stderr


def test_a_pipe_gets_json_and_nothing_else(tmp_path):
    process = start(*BOX, "--iterations", "20", "--json", "--name", "m", cwd=tmp_path, stderr=subprocess.PIPE)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert json.loads(out)["plans"] == [str(Path("missions/m/m.plan"))]
    assert err == b""  # no bar on a pipe; the warnings are in the object


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals, and Ctrl-C reaches the whole console")
def test_ctrl_c_in_the_middle_leaves_the_old_files(tmp_path):
    import pty

    folder = tmp_path / "missions" / "m"
    folder.mkdir(parents=True)
    old = {name: f"old {name}".encode() for name in ("mission.toml", "m.plan", "m.npz", "preview.png", "m.kml")}
    for name, content in old.items():
        (folder / name).write_bytes(content)
    ours, theirs = pty.openpty()
    words = ("--planner", "monte-carlo", "--iterations", "200000", "--name", "m", "--force")
    process = start(*BOX, *words, cwd=tmp_path, stderr=theirs)
    os.close(theirs)
    assert b"searching" in read_until(ours, b"searching")  # the progress bar of a terminal
    process.send_signal(signal.SIGINT)
    said = read_until(ours, b"interrupted: what was there before is still there")
    assert b"what was there before is still there" in said
    assert process.wait(timeout=30) == 130
    assert process.stdout is not None
    assert process.stdout.read() == b""
    process.stdout.close()
    os.close(ours)
    assert b"Traceback" not in said
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == old
    assert [path.name for path in tmp_path.iterdir()] == ["missions"]


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals, and Ctrl-C reaches the whole console")
def test_ctrl_c_ends_the_refined_search_with_the_best_so_far(tmp_path):
    import pty

    ours, theirs = pty.openpty()
    process = start(*BOX, "--iterations", "50000000", "--name", "m", cwd=tmp_path, stderr=theirs)
    os.close(theirs)
    assert b"refining" in read_until(ours, b"refining")
    process.send_signal(signal.SIGINT)
    said = read_until(ours, b"warning: The search was interrupted: the route is the best")
    assert b"the route is the best" in said
    assert b"Traceback" not in said
    while read_until(ours, b"warning"):
        pass
    assert process.wait(timeout=60) == 0
    process.stdout.close()
    os.close(ours)
    assert (tmp_path / "missions" / "m" / "m.plan").is_file()


def read_until(terminal, words):
    said = b""
    while words not in said:
        try:
            part = os.read(terminal, 4096)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        said += part
    return said
