"""One owner of the link: what passes is recorded, heard and sent; what is wrong with a link is said in time."""

from __future__ import annotations

import io
import socket
import threading
import time

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from link.vehicle_endpoint import PX4, Vehicle, VehicleEndpoint
from sparsor.core.mavlink_frames import Frame
from sparsor.errors import InputError, LinkError, LinkFailureError, OutputError
from sparsor.link.connection import Connection
from sparsor.link.recorder import record
from sparsor.link.tlog import TlogWriter
from sparsor.link.vehicles import find_vehicle


@pytest.fixture(autouse=True)
def no_thread_is_left():
    before = set(threading.enumerate())
    yield
    assert not [thread for thread in threading.enumerate() if thread not in before and "link" in thread.name]


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def frames_of(path):
    """All frames in a .tlog, as mavutil reads them; and their times."""
    log = mavutil.mavlink_connection(str(path))
    found = []
    while (message := log.recv_msg()) is not None:
        assert message.get_type() != "BAD_DATA"
        found.append((bytes(message.get_msgbuf()), message._timestamp))
    log.close()
    return found


@pytest.mark.parametrize(("autopilot", "name"), [(3, "ArduPilot"), (PX4, "PX4")])
def test_the_vehicle_is_found_and_named(autopilot, name):
    with VehicleEndpoint(Vehicle(autopilot=autopilot)) as endpoint, Connection(endpoint.url) as connection:
        assert find_vehicle(connection).words == f"{name} quadrotor, system 1, disarmed"


def test_a_vehicle_that_sends_to_us_is_found():
    port = free_port()
    with Connection(f"udpin://127.0.0.1:{port}") as connection, VehicleEndpoint(send_to=port):
        assert find_vehicle(connection, 1).armed is False


def test_several_vehicles_ask_for_a_choice():
    with VehicleEndpoint(Vehicle(systems=(1, 7))) as endpoint, Connection(endpoint.url) as connection:
        with pytest.raises(LinkError, match=r"system 1.*system 7.*--system"):
            find_vehicle(connection)
        assert find_vehicle(connection, 7).system_id == 7
        with pytest.raises(LinkFailureError, match=r"system 3 was not heard.*system 1"):
            find_vehicle(connection, 3, timeout_s=0.6)


@pytest.mark.parametrize(
    ("vehicle", "words"),
    [
        (Vehicle(beats=False), "nothing came from udpout"),
        (Vehicle(speaks=b"$GPGGA,1,2,3*00\r\n"), "no MAVLink"),
        (Vehicle(autopilot=mavlink.MAV_AUTOPILOT_INVALID, systems=(51,)), "only system 51 without one"),
    ],
)
def test_a_link_without_a_vehicle_says_what_it_heard_within_the_timeout(vehicle, words):
    with VehicleEndpoint(vehicle) as endpoint, Connection(endpoint.url) as connection:
        begun = time.monotonic()
        with pytest.raises(LinkFailureError, match=words):
            find_vehicle(connection, timeout_s=0.7)
        assert time.monotonic() - begun < 1.2


def test_a_taken_port_a_closed_one_and_an_unknown_host_are_named():
    with VehicleEndpoint() as endpoint:
        taken = endpoint.socket.getsockname()[1]
        with pytest.raises(LinkError, match=f"port {taken} is taken.*give udpout://127.0.0.1:{taken}"):
            Connection(f"udpin://127.0.0.1:{taken}")
    with pytest.raises(LinkFailureError, match="nobody answers at tcpout"):
        Connection(f"tcpout://127.0.0.1:{free_port()}", timeout_s=1)
    with pytest.raises(LinkError, match="no host"):
        Connection("udpout://no.such.host.invalid:14550")
    with pytest.raises(InputError, match=r"pyserial|cannot open"):
        Connection("serial:///dev/no-such-port:57600")


def test_a_tcp_link_works_and_its_end_is_noticed():
    server = socket.create_server(("127.0.0.1", 0))
    with Connection(f"tcp:127.0.0.1:{server.getsockname()[1]}") as connection:
        client = server.accept()[0]
        beat = mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3).pack(mavlink.MAVLink(None, 5, 1))
        with connection.inbox("HEARTBEAT") as inbox:
            client.sendall(beat[:9])
            time.sleep(0.05)
            client.sendall(beat[9:])
            assert next(inbox.until(time.monotonic() + 20)).frame.raw == bytes(beat)
        client.close()
        gone = "closed the connection|connection broke"
        with pytest.raises(LinkFailureError, match=gone), connection.inbox("HEARTBEAT") as inbox:
            list(inbox.until(time.monotonic() + 2))
    server.close()


def test_a_vehicle_may_connect_to_us_leave_and_come_back():
    port = free_port()
    with Connection(f"tcpin://127.0.0.1:{port}") as connection:
        for system in (4, 5):
            beat = mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3).pack(mavlink.MAVLink(None, system))
            with connection.inbox("HEARTBEAT") as inbox, socket.create_connection(("127.0.0.1", port)) as client:
                client.sendall(beat)
                assert next(inbox.until(time.monotonic() + 20)).frame.system_id == system


def test_every_frame_of_both_directions_is_in_the_tlog(tmp_path):
    path = tmp_path / "a.tlog"
    tlog = TlogWriter(path)
    with VehicleEndpoint() as endpoint:
        with Connection(endpoint.url, recording=tlog) as connection:
            find_vehicle(connection)
            sender = mavlink.MAVLink_named_value_float_message(1, b"NO2", 1.5)
            for _ in range(50):
                endpoint.send(sender)
            with connection.inbox("PARAM_VALUE") as inbox:
                connection.send(mavlink.MAVLink_param_request_read_message(1, 1, b"FENCE_ENABLE", -1))
                assert next(inbox.until(time.monotonic() + 20)).message.param_id == "FENCE_ENABLE"
            time.sleep(0.2)
            during = len(frames_of(path))  # before it is closed: a crash loses nothing
        sent = list(endpoint.sent)
    tlog.close()
    found = frames_of(path)
    assert during > 50
    assert len(found) == tlog.frames
    logged = [raw for raw, _ in found]
    assert [raw for raw in logged if raw[5] == 1] == sent[: len([raw for raw in logged if raw[5] == 1])]
    assert len([raw for raw in logged if raw[5] == 1]) >= len(sent) - 1  # a heartbeat sent while we closed
    assert {mavlink.MAVLink(None).decode(bytearray(raw)).get_type() for raw in logged if raw[5] == 255} == {
        "HEARTBEAT",
        "PARAM_REQUEST_READ",
    }
    ours = [raw[4] for raw in logged if raw[5] == 255]
    assert ours == list(range(len(ours)))  # the sequence numbers count
    times = [when for _, when in found]
    assert times == sorted(times)
    assert abs(times[0] - time.time()) < 60


def test_record_keeps_what_came_and_asks_for_positions(tmp_path):
    with VehicleEndpoint() as endpoint:
        made = record(endpoint.url, tmp_path / "r.tlog", seconds=0.8)
        asked = {int(m.param1) for m in endpoint.heard if m.get_type() == "COMMAND_LONG"}
    assert mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT in asked
    assert len(frames_of(made.file)) == made.messages > made.received > 0
    assert [vehicle.system_id for vehicle in made.vehicles] == [1]


def test_record_sends_nothing_when_it_only_listens(tmp_path):
    port = free_port()
    with VehicleEndpoint(send_to=port) as endpoint:
        made = record(f"udpin://127.0.0.1:{port}", tmp_path / "r.tlog", seconds=0.7, listen_only=True)
        assert not endpoint.heard
    assert made.messages == made.received == len(frames_of(made.file)) > 0


def test_record_says_when_nothing_comes_and_keeps_an_older_file(tmp_path):
    path = tmp_path / "r.tlog"
    url = f"udpin://127.0.0.1:{free_port()}"
    with pytest.raises(LinkFailureError, match="nothing came"):
        record(url, path, seconds=5, timeout_s=0.3)
    assert not path.exists()
    path.write_bytes(b"older")
    with pytest.raises(LinkError, match="is there already"):
        record(url, path)
    with pytest.raises(LinkFailureError, match="nothing came"):
        record(url, path, timeout_s=0.3, replace=True)
    assert path.read_bytes() == b"older"
    assert list(tmp_path.iterdir()) == [path]


def test_a_recording_replaces_another_when_it_is_told_to(tmp_path):
    path = tmp_path / "r.tlog"
    path.write_bytes(b"older")
    with VehicleEndpoint() as endpoint:
        made = record(endpoint.url, path, seconds=0.5, replace=True)
    assert len(frames_of(path)) == made.messages > 0
    assert list(tmp_path.iterdir()) == [path]


def test_a_disk_that_is_full_or_a_folder_that_is_not_there_is_said(tmp_path):
    with pytest.raises(OutputError, match="cannot write"):
        TlogWriter(tmp_path / "gone" / "a.tlog")
    tlog = TlogWriter(tmp_path / "a.tlog")
    frame = Frame(bytes(mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3).pack(mavlink.MAVLink(None, 1))))
    tlog.write(frame)
    whole, tlog._stream = tlog._stream, io.BytesIO()
    tlog._stream.write = lambda record: len(record) // 2
    with pytest.raises(OutputError, match="is the disk full"):
        tlog.write(frame)
    whole.close()
    assert tlog.frames == 1
