"""`sparsor simulate` as people run it: it says where to connect, is a vehicle, and ends by Ctrl-C."""

from __future__ import annotations

import re
import signal
import subprocess
import sys

import pytest
import typer
from pymavlink import mavutil
from typer.testing import CliRunner

from sparsor.cli import simulate as command
from sparsor.cli.simulate import simulate

app = typer.Typer()
app.command()(simulate)
PROGRAM = "import typer; from sparsor.cli.simulate import simulate; typer.run(simulate)"
HOME = ("--home", "51.51", "25.28")


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_it_is_a_vehicle_until_it_is_interrupted(autopilot):
    listen = ("--listen", "tcp:0", "--listen", "udp:0")
    options = [*HOME, "--autopilot", autopilot, *listen, "--speedup", "20", "--system", "7"]
    with subprocess.Popen([sys.executable, "-c", PROGRAM, *options], stdout=subprocess.PIPE, text=True) as running:
        try:
            lines = [running.stdout.readline() for _ in range(3)]
            assert "not flight dynamics" in lines[0]
            (port,) = re.findall(r"tcpout://127.0.0.1:(\d+)", lines[2])
            assert re.search(r"udpout://127.0.0.1:\d+", lines[1])
            client = mavutil.mavlink_connection(f"tcp:127.0.0.1:{port}")
            heartbeat = client.wait_heartbeat(timeout=20)
            assert heartbeat.autopilot == {"ardupilot": 3, "px4": 12}[autopilot]
            assert client.target_system == 7
            value = client.recv_match(type="NAMED_VALUE_FLOAT", blocking=True, timeout=20)
            assert 0 < value.value < 80
            client.close()
            running.send_signal(signal.SIGINT)
            assert running.wait(timeout=20) == 0
        finally:
            running.kill()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--listen", "14550"), "--listen 14550: give udp:PORT, tcp:PORT or udp:HOST:PORT"),
        (("--listen", "udp:70000"), "--listen udp:70000: give"),
        (("--listen", "udp:0", "--listen", "udpin://0.0.0.0:0"), "one udp port is enough"),
        (("--autopilot", "betaflight"), "known are ardupilot, px4"),
        (("--vehicle", "zeppelin"), "unknown vehicle 'zeppelin'"),
        (("--sensor-range", "70", "10"), "LO below HI"),
        (("--speedup", "0"), "a speed-up of 0"),
        (("--seed", "-1"), "seed -1"),
        (("--system", "0"), "system id 0"),
        (("--home", "-70", "40"), "DOMAIN|domain|outside"),
    ],
)
def test_what_is_wrong_is_said(options, sentence):
    ran = CliRunner().invoke(app, [*HOME, *options])
    assert ran.exit_code == 2, ran.output
    assert re.search(sentence, ran.output.replace("\n", " "))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("udp:14550", {"udp": ("127.0.0.1", 14550)}),
        ("udpin://0.0.0.0:14540", {"udp": ("0.0.0.0", 14540)}),
        ("tcp:192.168.1.5:5760", {"tcp": ("192.168.1.5", 5760)}),
    ],
)
def test_addresses_as_people_type_them(text, found):
    assert command._addresses([text]) == found
