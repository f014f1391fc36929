"""Parameters read and set, and a fence that is enforced or left as it was."""

from __future__ import annotations

import dataclasses

import pytest

from link.bad_link import BadLink
from link.flight_rig import practice, short_plan, url_of
from sparsor.errors import LeftBehindError, LinkError, LinkFailureError, StoppedError
from sparsor.link.connection import Connection
from sparsor.link.fence import enforce_fence, fence_ceiling_m, fence_enforced, order_fence
from sparsor.link.missions.upload import upload_plan
from sparsor.link.parameters import Parameter, read_parameter, set_parameter
from sparsor.link.vehicles import find_vehicle

INT8, INT32 = 2, 6


@pytest.mark.parametrize(
    ("autopilot", "name", "after"),
    [("ardupilot", "FENCE_TYPE", 4), ("ardupilot", "FENCE_ALT_MAX", 87.5), ("px4", "GF_ACTION", 3),
     ("px4", "RTL_RETURN_ALT", 42.5)],
)  # fmt: skip
def test_a_parameter_is_set_over_a_link_that_loses(autopilot, name, after, monkeypatch):
    monkeypatch.setattr("sparsor.link.parameters.ANSWER_S", 0.2)
    with (
        practice(autopilot) as server,
        BadLink(server.udp_port, loss=0.3, twice=0.2) as link,
        Connection(link.url) as connection,
    ):
        vehicle = find_vehicle(connection, 1)
        told = read_parameter(connection, vehicle, name)
        assert told.value == server.autopilot.parameters[name] != after
        set_parameter(connection, vehicle, dataclasses.replace(told, value=after))
        assert server.autopilot.parameters[name] == after
        assert read_parameter(connection, vehicle, name).value == after


def test_a_parameter_that_is_not_there_or_not_taken(monkeypatch):
    monkeypatch.setattr("sparsor.link.parameters.ANSWER_S", 0.1)
    with practice() as server, Connection(url_of(server)) as connection:
        vehicle = find_vehicle(connection, 1)
        assert read_parameter(connection, vehicle, "NO_SUCH") is None
        with pytest.raises(LinkFailureError, match=r"NO_SUCH to 1 failed.*does not answer"):
            set_parameter(connection, vehicle, Parameter("NO_SUCH", 1.0, INT8))
        with pytest.raises(LinkFailureError, match=r"MIS_TOTAL to 5 failed.*keeps 0"):
            set_parameter(connection, vehicle, Parameter("MIS_TOTAL", 5.0, INT8))


def test_the_polygon_alone_is_enforced_on_ardupilot():
    with practice() as server, Connection(url_of(server)) as connection:
        vehicle, values = find_vehicle(connection, 1), server.autopilot.parameters
        assert fence_enforced(connection, vehicle) is False
        enforce_fence(connection, vehicle, order_fence(connection, vehicle, short_plan()))
        assert (values["FENCE_ENABLE"], values["FENCE_TYPE"]) == (1, 4)
        assert fence_enforced(connection, vehicle) is True
        assert fence_ceiling_m(connection, vehicle) is None  # the ceiling is not armed with it
        values.set("FENCE_ACTION", 0.0)
        assert "reports a breach" in order_fence(connection, vehicle, short_plan()).warnings[0]


@pytest.mark.parametrize(("action", "wanted"), [(0, 2), (1, 2), (2, 2), (5, 5)])
def test_px4_holds_at_its_fence_where_it_would_do_nothing(action, wanted):
    with practice("px4") as server, Connection(url_of(server)) as connection:
        vehicle, values = find_vehicle(connection, 1), server.autopilot.parameters
        values.set("GF_ACTION", float(action))
        assert fence_enforced(connection, vehicle) is (action >= 2)
        enforce_fence(connection, vehicle, order_fence(connection, vehicle, short_plan("px4")))
        assert values["GF_ACTION"] == wanted


def refuse(server, name):
    """Let the vehicle keep one parameter as it is, whatever is sent."""
    values = server.autopilot.parameters
    receive = values.receive

    def stubborn(message, peer):
        kept = values[name]
        out = receive(message, peer)
        if message.get_type() == "PARAM_SET" and values[name] != kept:
            values.set(name, kept)
            return [values._value(name, peer)]
        return out

    values.receive = stubborn


def refuse_after_one(server, name):
    """Let the vehicle take one change of a parameter and no other."""
    receive = server.autopilot.parameters.receive

    def once(message, peer):
        out = receive(message, peer)
        if message.get_type() == "PARAM_SET" and message.param_id == name:
            server.autopilot.parameters.receive = receive
            refuse(server, name)
        return out

    server.autopilot.parameters.receive = once


@pytest.mark.parametrize(
    ("autopilot", "stubborn", "held"),
    [("ardupilot", "FENCE_ENABLE", {"FENCE_TYPE": 7, "FENCE_ENABLE": 0}), ("px4", "GF_ACTION", {"GF_ACTION": 0})],
)
def test_a_fence_that_cannot_be_enforced_leaves_what_was_set(autopilot, stubborn, held, monkeypatch):
    monkeypatch.setattr("sparsor.link.parameters.ANSWER_S", 0.1)
    with practice(autopilot) as server, Connection(url_of(server)) as connection:
        values = server.autopilot.parameters
        for name, value in held.items():
            values.set(name, float(value))
        refuse(server, stubborn)
        with pytest.raises(LeftBehindError, match=rf"not enforced.*{stubborn}.*again.*holds the new plan") as failed:
            upload_plan(short_plan(autopilot), connection, find_vehicle(connection, 1), enable_fence=True)
        assert failed.value.exit_code == 1
        assert failed.value.vehicle_state == "new plan"
        assert {name: values[name] for name in held} == held
        assert server.autopilot.store.items[0]


def test_a_fence_that_can_neither_be_enforced_nor_set_back(monkeypatch):
    monkeypatch.setattr("sparsor.link.parameters.ANSWER_S", 0.05)
    with practice() as server, Connection(url_of(server)) as connection:
        refuse(server, "FENCE_ENABLE")
        asked = order_fence(connection, find_vehicle(connection, 1), short_plan())
        refuse_after_one(server, "FENCE_TYPE")
        words = "could not be set again either: see to it that it has FENCE_TYPE 7 and FENCE_ENABLE 0"
        with pytest.raises(LinkFailureError, match=words):
            enforce_fence(connection, find_vehicle(connection, 1), asked)


def test_a_vehicle_that_does_not_tell_of_its_fence_is_not_changed(monkeypatch):
    monkeypatch.setattr("sparsor.link.parameters.ANSWER_S", 0.05)
    with practice() as server, Connection(url_of(server)) as connection:
        vehicle = find_vehicle(connection, 1)
        server.autopilot.parameters.receive = lambda *_: []
        assert fence_enforced(connection, vehicle) is None
        with pytest.raises(LinkFailureError, match="does not tell FENCE_TYPE"):
            order_fence(connection, vehicle, short_plan())


def test_a_ctrl_c_while_the_fence_is_enforced_leaves_what_was_set(monkeypatch):
    from sparsor.link import fence

    sent = fence.set_parameter

    def interrupted(connection, vehicle, wanted):
        sent(connection, vehicle, wanted)
        if (wanted.name, wanted.value) == ("FENCE_ENABLE", 1.0):
            raise KeyboardInterrupt

    monkeypatch.setattr(fence, "set_parameter", interrupted)
    with practice() as server, Connection(url_of(server)) as connection:
        with pytest.raises(StoppedError, match=r"FENCE_TYPE 7 and FENCE_ENABLE 0 again"):
            upload_plan(short_plan(), connection, find_vehicle(connection, 1), enable_fence=True)
        values = server.autopilot.parameters
        assert (values["FENCE_TYPE"], values["FENCE_ENABLE"]) == (7, 0)


def test_nothing_is_sent_where_there_is_no_fence_or_the_upload_fails():
    bare = dataclasses.replace(short_plan(), fences=())
    with practice() as server, Connection(url_of(server)) as connection:
        vehicle, values = find_vehicle(connection, 1), server.autopilot.parameters
        with pytest.raises(LinkError, match="no fence to enforce"):
            upload_plan(bare, connection, vehicle, enable_fence=True)
        assert not server.autopilot.store.items[0]
        other = dataclasses.replace(vehicle, firmware_type=12)
        with pytest.raises(LinkError, match="plan is for ArduPilot"):
            upload_plan(short_plan(), connection, other, enable_fence=True)
        assert (values["FENCE_TYPE"], values["FENCE_ENABLE"]) == (7, 0)
