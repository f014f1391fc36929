"""Uploads to the practice autopilot over links that lose, repeat and delay in both directions."""

from __future__ import annotations

import pytest

from link.bad_link import BadLink
from mission_strategies import KNOWN_HOME, example_plan
from sparsor.link.connection import Connection
from sparsor.link.practice import PracticeAutopilot, PracticeServer, PracticeSettings, flavour_named
from sparsor.link.resending import Resender
from sparsor.link.upload import upload_plan
from sparsor.link.vehicles import find_vehicle
from sparsor.link.wire import KINDS, wire_items


@pytest.fixture(params=["ardupilot", "px4"])
def server(request):
    settings = PracticeSettings(home=KNOWN_HOME, flavour=flavour_named(request.param))
    with PracticeServer(PracticeAutopilot(settings), udp=("127.0.0.1", 0)) as running:
        yield running, request.param


def test_an_upload_to_the_practice_autopilot(server):
    running, name = server
    with Connection(f"udpout://127.0.0.1:{running.udp_port}") as connection:
        report = upload_plan(example_plan(name, 5), connection, find_vehicle(connection, 1))
    assert report.verified
    assert report.fence_enforced is (name == "px4")


def test_an_upload_over_a_link_that_repeats(server):
    running, name = server
    with BadLink(running.udp_port, twice=0.3) as link, Connection(link.url) as connection:
        assert upload_plan(example_plan(name, 5), connection, find_vehicle(connection, 1)).verified


def test_our_own_transfer_carries_where_every_tenth_datagram_is_lost(server):
    running, name = server
    with BadLink(running.udp_port, loss=0.1, twice=0.1, delay_s=0.02) as link, Connection(link.url) as connection:
        vehicle = find_vehicle(connection, 1)
        items = wire_items(example_plan(name, 4), vehicle.autopilot)
        resender = Resender(connection, vehicle, resend_s=0.2)
        for kind in KINDS:
            resender.upload(kind, items[kind])
            assert [(item.command, item.x, item.y) for item in resender.download(kind)][1:] == [
                (item.command, item.x, item.y) for item in items[kind]
            ][1:]
