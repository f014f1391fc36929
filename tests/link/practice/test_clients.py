"""Clients that we did not write take the practice autopilot for a vehicle: mavsdk and pymavlink's mavutil."""

from __future__ import annotations

import math
import socket
import threading
import time
from contextlib import contextmanager
from itertools import pairwise

import pytest
from pymavlink import mavutil, mavwp
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mission_strategies import AUTOPILOT_NAMES, example_plan
from practice_rig import ARM, START, mission_messages
from sparsor.errors import InputError, OutputError
from sparsor.link.practice import PracticeAutopilot, PracticeServer, PracticeSettings, flavour_named
from sparsor.mission import export_bytes, plan_bytes

HOST = "127.0.0.1"
either = pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)


@contextmanager
def served(autopilot, *, speedup=50.0, plan=None, truth=lambda *_: 0.5, **settings):
    plan = plan or example_plan(autopilot, stops=4)
    vehicle = PracticeAutopilot(PracticeSettings(plan.home, flavour_named(autopilot), truth=truth, **settings))
    # Ten seconds on the ground are short at this speed.
    vehicle.parameters.set("DISARM_DELAY" if autopilot == "ardupilot" else "COM_DISARM_PRFLT", 0.0)
    with PracticeServer(vehicle, udp=(HOST, 0), tcp=(HOST, 0), speedup=speedup) as server:
        yield server
    assert not any(thread.name == "practice-autopilot" for thread in threading.enumerate())


@contextmanager
def mavsdk_system(url):
    from mavsdk import ComponentType, Configuration, Mavsdk

    station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    try:
        station.add_any_connection(url)
        system = station.first_autopilot(timeout_s=10.0)
        assert system is not None
        yield system
    finally:
        station.destroy()


@contextmanager
def mavutil_client(url, system=255):
    client = mavutil.mavlink_connection(url, source_system=system, source_component=190)
    try:
        client.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        assert client.wait_heartbeat(timeout=10) is not None
        client.target_system, client.target_component = 1, 1
        yield client
    finally:
        client.close()


def wait_for(client, names, condition=lambda _: True, seconds=20.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        message = client.recv_match(type=names, blocking=True, timeout=1.0)
        if message is not None and condition(message):
            return message
    raise AssertionError(f"no {names} within {seconds:g} s")


def command(client, number, *params):
    values = (*params, *(0.0,) * (7 - len(params)))
    client.mav.command_long_send(1, 1, number, 0, *values)
    return wait_for(client, "COMMAND_ACK", lambda ack: ack.command == number).result


@either
def test_mavsdk_uploads_reads_back_and_clears(autopilot):
    from mavsdk.plugins.mission_raw import MissionRaw

    plan = example_plan(autopilot, stops=4)
    with served(autopilot, plan=plan) as server, mavsdk_system(f"udpout://{HOST}:{server.udp_port}") as system:
        raw = MissionRaw(system)
        data = raw.import_qgroundcontrol_mission_from_string(plan_bytes(plan).decode())
        items, corners, rally = map(list, (data.mission_items, data.geofence_items, data.rally_items))
        raw.upload_mission(items)
        raw.upload_geofence(corners)
        raw.upload_rally_points(rally)
        for sent, got in (
            (items, raw.download_mission()),
            (corners, raw.download_geofence()),
            (rally, raw.download_rallypoints()),
        ):
            assert [(one.seq, one.command, one.x, one.y) for one in got] == [
                (one.seq, one.command, one.x, one.y) for one in sent
            ]
            assert [one.z for one in got] == pytest.approx([one.z for one in sent], abs=0.01)
            assert [one.param1 for one in got] == [one.param1 for one in sent]
        raw.set_current_mission_item(0)
        raw.clear_mission()
        # mavsdk clears ArduPilot by uploading a home that is nowhere.
        assert len(server.autopilot.store.items[0]) == (autopilot == "ardupilot")


@pytest.mark.parametrize(("autopilot", "link"), [("ardupilot", "udp"), ("px4", "tcp")])
def test_mavutil_uploads_and_flies_to_the_end(autopilot, link):
    plan = example_plan(autopilot, stops=2)
    items = mission_messages(plan, autopilot)
    with served(autopilot, plan=plan, speedup=400) as server:
        url = f"udpout:{HOST}:{server.udp_port}" if link == "udp" else f"tcp:{HOST}:{server.tcp_port}"
        with mavutil_client(url) as client:
            client.mav.mission_count_send(1, 1, len(items), 0)
            while True:
                message = wait_for(client, ["MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"])
                if message.get_type() == "MISSION_ACK":
                    break
                client.mav.send(items[message.seq])
            assert message.type == mavlink.MAV_MISSION_ACCEPTED
            end = time.monotonic() + 10
            while command(client, ARM, 1) != 0 or command(client, START) != 0:
                assert time.monotonic() < end
            wait_for(client, "HEARTBEAT", lambda beat: not beat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
            assert server.autopilot.flight.landed
            assert server.autopilot.flight.navigator.finished


@either
def test_mavwp_loads_a_waypoints_file_and_mavutil_sends_it_as_floats(autopilot, tmp_path):
    plan = example_plan(autopilot, stops=3)
    path = tmp_path / "plan.waypoints"
    path.write_bytes(export_bytes(plan, "plan", "waypoints"))
    loader = mavwp.MAVWPLoader(target_system=1, target_component=1)
    total = loader.load(str(path))
    with served(autopilot, plan=plan) as server, mavutil_client(f"udpout:{HOST}:{server.udp_port}") as client:
        client.waypoint_count_send(total)
        while True:
            message = wait_for(client, ["MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"])
            if message.get_type() == "MISSION_ACK":
                break
            client.mav.send(loader.wp(message.seq))
        assert message.type == mavlink.MAV_MISSION_ACCEPTED
        stored = server.autopilot.store.items[0]
        assert [item.command for item in stored] == [loader.wp(seq).command for seq in range(total)]
        # The floats of MISSION_ITEM are good to about two metres.
        assert [item.lat_deg for item in stored[1:]] == pytest.approx(
            [loader.wp(seq).x for seq in range(1, total)], abs=2e-5
        )


@either
def test_mavutil_changes_the_mode_by_name_and_arms(autopilot):
    mode = "GUIDED" if autopilot == "ardupilot" else "POSCTL"
    with served(autopilot, ready_s=0.0) as server, mavutil_client(f"tcp:{HOST}:{server.tcp_port}") as client:
        client.set_mode(mode)
        wait_for(client, "HEARTBEAT", lambda beat: mavutil.mode_string_v10(beat) == mode)
        client.arducopter_arm()
        wait_for(client, "HEARTBEAT", lambda beat: beat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        client.arducopter_disarm()
        wait_for(client, "HEARTBEAT", lambda beat: not beat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)


@either
def test_parameters_by_list_by_name_and_changed(autopilot):
    name = "FENCE_ENABLE" if autopilot == "ardupilot" else "GF_ACTION"
    with served(autopilot) as server, mavutil_client(f"udpout:{HOST}:{server.udp_port}") as client:
        client.param_fetch_all()
        total = wait_for(client, "PARAM_VALUE").param_count
        seen = 1
        while seen < total:
            wait_for(client, "PARAM_VALUE")
            seen += 1
        client.mav.param_request_read_send(1, 1, name.encode(), -1)
        before = wait_for(client, "PARAM_VALUE", lambda one: one.param_id == name)
        kind = before.param_type
        raw = 1.0 if autopilot == "ardupilot" else 1e-45  # PX4: the bits of the integer 1
        client.mav.param_set_send(1, 1, name.encode(), raw, kind)
        assert wait_for(client, "PARAM_VALUE", lambda one: one.param_id == name).param_value == pytest.approx(raw)
        assert server.autopilot.parameters[name] == 1
        client.mav.param_set_send(1, 1, name.encode(), math.nan if autopilot == "ardupilot" else raw, kind)
        wait_for(client, "PARAM_VALUE", lambda one: one.param_id == name)
        assert server.autopilot.parameters[name] == 1


def test_a_companions_samples_reach_the_ground_station_on_another_link():
    with (
        served("ardupilot", truth=None) as server,
        mavutil_client(f"udpout:{HOST}:{server.udp_port}") as station,
        mavutil_client(f"tcp:{HOST}:{server.tcp_port}", system=2) as companion,
    ):
        companion.mav.named_value_float_send(1234, b"NO2", 41.5)
        message = wait_for(station, "NAMED_VALUE_FLOAT")
        assert (message.get_srcSystem(), message.name, message.value) == (2, "NO2", 41.5)
        # What is for the companion alone goes to it, and what is for the vehicle goes no further.
        station.mav.command_long_send(2, 190, 512, 0, 148, 0, 0, 0, 0, 0, 0)
        assert wait_for(companion, "COMMAND_LONG").target_system == 2
        station.mav.command_long_send(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
        assert wait_for(station, "AUTOPILOT_VERSION").capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT
        assert companion.recv_match(type="COMMAND_LONG", blocking=True, timeout=0.2) is None


def test_a_sequence_number_is_missing_only_where_a_message_was_lost():
    with served("px4", speedup=5) as server, mavutil_client(f"tcp:{HOST}:{server.tcp_port}") as client:
        own = (client.recv_match(blocking=True, timeout=1.0) for _ in range(100))
        numbers = [one.get_seq() for one in own if one is not None and one.get_srcSystem() == 1]
        assert all((after - before) % 256 == 1 for before, after in pairwise(numbers))


def test_noise_on_the_line_does_not_end_it():
    with served("ardupilot") as server:
        with socket.create_connection((HOST, server.tcp_port)) as noise:
            noise.sendall(bytes(range(256)) * 20)
        with mavutil_client(f"udpout:{HOST}:{server.udp_port}") as client:
            assert client.target_system == 1


def test_a_port_that_is_taken_is_named():
    with served("ardupilot") as server:
        taken = server.udp_port
        with pytest.raises(OutputError, match=f"UDP port {taken} of {HOST} cannot be opened"):
            PracticeServer(server.autopilot, udp=(HOST, taken))
    with pytest.raises(InputError, match="needs a UDP or a TCP port"):
        PracticeServer(server.autopilot)
    with pytest.raises(InputError, match="speed-up of 0"):
        PracticeServer(server.autopilot, udp=(HOST, 0), speedup=0)


@either
def test_mavsdk_starts_it_and_sees_it_fly(autopilot):
    from mavsdk.plugins.action import Action
    from mavsdk.plugins.mission_raw import MissionRaw
    from mavsdk.plugins.telemetry import Telemetry

    plan = example_plan(autopilot, stops=1)
    with (
        served(autopilot, plan=plan, speedup=400, ready_s=0.0) as server,
        mavsdk_system(f"udpout://{HOST}:{server.udp_port}") as system,
    ):
        raw, telemetry = MissionRaw(system), Telemetry(system)
        data = raw.import_qgroundcontrol_mission_from_string(plan_bytes(plan).decode())
        raw.upload_mission(list(data.mission_items))
        telemetry.set_rate_position(10.0)
        telemetry.set_rate_landed_state(5.0)
        Action(system).arm()
        raw.start_mission()
        if autopilot == "ardupilot":  # mavsdk only sets AUTO, which leaves a copter on the ground
            with mavutil_client(f"tcp:{HOST}:{server.tcp_port}") as client:
                assert command(client, START) == 0
        end = time.monotonic() + 20
        while not telemetry.armed():
            assert time.monotonic() < end
        seen = []
        while telemetry.armed() or not seen:
            assert time.monotonic() < end
            seen.append((telemetry.in_air(), telemetry.position().relative_altitude_m, raw.mission_progress().current))
            time.sleep(0.02)
        assert any(in_air for in_air, _, _ in seen)
        assert max(height for _, height, _ in seen) == pytest.approx(60, abs=1)
        assert len({current for _, _, current in seen}) > 3
        assert server.autopilot.flight.landed
