"""`sparsor record` as people end it: Ctrl-C, in the background too, and a request to terminate."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time

import pytest

from link.flight_rig import practice, url_of

PROGRAM = "import sys; from sparsor.cli.main import main; sys.argv[0] = 'sparsor'; main()"


def ignoring_ctrl_c():
    """What a shell does to a program that it starts in the background."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for one process")
@pytest.mark.parametrize(
    ("before", "sent"),
    [(None, signal.SIGTERM), (ignoring_ctrl_c, signal.SIGINT)],
    ids=["terminate", "Ctrl-C in the background, twice"],
)
def test_a_signal_ends_a_recording_with_its_summary(tmp_path, before, sent):
    path = tmp_path / "a.tlog"
    with practice(speedup=5) as server:
        words = [sys.executable, "-c", PROGRAM, "record", "--connect", url_of(server), "-o", str(path), "--json"]
        with subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=before
        ) as running:
            try:
                deadline_s = time.monotonic() + 60
                while not (path.is_file() and path.stat().st_size > 2000):
                    assert time.monotonic() < deadline_s
                    assert running.poll() is None
                    time.sleep(0.02)
                running.send_signal(sent)
                running.send_signal(sent)
                out, err = running.communicate(timeout=60)
            finally:
                running.kill()
    assert (running.returncode, err) == (0, "")
    assert json.loads(out)["received"] > 0
