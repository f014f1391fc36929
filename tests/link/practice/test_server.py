"""The practice autopilot on the network: who it sends to first, and links that are bad."""

from __future__ import annotations

import socket
import time

import pytest
from pymavlink import mavutil

from mission_strategies import KNOWN_HOME
from sparsor.errors import InputError, LinkError
from sparsor.link.connection import Connection
from sparsor.link.practice import (
    LinkTroubles,
    PracticeAutopilot,
    PracticeServer,
    PracticeSettings,
    Troubles,
    flavour_named,
)
from sparsor.link.vehicles import find_vehicle

PATIENCE_S = 30.0


def autopilot(name="ardupilot", **settings):
    return PracticeAutopilot(PracticeSettings(home=KNOWN_HOME, flavour=flavour_named(name), **settings))


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.mark.parametrize("name", ["ardupilot", "px4"])
def test_our_connection_finds_a_vehicle_that_sends_first_and_is_answered(name):
    port = free_port()
    with (
        PracticeServer(autopilot(name), send_to=[("localhost", port)]),
        Connection(f"udpin://127.0.0.1:{port}") as connection,
    ):
        assert find_vehicle(connection, timeout_s=PATIENCE_S).autopilot.name == name
        from pymavlink.dialects.v20 import ardupilotmega as mavlink

        with connection.inbox("PARAM_VALUE") as inbox:
            connection.send(mavlink.MAVLink_param_request_list_message(1, 1))
            assert next(inbox.until(time.monotonic() + PATIENCE_S), None) is not None


def test_mavsdk_finds_a_vehicle_that_sends_first():
    from mavsdk import ComponentType, Configuration, Mavsdk

    port = free_port()
    with PracticeServer(autopilot("px4"), send_to=[("127.0.0.1", port)]):
        mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        mavsdk.add_any_connection(f"udpin://0.0.0.0:{port}")
        assert mavsdk.first_autopilot(timeout_s=PATIENCE_S) is not None


def test_it_sends_and_listens_at_once_and_passes_messages_between():
    port = free_port()
    with PracticeServer(autopilot(), udp=("127.0.0.1", 0), send_to=[("127.0.0.1", port)]) as server:
        station = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}")
        assert station.wait_heartbeat(timeout=PATIENCE_S)
        companion = mavutil.mavlink_connection(
            f"udpout:127.0.0.1:{server.udp_port}", source_system=1, source_component=191
        )
        deadline_s = time.monotonic() + PATIENCE_S
        value = None
        while value is None and time.monotonic() < deadline_s:
            companion.mav.named_value_float_send(5, b"CO", 1.25)
            value = station.recv_match(type="NAMED_VALUE_FLOAT", blocking=True, timeout=0.5)
        assert value.value == 1.25
        station.close()
        companion.close()


def test_a_share_of_the_messages_is_lost_both_ways():
    bad = Troubles(link=LinkTroubles(lose=0.5))
    with PracticeServer(autopilot("px4", troubles=bad), tcp=("127.0.0.1", 0), speedup=50) as server:
        client = mavutil.mavlink_connection(f"tcp:127.0.0.1:{server.tcp_port}")
        deadline_s = time.monotonic() + PATIENCE_S
        while client.mav_count < 1000 and time.monotonic() < deadline_s:
            client.recv_match(blocking=True, timeout=1)
        # mavutil counts what is missing by the vehicle's sequence numbers.
        assert client.mav_loss / (client.mav_loss + client.mav_count) == pytest.approx(0.5, abs=0.1)
        client.close()


def test_messages_take_as_long_as_asked_for():
    slow = Troubles(link=LinkTroubles(delay_s=0.4))
    with PracticeServer(autopilot(troubles=slow), udp=("127.0.0.1", 0)) as server:
        client = mavutil.mavlink_connection(f"udpout:127.0.0.1:{server.udp_port}")
        client.mav.heartbeat_send(6, 8, 0, 0, 4)
        assert client.wait_heartbeat(timeout=PATIENCE_S)
        sent_s = time.monotonic()
        client.mav.param_request_read_send(1, 1, b"RTL_ALT", -1)
        assert client.recv_match(type="PARAM_VALUE", blocking=True, timeout=PATIENCE_S)
        assert time.monotonic() - sent_s >= 0.8
        client.close()


def test_a_hundred_times_as_fast_is_the_same_flight():
    with PracticeServer(autopilot("px4", truth=lambda *_: 0.5), udp=("127.0.0.1", 0), speedup=200) as server:
        client = mavutil.mavlink_connection(f"udpout:127.0.0.1:{server.udp_port}")
        client.mav.heartbeat_send(6, 8, 0, 0, 4)
        stamps, deadline_s = {"ATTITUDE": [], "NAMED_VALUE_FLOAT": []}, time.monotonic() + PATIENCE_S
        while len(stamps["NAMED_VALUE_FLOAT"]) < 100 and time.monotonic() < deadline_s:
            message = client.recv_match(type=list(stamps), blocking=True, timeout=1)
            if message:
                stamps[message.get_type()].append(message.time_boot_ms)
        client.close()
    samples = server.autopilot.samples
    # UDP may lose some; the flight's own record has them all, at their times.
    assert [round(one.time_s * 1000) for one in samples] == [1000 * (number + 1) for number in range(len(samples))]
    assert all(stamp % 1000 == 0 for stamp in stamps["NAMED_VALUE_FLOAT"])
    assert all(stamp % 50 == 0 for stamp in stamps["ATTITUDE"])
    assert stamps["ATTITUDE"] == sorted(stamps["ATTITUDE"])


def test_somewhere_to_listen_or_send_is_needed():
    with pytest.raises(InputError, match="to listen on, or an address to send to"):
        PracticeServer(autopilot())


def test_a_host_that_is_unknown_is_named():
    with pytest.raises(LinkError, match=r"no host .nowhere\.invalid."):
        PracticeServer(autopilot(), send_to=[("nowhere.invalid", 14540)])
