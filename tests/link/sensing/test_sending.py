"""A sensor's lines into the telemetry: what they say, when, and that what went out is what a ground station logs."""

from __future__ import annotations

import io
import math
import os
import re
import sys
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from link.vehicle_endpoint import Vehicle, VehicleEndpoint
from mission_strategies import KNOWN_HOME
from sparsor.errors import InputError, LinkError, LinkFailureError
from sparsor.link.connection import Connection
from sparsor.link.practice import PracticeAutopilot, PracticeServer, PracticeSettings, flavour_named
from sparsor.link.sensing import Columns, Outlet, Pattern, PipedLines, ReplayedFile, SensorPort, send_samples
from sparsor.link.sensing import outlet as outlets
from sparsor.link.sensing.clock import SensorClock
from sparsor.link.sensing.sources import sensor_address
from sparsor.link.tlog import TlogWriter

PATIENCE_S = 30.0
HOST = "127.0.0.1"
on_posix = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX")


@pytest.fixture(autouse=True)
def no_thread_is_left():
    yield
    assert not [one for one in threading.enumerate() if one.name.startswith(("link ", "sensor outlet"))]


def wait_until(condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


@contextmanager
def practice_vehicle(port=0):
    vehicle = PracticeAutopilot(PracticeSettings(KNOWN_HOME, flavour_named("ardupilot")))  # without its own sensor
    with PracticeServer(vehicle, tcp=(HOST, port)) as server:
        yield server


def url_of(server):
    return f"tcpout://{HOST}:{server.tcp_port}"


# What a line says.


@pytest.mark.parametrize(
    ("form", "line", "values", "time_s"),
    [
        (Columns(), "12.5", {"NO2": 12.5}, None),
        (Columns(["2"], name="O3"), "a, -1e-3 ,c", {"O3": -0.001}, None),
        (Columns(["NO2=3", "T=1"], delimiter="space"), "  20.5 x\t7 ", {"NO2": 7.0, "T": 20.5}, None),
        (Columns(["2"], delimiter=";", time="1", time_unit="ms"), "1500;8", {"NO2": 8.0}, 1.5),
        (Columns(["1"], time="2"), '"8","1970-01-01T00:01:00+00:00"', {"NO2": 8.0}, 60.0),
        (Pattern("NO2=(?P<value>[-0-9.]+)"), "$GAS,NO2=-3.5,ok", {"NO2": -3.5}, None),
        (Pattern(r"(?P<name>\w+):(?P<value>\S+)@(?P<time>\d+)", time_unit="us"), "O3:4@2000000", {"O3": 4.0}, 2.0),
        (Pattern(r"(?P<NO2>\d+) (?P<RH>\d+)"), "31 60", {"NO2": 31.0, "RH": 60.0}, None),
    ],
)
def test_a_line_is_understood(form, line, values, time_s):
    reading = form.read(line)
    assert (dict(reading.values), reading.faults, reading.time_s) == (values, (), time_s)


@pytest.mark.parametrize("cell", ["", "nan", "inf", "-inf", "1e39", "n/a", "1,5", "0x10"])
def test_a_value_that_is_none_is_a_fault_and_leaves_the_others(cell):
    form = Columns(["NO2=1", "T=2"], delimiter=";")
    assert form.read("1;2").faults == ()
    reading = form.read(f"{cell};20")
    assert reading.values == (("T", 20.0),)
    assert len(reading.faults) == 1
    assert reading.faults[0].startswith("NO2: ")


def test_named_columns_come_from_the_first_line_and_a_first_line_of_words_is_passed_over():
    form = Columns(["NO2=no2_ppb"], time="t")
    assert form.read("t,x,no2_ppb") is None
    assert form.read("3,9,41").values == (("NO2", 41.0),)
    with pytest.raises(InputError, match=r"no column 'no2_ppb'; the first line has a, b"):
        Columns(["NO2=no2_ppb"]).read("a,b")
    numbered = Columns(["2"])
    assert numbered.read("time,no2") is None
    assert numbered.read("time,no2").faults == ("NO2: 'no2' is not a number",)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Columns(name="NITROGEN_DIOXIDE"), "1 to 10 ASCII characters"),
        (lambda: Columns(["N O2=1"]), "1 to 10 ASCII characters"),
        (lambda: Columns(["1", "2"]), "not all different; give NAME=COLUMN"),
        (lambda: Columns(["0"]), "counted from 1"),
        (lambda: Columns(delimiter=";;"), "one character"),
        (lambda: Columns(time="1", time_unit="min"), "known are s, ms, us"),
        (lambda: Pattern("(?P<value>"), "not a regular expression"),
        (lambda: Pattern(r"\d+"), "names no value"),
        (lambda: Pattern(r"(?P<much_too_long>\d+)"), "1 to 10 ASCII characters"),
    ],
)
def test_a_format_that_cannot_be_meant_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


@given(st.text(max_size=60))
def test_any_line_is_read_or_a_fault(line):
    for form in (Columns(["NO2=1", "T=2"], time="3"), Pattern(r"(?P<value>\S+) (?P<time>\S+)")):
        try:
            reading = form.read(line)
        except InputError:
            raise
        except ValueError:
            continue
        assert reading is None or all(math.isfinite(np.float32(value)) for _, value in reading.values)


# When it was measured.


@given(st.lists(st.tuples(st.floats(0.01, 10), st.floats(0, 2)), min_size=1, max_size=40), st.floats(-1e9, 1e9))
def test_a_sensor_time_keeps_its_spacing_and_is_never_after_the_arrival(steps, begun):
    clock, own, told = SensorClock(), 0.0, []
    for step, delay in steps:
        own += step
        told.append((own, clock.ours(begun + own, 500 + own + delay), delay))
    for own, ours, delay in told:
        assert 500 + own - 1e-5 <= ours <= 500 + own + delay + 1e-5
    settled = [(own, ours) for own, ours, delay in told]
    least = min(delay for *_, delay in told)
    assert settled[-1][1] - settled[-1][0] == pytest.approx(500 + least, abs=1e-5)


@pytest.mark.parametrize("jump", [-3600.0, 3600.0])
def test_a_sensor_that_starts_anew_is_followed_at_once(jump):
    clock = SensorClock()
    for second in range(100):
        clock.ours(5000.0 + second, 10.0 + second)
    assert clock.ours(5100.0 + jump, 110.0) == pytest.approx(110.0)
    assert clock.ours(5101.0 + jump, 111.3) == pytest.approx(111.0)


def test_a_sensor_whose_clock_is_slow_does_not_fall_behind():
    clock = SensorClock()
    for second in range(5000):
        ours = clock.ours(0.99 * second, float(second))
    assert ours == pytest.approx(4999, abs=0.7)


# Out, and into the log.


def logged(path):
    """Name, value, time and sender of every named value in a .tlog, as pymavlink reads it."""
    log = mavutil.mavlink_connection(str(path))
    found = []
    while (message := log.recv_match(type=["NAMED_VALUE_FLOAT"])) is not None:
        found.append((message.name, message.value, message.time_boot_ms, message.get_srcComponent()))
    log.close()
    return found


@pytest.fixture
def attempts(monkeypatch):
    """Every named value that was to be sent, and whether the outlet said that it went."""
    found, send = [], Outlet.send

    def spy(self, message):
        went = send(self, message)
        found.append(((message.name, message.value, message.time_boot_ms, self.component_id), went))
        return went

    monkeypatch.setattr(Outlet, "send", spy)
    return found


def test_what_is_sent_is_what_the_tlog_of_a_ground_station_holds(tmp_path, attempts):
    rng = np.random.default_rng(3)
    times = np.round(np.cumsum(rng.uniform(0.2, 1.8, 200)), 3)
    values = np.round(rng.uniform(0, 80, (200, 2)), 3)
    rows = [f"{when:.3f},{no2},{warm}" for when, (no2, warm) in zip(times, values, strict=True)]
    path = tmp_path / "day.csv"
    path.write_text("\n".join(["time_s,no2_ppb,temp_c", *rows]))
    source = ReplayedFile(path, Columns(["NO2=no2_ppb", "T=temp_c"], time="time_s"), speed=200)
    tlog = TlogWriter(tmp_path / "flight.tlog")
    with (
        practice_vehicle() as server,
        Connection(url_of(server), recording=tlog) as station,
        station.inbox("NAMED_VALUE_FLOAT") as inbox,
    ):
        with Outlet(url_of(server), system_id=None, say=pytest.fail) as outlet:
            result = send_samples(source, outlet)
        deadline = time.monotonic() + PATIENCE_S
        for _ in range(400):
            assert next(inbox.until(deadline), None) is not None
    tlog.close()
    assert (result.sent, result.skipped, result.lost, result.names) == (400, 0, 0, {"NO2": 200, "T": 200})
    found = logged(tlog.path)
    expected = [(name, np.float32(value)) for row in values for name, value in zip(("NO2", "T"), row, strict=True)]
    assert [(name, np.float32(value)) for name, value, *_ in found] == expected
    went = [(name, when, who) for (name, _, when, who), went in attempts if went]
    assert [(name, when, who) for name, _, when, who in found] == went
    assert {who for *_, who in found} == {191}
    # The recording's spacing, to the millisecond, at 200 times its speed.
    stamps = np.array([when for *_, when, _ in found[::2]])
    assert np.abs((stamps - stamps[0]) - np.round((times - times[0]) * 1000)).max() <= 1


def test_it_is_a_component_of_the_vehicle_with_a_heartbeat_of_its_own():
    with VehicleEndpoint(Vehicle(systems=(7,))) as endpoint:
        with Outlet(endpoint.url, system_id=None, component_id=195, say=pytest.fail) as outlet:
            send_samples(PipedLines(io.StringIO("1\n2\n3\n"), Columns()), outlet, timeout_s=PATIENCE_S)
            wait_until(lambda: outlet.beat() or len([m for m in endpoint.heard if m.get_type() == "HEARTBEAT"]) > 2)
        beats = [message for message in endpoint.heard if message.get_type() == "HEARTBEAT"]
        values = [message for message in endpoint.heard if message.get_type() == "NAMED_VALUE_FLOAT"]
    assert [message.value for message in values] == [1, 2, 3]
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in [*beats[1:], *values]} == {(7, 195)}
    assert {(m.type, m.autopilot) for m in beats} == {
        (mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID)
    }
    assert [m.time_boot_ms for m in values] == sorted(m.time_boot_ms for m in values)


def test_several_vehicles_ask_for_a_choice():
    with VehicleEndpoint(Vehicle(systems=(1, 7))) as endpoint:
        with (
            Outlet(endpoint.url, system_id=None, say=pytest.fail) as outlet,
            pytest.raises(LinkError, match="--system"),
        ):
            send_samples(PipedLines(io.StringIO("1\n"), Columns()), outlet, timeout_s=PATIENCE_S)
        with Outlet(endpoint.url, system_id=7, say=pytest.fail) as outlet:
            assert send_samples(PipedLines(io.StringIO("1\n"), Columns()), outlet, timeout_s=PATIENCE_S).sent == 1


def test_more_than_the_rate_is_left_out(tmp_path):
    path = tmp_path / "fast.csv"
    path.write_text("\n".join(f"{0.1 * row:.1f},{row}" for row in range(100)))
    source = ReplayedFile(path, Columns(["2"], time="1"), speed=100)
    with VehicleEndpoint() as endpoint, Outlet(endpoint.url, system_id=None, say=pytest.fail) as outlet:
        result = send_samples(source, outlet, rate_hz=2, timeout_s=PATIENCE_S)
    assert (result.sent, result.left_out) == (20, 80)


def test_an_outlet_that_is_closed_does_not_say_that_it_tries_again(monkeypatch):
    monkeypatch.setattr("sparsor.link.sensing.outlet.FIND_S", 0.3)
    said = []
    with Outlet("udpout://127.0.0.1:9", system_id=None, say=said.append):
        pass
    assert said == []


def test_a_file_says_what_is_missing_or_wrong_in_it(tmp_path):
    path = tmp_path / "day.csv"
    path.write_text("a;b\n1;2\n")
    with pytest.raises(InputError, match="which column is the time"):
        ReplayedFile(path, Columns())
    with pytest.raises(InputError, match=r"no value was found.*'1;2'"):
        ReplayedFile(path, Columns(), rate_hz=1)
    with pytest.raises(InputError, match="cannot read"):
        ReplayedFile(tmp_path / "gone.csv", Columns(), rate_hz=1)
    with pytest.raises(InputError, match="replay speed of 0"):
        ReplayedFile(path, Columns(), rate_hz=1, speed=0)


def test_a_recording_whose_time_goes_back_skips_those_lines(tmp_path):
    path = tmp_path / "day.csv"
    path.write_text("5,1\n6,2\n4,3\n6,4\nx,5\n7,6\n")
    source = ReplayedFile(path, Columns(["2"], time="1"), speed=100)
    lines = [line for line in source.lines() if line]
    assert [value for line in lines for _, value in line.reading.values] == [1, 2, 4, 6]
    assert [bool(line.reading.faults) for line in lines] == [False, False, True, False, True, False]


def test_a_file_waits_for_a_vehicle_and_says_that_there_is_none(tmp_path):
    path = tmp_path / "day.csv"
    path.write_text("1\n")
    said = []
    with Outlet("udpout://127.0.0.1:9", system_id=None, say=said.append) as outlet:
        with pytest.raises(LinkFailureError, match=r"no vehicle was heard within 0.3 s; nothing was sent"):
            send_samples(ReplayedFile(path, Columns(), rate_hz=1), outlet, timeout_s=0.3)
        wait_until(lambda: said)
    assert "nothing came from udpout" in said[0]


def test_a_link_that_is_down_loses_values_and_comes_back(monkeypatch, tmp_path, attempts):
    monkeypatch.setattr("sparsor.link.sensing.backoff.LONGEST_S", 0.5)
    read, write = os.pipe()
    said, results = [], []

    def put(text):
        os.write(write, text.encode())

    with practice_vehicle() as server:
        port = server.tcp_port
        outlet = Outlet(url_of(server), system_id=None, say=said.append)
        source = PipedLines(os.fdopen(read), Columns())
        sending = threading.Thread(target=lambda: results.append(send_samples(source, outlet, timeout_s=PATIENCE_S)))
        sending.start()
        put("1\n2\n")
        wait_until(lambda: [went for _, went in attempts] == [True, True])
    wait_until(lambda: said and not outlet.is_up)
    put("3\n4\n5\n")
    wait_until(lambda: [went for _, went in attempts][2:] == [False] * 3)
    tlog = TlogWriter(tmp_path / "after.tlog")
    with practice_vehicle(port) as server, Connection(url_of(server), recording=tlog) as station:
        wait_until(lambda: outlet.is_up)
        with station.inbox("NAMED_VALUE_FLOAT") as inbox:
            put("6\n")
            assert next(inbox.until(time.monotonic() + PATIENCE_S)).message.value == 6
        os.close(write)
        sending.join(PATIENCE_S)
        outlet.__exit__()
    tlog.close()
    (result,) = results
    assert (result.sent, result.lost) == (3, 3)
    assert [value for _, value, *_ in logged(tlog.path)] == [6]  # nothing late
    assert re.search(r"closed the connection|connection broke|silent", said[0])
    assert said[1:] == [f"tcpout://{HOST}:{port} is back"]


def test_a_vehicle_that_falls_silent_is_a_link_that_is_down(monkeypatch):
    monkeypatch.setattr(outlets, "GONE_S", 0.8)
    said = []
    vehicle = Vehicle()
    with VehicleEndpoint(vehicle) as endpoint, Outlet(endpoint.url, system_id=None, say=said.append) as outlet:
        wait_until(lambda: outlet.beat() or outlet.is_up)
        vehicle.dead = True
        wait_until(lambda: not outlet.is_up)
        assert not outlet.send(mavlink.MAVLink_named_value_float_message(1, b"NO2", 1))
        assert "vehicle 1 has been silent" in said[0]
        vehicle.dead = False
        wait_until(lambda: outlet.beat() or outlet.is_up)
    assert len(said) == 2


# A sensor on a serial port.


def test_the_port_of_a_sensor():
    assert sensor_address("/dev/ttyUSB1").url == "serial:///dev/ttyUSB1:9600"
    assert sensor_address("/dev/ttyUSB1:57600").number == 57600
    assert sensor_address("com4,115200").url == "serial://COM4:115200"
    with pytest.raises(LinkError, match="baud rate 'fast'"):
        sensor_address("/dev/ttyUSB1:fast")


@on_posix
def test_a_sensor_may_be_unplugged_fall_silent_and_come_back(monkeypatch, tmp_path):
    from link.serial_line import SerialLine

    monkeypatch.setattr("sparsor.link.sensing.sender.SILENT_S", 0.6)
    said, results, interrupt = [], [], threading.Event()

    class Interruptible:
        live, waits = True, False

        def lines(self):
            for line in source.lines():
                if interrupt.is_set():
                    raise KeyboardInterrupt
                yield line

    with (
        SerialLine(tmp_path / "ttySENSOR") as line,
        VehicleEndpoint() as endpoint,
        Outlet(endpoint.url, system_id=None, say=said.append) as outlet,
    ):
        wait_until(lambda: outlet.beat() or outlet.is_up)
        source = SensorPort(str(line.path), Pattern("NO2=(?P<value>[-0-9.]+)"), said.append)
        sending = threading.Thread(
            target=lambda: results.append(send_samples(Interruptible(), outlet, say=said.append))
        )
        sending.start()

        def arrived():
            return [m.value for m in endpoint.heard if m.get_type() == "NAMED_VALUE_FLOAT"]

        line.write(b"2=77\r\nNO2=1.5\r\nNO2=2")  # the first line was half over, the last is not
        wait_until(lambda: arrived() == [1.5])
        line.write(b"5\nNO2=nothing\n")
        wait_until(lambda: arrived() == [1.5, 25])
        wait_until(lambda: "the sensor has been silent for 0.6 s" in said)
        line.unplug()
        wait_until(lambda: any("serial port is gone" in sentence for sentence in said))
        line.plug()
        wait_until(lambda: f"{line.path} is back" in said)
        line.write(b"O2=9\nNO2=3\n")
        wait_until(lambda: arrived() == [1.5, 25, 3])
        assert "the sensor is back" in said
        interrupt.set()
        sending.join(PATIENCE_S)
    (result,) = results
    assert (result.sent, result.skipped) == (3, 1)
    assert result.first_skipped == "'NO2=nothing' (the pattern is not in it)"


@on_posix
def test_a_sensor_that_is_not_there_or_has_named_columns_is_refused(tmp_path):
    with pytest.raises(LinkError, match="cannot open"):
        SensorPort(str(tmp_path / "ttyGONE"), Columns(), pytest.fail)
    with pytest.raises(InputError, match="give the columns' numbers"):
        SensorPort(str(tmp_path / "ttyGONE"), Columns(["no2_ppb"]), pytest.fail)
