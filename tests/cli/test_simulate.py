"""`sparsor simulate` as people run it: it says where to connect, is a vehicle, and ends by Ctrl-C."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from pymavlink import mavutil
from typer.testing import CliRunner

from sparsor.cli import simulate as command
from sparsor.cli.simulate import simulate
from sparsor.mission.sidecar import read_sidecar

app = typer.Typer()
app.command()(simulate)
PROGRAM = "import typer; from sparsor.cli.simulate import simulate; typer.run(simulate)"
HOME = ("--home", "51.51", "25.28")
DOHA = Path(__file__).parents[2] / "missions" / "doha"


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


def test_a_mission_folder_is_all_that_it_takes(tmp_path):
    truth = tmp_path / "truth.nc"
    options = ["--mission", str(DOHA), "--listen", "tcp:0", "--send-to", "udp:127.0.0.1:9", "--truth", str(truth)]
    options += ["--wind", "5", "90", "--gusts", "1", "--gps-outage", "60:90", "--gps-outage", "200:210"]
    with subprocess.Popen([sys.executable, "-c", PROGRAM, *options], stdout=subprocess.PIPE, text=True) as running:
        try:
            lines = [running.stdout.readline() for _ in range(6)]
            assert "ArduCopter" in lines[0]
            home = read_sidecar(DOHA / "doha.npz").home
            assert f"{home[0]:.4f} {home[1]:.4f}" in lines[0]
            assert "sends to 127.0.0.1:9; connect there to udpin://0.0.0.0:9" in lines[2]
            assert str(truth) in lines[3]
            assert "t90 30 s, noise 5 ppb" in lines[4]
            assert re.search(rf"sparsor fly {re.escape(str(DOHA))} --connect tcpout://127.0.0.1:\d+$", lines[5].strip())
            assert truth.stat().st_size > 1000
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
        (("--home", "-70", "40"), "built-in field covers the Gulf region; give a field of your own"),
        (("--mission", "nowhere"), "'nowhere' is not a mission folder"),
        (("--send-to", "14540"), "--send-to 14540: give udp:HOST:PORT"),
        (("--send-to", "udp:127.0.0.1:0"), "--send-to udp:127.0.0.1:0: give"),
        (("--wind", "-3", "90"), "a wind of -3 m/s"),
        (("--gusts", "99"), "gusts of 99 m/s"),
        (("--lose", "1"), "a share of 1 of the messages lost"),
        (("--repeat", "2"), "a share of 2 of the messages repeated"),
        (("--delay", "-1"), "a delay of -1 s"),
        (("--silent-sensor", "60"), "--silent-sensor: '60' is not a window"),
        (("--gps-outage", "90:60"), "--gps-outage: a window of 90:60 s"),
        (("--link-loss", "a:b"), "--link-loss: 'a:b' is not a window"),
        (("--low-battery", "-5"), "a low battery at -5 s"),
        (("--field", "nowhere.tif"), "cannot read 'nowhere.tif'"),
        (("--variable", "NO2"), "--variable only make sense with --field"),
        (("--field-over", "52", "25", "51", "24"), "swapped"),
        (("--no-sensor", "--truth", "t.nc", "--listen", "udp:0"), "without a sensor there is no field to write"),
        (("--truth", __file__), "is there already; give another name, or --force"),
    ],
)
def test_what_is_wrong_is_said(options, sentence):
    ran = CliRunner().invoke(app, [*HOME, *options])
    assert ran.exit_code == 2, ran.output
    assert re.search(sentence, ran.output.replace("\n", " "))


def test_home_or_a_mission_is_needed():
    ran = CliRunner().invoke(app, [])
    assert ran.exit_code == 2
    assert "Give --home LON LAT, or --mission DIR" in ran.output


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


def test_it_tells_what_happens_unless_it_is_to_be_quiet():
    for more, told in (((), True), (("-q",), False)):
        options = [*HOME, "--listen", "tcp:0", "--send-to", "udp:127.0.0.1:9", "--speedup", "20", *more]
        words = [sys.executable, "-u", "-c", PROGRAM, *options]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
            try:
                if told:
                    (port,) = re.findall(
                        r"tcpout://127.0.0.1:(\d+)", running.stdout.readline() + running.stdout.readline()
                    )
                    mavutil.mavlink_connection(f"tcp:127.0.0.1:{port}").close()
                    lines = [running.stderr.readline() for _ in range(2)]
                    assert re.fullmatch(r" *[\d.]+ s  client 2 joined \(TCP 127.0.0.1:\d+\)\n", lines[0])
                    assert "client 2 left" in lines[1]
                    running.send_signal(signal.SIGTERM)
                    assert running.wait(timeout=20) == 0
                else:
                    running.terminate()
                    out, err = running.communicate(timeout=20)
                    assert (out, err) == ("", "")
            finally:
                running.kill()


def test_a_port_that_is_taken_is_said_with_a_way_out():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        ran = CliRunner().invoke(app, [*HOME, "--listen", f"udp:{taken.getsockname()[1]}"])
    assert ran.exit_code == 1
    assert "--listen udp:14560" in ran.output
    assert "--send-to udp:127.0.0.1:14550" in ran.output


def test_what_listens_everywhere_is_connected_to_here():
    assert command._reachable("0.0.0.0") == "127.0.0.1"
    assert command._reachable("192.168.1.5") == "192.168.1.5"
