"""`sparsor send` as people run it: a sensor's lines in, counts out, the right exit code, Ctrl-C."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time

import pytest
import typer
from typer.testing import CliRunner

from link.vehicle_endpoint import Vehicle, VehicleEndpoint
from sparsor.cli.send import send

app = typer.Typer()
app.command()(send)
PROGRAM = "import sys; from sparsor.cli.main import main; sys.argv[0] = 'sparsor'; main()"
NOWHERE = ("--connect", "udpout://127.0.0.1:9")


def run(*options, stdin=""):
    return CliRunner().invoke(app, [str(option) for option in options], input=stdin)


def values_of(endpoint, count):
    """The named values that came; waits for as many as are to come."""
    deadline = time.monotonic() + 30
    while True:
        found = [(m.name, round(m.value, 3)) for m in endpoint.heard if m.get_type() == "NAMED_VALUE_FLOAT"]
        if len(found) >= count or time.monotonic() > deadline:
            return found
        time.sleep(0.02)


def test_standard_input_is_sent_and_counted():
    with VehicleEndpoint() as endpoint:
        lines = "#warming up\nNO2=1.5 RH=40\nNO2=-2 RH=nan\nNO2=3 RH=41\n"
        pattern = r"NO2=(?P<value>\S+) RH=(?P<RH>\S+)"
        ran = run("--connect", endpoint.url, "-", "--pattern", pattern, "--name", "GAS", "--json", stdin=lines)
        assert ran.exit_code == 0, ran.output
        assert values_of(endpoint, 5) == [("GAS", 1.5), ("RH", 40), ("GAS", -2), ("GAS", 3), ("RH", 41)]
    told = json.loads(ran.stdout)
    assert (told["sent"], told["skipped"], told["lost"], told["left_out"]) == (5, 2, 0, 0)
    assert told["first_skipped"] == "'#warming up' (the pattern is not in it)"
    assert told["names"] == {"GAS": 3, "RH": 2}
    assert (told["system_id"], told["component_id"]) == (1, 191)


def test_a_recorded_file_is_sent_with_its_named_columns(tmp_path):
    path = tmp_path / "day.csv"
    path.write_text("time_s;no2_ppb;temp_c\n0;1.5;20\n10;2.5;\n20;x;22\n")
    options = ("--csv", path, "--value", "NO2=no2_ppb", "--value", "T=temp_c", "--time", "time_s")
    with VehicleEndpoint(Vehicle(systems=(1, 9))) as endpoint:
        link = ("--connect", endpoint.url, "--system", 9, "--component", 25)
        ran = run(*link, *options, "--delimiter", ";", "--replay-speed", 100)
        assert ran.exit_code == 0, ran.output
        assert values_of(endpoint, 4) == [("NO2", 1.5), ("T", 20), ("NO2", 2.5), ("T", 22)]
        senders = {(m.get_srcSystem(), m.get_srcComponent()) for m in endpoint.heard}
    assert senders == {(9, 25)}
    assert "sent 4 values" in ran.stdout
    assert "skipped 2 that could not be read, the first: '10;2.5;' (T: '' is not a number)" in ran.stdout


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "--serial DEVICE, --csv FILE, or -"),
        (("-", "--csv", "a.csv"), "say where the values come from"),
        (("day.csv",), "a file goes with --csv"),
        (("-", "--name", "NITROGEN_DIOXIDE"), "1 to 10 ASCII characters"),
        (("-", "--name", "NO₂"), "1 to 10 ASCII characters"),
        (("-", "--pattern", "(", "--name", "X"), "not a regular expression"),
        (("-", "--pattern", "(?P<value>.)", "--time", "2"), "leave out --value, --time and --delimiter"),
        (("-", "--replay-speed", "2"), "--replay-speed is for --csv"),
        (("--csv", "gone.csv", "--rate", "1"), "cannot read 'gone.csv'"),
        (("--serial", "/dev/no-such-port"), "cannot open|pyserial"),
        (("--serial", "/dev/ttyS0", "--value", "no2"), "give the columns' numbers"),
        (("-", "--time", "1"), "column 1 is the time: say which column is the value"),
        (("--csv", "gone.csv"), "cannot read 'gone.csv'"),
    ],
)
def test_what_cannot_be_meant_is_refused_before_anything_is_sent(options, words):
    ran = run(*NOWHERE, *options)
    assert ran.exit_code == 2, ran.output
    assert re.search(words, ran.stderr)


def test_a_first_line_with_several_names_is_no_place_to_guess(tmp_path):
    path = tmp_path / "day.csv"
    path.write_text("time_s,no2_ppb\n0,1.5\n1,2.5\n")
    for where in (("--csv", path, "--rate", 1), ("--csv", path, "--time", "time_s"), ("-",)):
        ran = run(*NOWHERE, *where, "--timeout", 0.3, stdin=path.read_text())
        assert ran.exit_code == 2, ran.output
        assert "names 2 columns: time_s, no2_ppb. Say which are to be sent, e.g. --value NO2=no2_ppb" in ran.stderr


def test_no_line_that_can_be_read_is_exit_2_and_no_vehicle_exit_1(tmp_path, monkeypatch):
    monkeypatch.setattr("sparsor.link.sensing.outlet.FIND_S", 0.5)  # it ends when that is over
    with VehicleEndpoint() as endpoint:
        ran = run("--connect", endpoint.url, "-", "--value", 1, stdin="time,no2\na,b\n")
    assert (ran.exit_code, "no line could be read, the first was 'a,b'" in ran.stderr) == (2, True)
    path = tmp_path / "day.csv"
    path.write_text("1\n")
    ran = run(*NOWHERE, "--csv", path, "--rate", 1, "--timeout", 0.3)
    assert (ran.exit_code, "no vehicle was heard within 0.3 s" in ran.stderr) == (1, True)
    ran = run(*NOWHERE, "-", "--timeout", 0.3, stdin="1\n2\n")
    assert (ran.exit_code, "the link was down for all 2 values" in ran.stderr) == (1, True)


def test_ctrl_c_ends_it_with_the_counts():
    with VehicleEndpoint() as endpoint:
        program = [sys.executable, "-c", PROGRAM, "send", "--connect", endpoint.url, "-", "--json"]
        with subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as running:
            try:
                running.stdin.write("4\n5\n")
                running.stdin.flush()
                assert values_of(endpoint, 2) == [("NO2", 4), ("NO2", 5)]
                running.send_signal(signal.SIGINT)
                assert running.wait(timeout=30) == 0
                assert json.loads(running.stdout.read())["sent"] == 2
            finally:
                running.kill()
