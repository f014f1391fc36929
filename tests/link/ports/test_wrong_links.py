"""An address that is understood but leads nowhere: which one it is, and what to try, is said within the timeout."""

from __future__ import annotations

import socket
import threading
import time
from contextlib import contextmanager

import pytest

from link.vehicle_endpoint import Vehicle, VehicleEndpoint
from mission_strategies import example_plan
from sparsor.errors import LinkFailureError
from sparsor.journeys.uploading import upload_mission
from sparsor.mission import plan_bytes


@pytest.fixture
def plan(tmp_path):
    path = tmp_path / "a.plan"
    path.write_bytes(plan_bytes(example_plan(stops=3)))
    return path


def free_port(kind=socket.SOCK_STREAM):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def another_program(speaks):
    """A TCP server that is no autopilot; yields its port."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        stop = threading.Event()

        def serve():
            with server.accept()[0] as client:
                while not stop.wait(0.05):
                    if speaks:
                        client.sendall(speaks)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield server.getsockname()[1]
        finally:
            stop.set()
            thread.join()


def refused(plan, url, **options):
    begun = time.monotonic()
    with pytest.raises(LinkFailureError) as failed:
        upload_mission(plan, url, timeout_s=0.6, **options)
    assert time.monotonic() - begun < 5
    assert failed.value.exit_code == 1
    return str(failed.value)


@pytest.mark.parametrize(
    ("form", "kind", "words"),
    [
        ("udpin://127.0.0.1:{}", socket.SOCK_DGRAM, "Does the vehicle send to this computer and port"),
        ("udpout://127.0.0.1:{}", socket.SOCK_DGRAM, "If it sends to us instead, give udpin://0.0.0.0:PORT"),
        ("tcpin://127.0.0.1:{}", socket.SOCK_STREAM, "To connect to it, give tcpout://HOST:PORT"),
    ],
)
def test_a_port_where_nothing_comes(plan, form, kind, words):
    url = form.format(free_port(kind))
    sentence = refused(plan, url)
    assert sentence.startswith(f"nothing came from {url} within 0.6 s")
    assert words in sentence


def test_a_tcp_port_where_nobody_listens(plan):
    assert "nobody answers at tcpout" in refused(plan, f"tcp:127.0.0.1:{free_port()}")


@pytest.mark.parametrize(
    ("speaks", "words"),
    [(b"", "is no other program connected to it"), (b"SSH-2.0-x\r\n", "it is the port of something else")],
)
def test_the_tcp_port_of_another_program(plan, speaks, words):
    with another_program(speaks) as port:
        assert words in refused(plan, f"tcp:127.0.0.1:{port}")


def test_another_vehicle_than_the_one_asked_for(plan):
    with VehicleEndpoint(Vehicle(systems=(7,))) as endpoint:
        sentence = refused(plan, endpoint.url, system_id=1)
    assert "system 1 was not heard" in sentence
    assert "there is ArduPilot quadrotor, system 7" in sentence
