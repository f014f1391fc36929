"""Transfers with the practice autopilot over links that lose, repeat and delay in both directions."""

from __future__ import annotations

import random
import time

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from link.bad_link import BadLink
from link.vehicle_endpoint import VehicleEndpoint
from mission_strategies import KNOWN_HOME, example_plan
from sparsor.errors import LinkFailureError
from sparsor.link.connection import Connection
from sparsor.link.missions.mavsdkmissions import MavsdkMissions
from sparsor.link.missions.readback import differences
from sparsor.link.missions.resending import Resender
from sparsor.link.missions.transfer import Transfer
from sparsor.link.missions.upload import upload_plan
from sparsor.link.missions.wire import KINDS, MISSION, wire_items
from sparsor.link.practice import PracticeAutopilot, PracticeServer, PracticeSettings, flavour_named
from sparsor.link.vehicles import find_vehicle

PATIENT_S = 30.0  # to hear a first heartbeat where a third of them is lost


@pytest.fixture(params=["ardupilot", "px4"])
def server(request):
    settings = PracticeSettings(home=KNOWN_HOME, flavour=flavour_named(request.param))
    # Its heartbeats come ten times a second; the mission protocol keeps to the wall clock.
    with PracticeServer(PracticeAutopilot(settings), udp=("127.0.0.1", 0), speedup=10) as running:
        yield running, request.param


def found_and_items(connection, name, stops):
    vehicle = find_vehicle(connection, 1, PATIENT_S)
    return vehicle, wire_items(example_plan(name, stops), vehicle.autopilot)


def harm(vehicle, kind, sent, held):
    found = differences(kind, sent, held, home_is_item_0=vehicle.autopilot.home_is_item_0)
    return [one.sentence for one in found if not one.harmless]


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


def test_everything_over_a_link_that_loses_a_third_and_delays(server):
    running, name = server
    with (
        BadLink(running.udp_port, loss=0.3, twice=0.1, delay_s=0.05) as link,
        Connection(link.url) as connection,
    ):
        vehicle, items = found_and_items(connection, name, 16)
        assert len(items[MISSION]) >= 20
        with Transfer(connection, vehicle) as transfer:
            for kind in KINDS:
                transfer.upload(kind, items[kind])
                assert not harm(vehicle, kind, items[kind], transfer.download(kind))
            transfer.set_current(1)
            transfer.clear(MISSION)
            assert transfer.download(MISSION) == ()


def test_a_hundred_items_over_the_worst_link():
    # ArduPilot's alone: PX4 gives its items one by one, two minutes at this delay (scripts/bench/bad_links.py).
    settings = PracticeSettings(home=KNOWN_HOME, flavour=flavour_named("ardupilot"))
    with (
        PracticeServer(PracticeAutopilot(settings), udp=("127.0.0.1", 0)) as running,
        BadLink(running.udp_port, loss=0.3, twice=0.1, delay_s=0.5) as link,
        Connection(link.url) as connection,
    ):
        vehicle, items = found_and_items(connection, "ardupilot", 98)
        assert len(items[MISSION]) >= 100
        with Transfer(connection, vehicle) as transfer:
            transfer.upload(MISSION, items[MISSION])
        stored = running.autopilot.store.items[MISSION]
    assert [(item.command, item.x, item.y) for item in stored[1:]] == [
        (item.command, item.x, item.y) for item in items[MISSION][1:]
    ]


@pytest.mark.parametrize("seed", range(4))
def test_an_upload_ends_complete_or_says_that_it_did_not(server, seed):
    running, name = server
    chance = random.Random(seed)
    loss, twice, delay_s = chance.uniform(0.05, 0.45), chance.uniform(0.0, 0.4), chance.choice((0.0, 0.03))
    with (
        BadLink(running.udp_port, loss=loss, twice=twice, delay_s=delay_s, seed=seed) as link,
        Connection(link.url) as connection,
    ):
        vehicle, new = found_and_items(connection, name, 6)
        resender = Resender(connection, vehicle)
        try:
            for items in (wire_items(example_plan(name, 3), vehicle.autopilot), new):  # an old plan to be told apart
                resender.upload(MISSION, items[MISSION])
            held = resender.download(MISSION)
        except LinkFailureError:
            assert loss > 0.35  # what it is to carry in any case
            return
    assert not harm(vehicle, MISSION, new[MISSION], held)
    stored = running.autopilot.store.items[MISSION]
    assert [(item.command, item.x, item.y) for item in stored] == [
        (item.command, item.x, item.y) for item in new[MISSION]
    ]


def test_it_does_without_mavsdk_when_that_does_not_see_the_vehicle(server, monkeypatch):
    running, name = server
    monkeypatch.setattr(MavsdkMissions, "_feed", lambda *_: None)
    with Connection(f"udpout://127.0.0.1:{running.udp_port}") as connection:
        vehicle, items = found_and_items(connection, name, 4)
        with Transfer(connection, vehicle, timeout_s=0.1) as transfer:
            transfer.upload(MISSION, items[MISSION])
            assert not harm(vehicle, MISSION, items[MISSION], transfer.download(MISSION))
            assert transfer.helped == {"mission"}
        with pytest.raises(LinkFailureError, match="fell silent"):
            Transfer(connection, vehicle, timeout_s=0.1, resend=False)


def test_a_frame_that_comes_while_mavsdk_is_ended_is_not_given_to_it(server, monkeypatch):
    # The reading thread may have begun to tell the listener; mavsdk would take the whole process down.
    running, name = server
    with Connection(f"udpout://127.0.0.1:{running.udp_port}") as connection:
        listeners = []
        listen = connection.listen
        monkeypatch.setattr(connection, "listen", lambda told: (listeners.append(told), listen(told))[1])
        vehicle, _ = found_and_items(connection, name, 4)
        with connection.inbox("HEARTBEAT", system_id=1) as inbox:
            received = next(inbox.until(time.monotonic() + PATIENT_S))
        missions = MavsdkMissions(connection, vehicle, 10.0)
        missions.close()
        missions.close()
        for told in listeners:
            told(received)


class Echoing(VehicleEndpoint):
    """As ArduPilot, acks an item that it has already with INVALID_SEQUENCE: here every item, before it asks on."""

    def on_mission_item_int(self, message):
        self.ack(message, mavlink.MAV_MISSION_INVALID_SEQUENCE, message.mission_type)
        super().on_mission_item_int(message)


class Forgetful(VehicleEndpoint):
    """Drops the first upload at item 3 and says so to every item that comes after."""

    forgot = False

    def on_mission_item_int(self, message):
        if message.seq == 3 and not self.forgot:
            self.forgot, self.upload = True, None
        if self.upload is None:
            self.ack(message, mavlink.MAV_MISSION_ERROR, message.mission_type)
        super().on_mission_item_int(message)


class Tacit(VehicleEndpoint):
    """Never says that an upload is complete."""

    def ack(self, to, result, kind):
        if result != mavlink.MAV_MISSION_ACCEPTED:
            super().ack(to, result, kind)


class Refusing(Tacit):
    """Loses what it was sent, and never says a word about it."""

    def on_mission_item_int(self, message):
        super().on_mission_item_int(message)
        self.vehicle.stored[MISSION] = []


def sent_to(endpoint):
    with endpoint, Connection(endpoint.url) as connection:
        vehicle, items = found_and_items(connection, "ardupilot", 6)
        Resender(connection, vehicle).upload(MISSION, items[MISSION])
    assert [(item.command, item.x, item.y) for item in endpoint.vehicle.stored[MISSION]] == [
        (item.command, item.x, item.y) for item in items[MISSION]
    ]


def test_mavsdk_does_not_hear_the_echo_of_what_it_sent_again():
    with Echoing() as endpoint, Connection(endpoint.url) as connection:
        vehicle, items = found_and_items(connection, "ardupilot", 6)
        with Transfer(connection, vehicle, resend=False) as transfer:
            transfer.upload(MISSION, items[MISSION])
            assert not harm(vehicle, MISSION, items[MISSION], transfer.download(MISSION))


def test_an_upload_that_the_vehicle_dropped_is_begun_anew_at_once():
    began_s = time.monotonic()
    endpoint = Forgetful()
    sent_to(endpoint)
    assert endpoint.forgot
    assert time.monotonic() - began_s < 8.0  # ArduPilot's own timeout


def test_when_the_last_word_is_lost_what_the_vehicle_holds_tells():
    endpoint = Tacit()
    sent_to(endpoint)
    counts = [message for message in endpoint.heard if message.get_type() == "MISSION_REQUEST_LIST"]
    assert counts


def test_a_vehicle_that_loses_what_it_was_sent_is_found_out(monkeypatch):
    monkeypatch.setattr("sparsor.link.missions.resending.ATTEMPTS", 1)
    with pytest.raises(LinkFailureError, match="sending mission failed"):
        sent_to(Refusing())


class Unwilling(VehicleEndpoint):
    """Refuses to clear, to list and to set a current item."""

    def on_mission_clear_all(self, message):
        self.ack(message, mavlink.MAV_MISSION_DENIED, message.mission_type)

    def on_mission_request_list(self, message):
        self.ack(message, mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)

    def on_mission_set_current(self, message):
        pass

    def on_command_long(self, message):
        self.send(mavlink.MAVLink_command_ack_message(message.command, mavlink.MAV_RESULT_DENIED))


def test_what_a_vehicle_does_not_do_is_said(monkeypatch):
    monkeypatch.setattr("sparsor.link.missions.resending.ANSWER_S", 0.5)
    with Unwilling() as endpoint, Connection(endpoint.url) as connection:
        resender = Resender(connection, find_vehicle(connection, 1))
        with pytest.raises(LinkFailureError, match=r"does not clear its mission \(result 14\)"):
            resender.clear(MISSION)
        with pytest.raises(LinkFailureError, match="keeps no mission"):
            resender.download(MISSION)
        with pytest.raises(LinkFailureError, match="does not set the current item to 2"):
            resender.set_current(2)


def test_a_transfer_that_gets_no_further_ends(monkeypatch):
    for part in ("sending", "reading"):
        monkeypatch.setattr(f"sparsor.link.missions.{part}.PATIENCE_S", 0.8)
    endpoint = VehicleEndpoint()
    endpoint.on_mission_item_int = lambda _message: None
    endpoint.on_mission_request_list = lambda _message: None
    with endpoint, Connection(endpoint.url) as connection:
        vehicle, items = found_and_items(connection, "ardupilot", 6)
        resender = Resender(connection, vehicle)
        with pytest.raises(LinkFailureError, match="sending mission failed: the vehicle stopped asking at item 0"):
            resender.upload(MISSION, items[MISSION])
        with pytest.raises(LinkFailureError, match="reading its mission failed: the vehicle does not answer"):
            resender.download(MISSION)
