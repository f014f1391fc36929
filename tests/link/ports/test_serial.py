"""Serial links for real, over pseudo-terminals: a vehicle at the other end, and what goes wrong with ports."""

from __future__ import annotations

import sys
import time

import pytest

from mission_strategies import example_plan
from sparsor.errors import LinkError, LinkFailureError
from sparsor.link.connection import Connection
from sparsor.link.missions.upload import upload_plan
from sparsor.link.practice import PracticeAutopilot, PracticeServer, PracticeSettings, flavour_named
from sparsor.link.vehicles import find_vehicle

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX")
if sys.platform != "win32":
    from link.serial_line import Bridge, SerialLine


@pytest.fixture
def line(tmp_path):
    with SerialLine(tmp_path / "ttyUSB0") as line:
        yield line


@pytest.mark.parametrize("form", ["serial://{}:57600", "serial:{}", "{}"])
def test_a_plan_goes_to_a_vehicle_on_a_serial_line(line, form):
    plan = example_plan(stops=5)
    address = form.format(line.path if form != "{}" else line.path.readlink())
    vehicle = PracticeAutopilot(PracticeSettings(plan.home, flavour_named("ardupilot")))
    with PracticeServer(vehicle, tcp=("127.0.0.1", 0), speedup=5) as server, Bridge(line, server.tcp_port):
        with Connection(address) as connection:
            found = find_vehicle(connection, timeout_s=20)
            report = upload_plan(plan, connection, found)
        assert found.words == "ArduPilot quadrotor, system 1, disarmed"
        assert report.verified is True
    assert len(vehicle.store.items[0]) == len(plan.items) + 1


def test_a_port_is_opened_once_and_given_back(line):
    url = f"serial://{line.path}:57600"
    with Connection(url), pytest.raises(LinkError, match=r"cannot open.*no other program"):
        Connection(url)
    with Connection(url):
        pass


def test_an_unplugged_port_ends_the_link(line):
    with Connection(f"serial://{line.path}:57600") as connection:
        line.unplug()
        with pytest.raises(LinkFailureError, match="serial port is gone"), connection.inbox() as inbox:
            list(inbox.until(time.monotonic() + 20))


@pytest.mark.parametrize(
    ("speaks", "words"),
    [
        (b"", r"nothing came from serial.*baud rate \(57600 for radios, 115200 for USB\)"),
        (b"\x00\xff\x91garbage" * 40, r"bytes came from serial.*the baud rate is wrong"),
    ],
)
def test_a_silent_port_and_a_wrong_baud_rate_are_said_within_the_timeout(line, speaks, words):
    with Connection(f"serial://{line.path}:57600") as connection:
        line.write(speaks)
        begun = time.monotonic()
        with pytest.raises(LinkFailureError, match=words):
            find_vehicle(connection, timeout_s=0.7)
        assert time.monotonic() - begun < 5
