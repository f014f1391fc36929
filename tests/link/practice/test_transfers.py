"""The vehicle's side of the mission protocol, in any order and with any losses of the client's messages."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mission_strategies import AUTOPILOT_NAMES, example_plan
from practice_rig import FENCE, MISSION, RALLY, STATION, Rig, item_message, mission_messages
from sparsor.link.practice import items_ardupilot, items_px4
from sparsor.link.practice.exchange import Peer
from sparsor.link.practice.flavour import flavour_named
from sparsor.link.practice.storage import StoredItem, item_in
from sparsor.link.practice.transfer import MissionStore
from sparsor.link.practice.transfer_ardupilot import ArduPilotTransfers
from sparsor.link.practice.transfer_px4 import Px4Transfers
from sparsor.vehicle import AUTOPILOTS

OTHER = Peer(254, 190, 2)
HOME = StoredItem(16, 0, (0.0, 0.0, 0.0, 0.0), 252_650_000, 515_050_000, 12.5)
ACK = mavlink.MAV_MISSION_ACCEPTED
INVALID_7 = mavlink.MAV_MISSION_INVALID_PARAM7
either = pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
flavours = st.sampled_from(AUTOPILOT_NAMES)


def vehicle(autopilot):
    store = MissionStore(AUTOPILOTS[autopilot], HOME)
    make = Px4Transfers if autopilot == "px4" else ArduPilotTransfers
    return make(flavour_named(autopilot), store), store


def count(total, kind=MISSION):
    return mavlink.MAVLink_mission_count_message(1, 1, total, kind)


def waypoint(seq, *, hold=0.0, frame=3, kind=MISSION, command=16, lat=25.2, lon=51.5):
    return item_message(seq, command, frame, (hold, 0, 0, 0, lat + seq * 1e-4, lon, 50), kind)


def fence(corners):
    return [waypoint(seq, hold=corners, kind=FENCE, command=5001) for seq in range(corners)]


def rally(seq):
    return waypoint(seq, kind=RALLY, command=5100)


def partial(first, last, kind=MISSION):
    return mavlink.MAVLink_mission_write_partial_list_message(1, 1, first, last, kind)


def kept(messages, autopilot, kind=MISSION):
    """What a vehicle stores of messages that it takes."""
    judge = items_px4.judge if autopilot == "px4" else items_ardupilot.judge
    return [judge(item_in(one), kind)[1] for one in messages]


def acks(out):
    return [one.message.type for one in out if one.message.get_type() == "MISSION_ACK"]


def requests(out):
    return [one.message.seq for one in out if one.message.get_type().startswith("MISSION_REQUEST")]


items_of = st.lists(st.integers(0, 300), min_size=1, max_size=12).map(
    lambda holds: [waypoint(seq, hold=float(hold)) for seq, hold in enumerate(holds)]
)
anything_of = st.one_of(
    st.tuples(st.just(MISSION), items_of),
    st.tuples(st.just(FENCE), st.integers(3, 12).map(fence)),
    st.tuples(st.just(RALLY), st.integers(1, 8).map(lambda total: [rally(seq) for seq in range(total)])),
)


@settings(max_examples=150, deadline=None)
@given(flavours, anything_of, st.data())
def test_through_any_losses_and_duplicates_what_is_accepted_is_what_was_sent(autopilot, sent, data):
    """A client that repeats itself: each of its messages is lost, delivered once, or delivered twice."""
    machine, store = vehicle(autopilot)
    kind, items = sent
    now, finished = 0.0, []
    out = []
    for _ in range(400):
        wanted = requests(out)
        message = items[wanted[-1]] if wanted else count(len(items), kind) if not machine.busy else None
        out = []
        for _ in range(data.draw(st.integers(0, 2)) if message is not None else 0):
            out += machine.receive(message, STATION, now)
        finished += acks(out)
        if ACK in finished:
            break
        if not requests(out):
            now += data.draw(st.sampled_from([0.3, 1.1, 9.0]))
            out += machine.advance(now)
            finished += acks(out)
    if ACK in finished:
        stored = [store.item(kind, seq) for seq in range(len(store.items[kind]))]
        expected = kept(items, autopilot, kind)
        if autopilot == "ardupilot" and kind == MISSION:
            expected[0] = HOME
        assert stored == expected
        assert not machine.busy
    late = {mavlink.MAV_MISSION_INVALID_SEQUENCE, mavlink.MAV_MISSION_ERROR, mavlink.MAV_MISSION_OPERATION_CANCELLED}
    assert set(finished) <= {ACK, *late}


class Anything:
    """Any message of any client at any time."""

    kinds = st.sampled_from([MISSION, FENCE, RALLY, 7])
    seqs = st.integers(0, 6)
    messages = st.one_of(
        st.builds(count, st.sampled_from([0, 1, 3, 5, 700]), kinds),
        st.builds(lambda seq, kind, frame: waypoint(seq, kind=kind, frame=frame), seqs, kinds, st.sampled_from([3, 1])),
        st.builds(lambda seq: waypoint(seq, hold=3.0, kind=FENCE, command=5001), seqs),
        st.builds(rally, seqs),
        st.builds(partial, st.integers(-1, 6), st.integers(-1, 6), kinds),
        st.builds(lambda kind: mavlink.MAVLink_mission_request_list_message(1, 1, kind), kinds),
        st.builds(lambda seq, kind: mavlink.MAVLink_mission_request_int_message(1, 1, seq, kind), seqs, kinds),
        st.builds(lambda seq, kind: mavlink.MAVLink_mission_request_message(1, 1, seq, kind), seqs, kinds),
        st.builds(lambda kind: mavlink.MAVLink_mission_clear_all_message(1, 1, kind), kinds | st.just(255)),
        st.builds(
            lambda result, kind: mavlink.MAVLink_mission_ack_message(1, 1, result, kind), st.integers(0, 15), kinds
        ),
    )
    steps = st.lists(st.tuples(messages, st.sampled_from([STATION, OTHER]), st.floats(0, 6)), max_size=40)


@settings(max_examples=200, deadline=None)
@given(flavours, Anything.steps)
def test_any_messages_in_any_order_leave_a_vehicle_that_takes_a_mission(autopilot, steps):
    machine, store = vehicle(autopilot)
    now = 0.0
    for message, peer, wait in steps:
        now += wait
        held = {kind: list(items) for kind, items in store.items.items()}
        out = [*machine.advance(now), *machine.receive(message, peer, now)]
        for one in out:
            assert one.link in (None, STATION.link, OTHER.link)
            one.message.pack(mavlink.MAVLink(None))  # every answer is a message that can be sent
        said = {one.message.mission_type for one in out if acks([one]) == [ACK]}
        for kind in (MISSION, FENCE, RALLY):
            assert len(store.items[kind]) <= store.most(kind)
            # PX4 changes nothing before it is whole; ArduPilot's fences neither.
            if (autopilot == "px4" or kind == FENCE) and store.items[kind] != held[kind]:
                assert said & {kind, 255}
        if autopilot == "ardupilot":
            assert items_ardupilot.fence_fault(store.items[FENCE]) is None
    # After silence every transfer is over ...
    machine.advance(now + 10)
    machine.advance(now + 20)
    assert not machine.busy
    # ... and the next one works.
    items = [waypoint(0), waypoint(1, hold=4.0)]
    out = machine.receive(count(2), STATION, now + 20)
    for seq, item in enumerate(items):
        assert requests(out) == [seq]
        out = machine.receive(item, STATION, now + 20)
    assert acks(out) == [ACK]
    assert store.items[MISSION] == kept(items, autopilot)


@settings(max_examples=100, deadline=None)
@given(items_of, st.data())
def test_px4_keeps_its_old_mission_until_the_new_one_is_whole(items, data):
    machine, store = vehicle("px4")
    old = [replace(HOME, command=22)]
    store.replace(MISSION, old)
    stop = data.draw(st.integers(0, len(items) - 1))
    machine.receive(count(len(items)), STATION, 0.0)
    for item in items[:stop]:
        machine.receive(item, STATION, 0.0)
    machine.advance(6.0)
    assert store.items[MISSION] == old


def test_ardupilot_is_left_with_half_a_mission_when_an_upload_stops():
    machine, store = vehicle("ardupilot")
    store.replace(MISSION, [HOME] * 5)
    machine.receive(count(4), STATION, 0.0)
    for seq in range(2):
        machine.receive(waypoint(seq, hold=9.0), STATION, 0.0)
    assert acks(machine.advance(8.1)) == [mavlink.MAV_MISSION_OPERATION_CANCELLED]
    assert [item.params[0] for item in store.items[MISSION]] == [9, 9, 0, 0]


def test_a_late_duplicate_is_what_each_autopilot_makes_of_it():
    for autopilot, result in (("ardupilot", [mavlink.MAV_MISSION_INVALID_SEQUENCE]), ("px4", [])):
        machine, _ = vehicle(autopilot)
        machine.receive(count(3), STATION, 0.0)
        machine.receive(waypoint(0), STATION, 0.0)
        assert acks(machine.receive(waypoint(0), STATION, 0.0)) == result
        assert machine.busy


@pytest.mark.parametrize(("autopilot", "interval", "silent"), [("ardupilot", 1.0, 8.0), ("px4", 0.25, 5.0)])
def test_requests_are_repeated_and_given_up(autopilot, interval, silent):
    machine, _ = vehicle(autopilot)
    machine.receive(count(3), STATION, 0.0)
    assert machine.advance(interval - 0.01) == []
    assert requests(machine.advance(interval + 0.01)) == [0]
    machine.advance(silent + 0.1)
    assert not machine.busy
    assert requests(machine.advance(silent + 30)) == []


@either
def test_a_second_client_does_not_disturb_an_upload(autopilot):
    machine, store = vehicle(autopilot)
    machine.receive(count(2), STATION, 0.0)
    assert ACK not in acks(machine.receive(count(1), OTHER, 0.0))
    assert ACK not in acks(machine.receive(waypoint(0, hold=1.0), OTHER, 0.0))
    machine.receive(waypoint(0), STATION, 0.0)
    assert acks(machine.receive(waypoint(1), STATION, 0.0)) == [ACK]
    assert [item.params[0] for item in store.items[MISSION]] == [0, 0]


@either
@pytest.mark.parametrize("kind", [MISSION, FENCE, RALLY])
def test_limits_are_those_that_the_planner_knows(autopilot, kind):
    machine, store = vehicle(autopilot)
    facts = AUTOPILOTS[autopilot]
    most = (facts.max_items, facts.max_fence_points, facts.max_rally_points)[kind]
    assert store.most(kind) == most
    assert acks(machine.receive(count(most + 1, kind), STATION, 0.0)) == [mavlink.MAV_MISSION_NO_SPACE]
    assert requests(machine.receive(count(most, kind), STATION, 0.0)) == [0]


@pytest.mark.parametrize(
    ("autopilot", "item", "kind", "result"),
    [
        ("ardupilot", waypoint(0, frame=10), MISSION, ACK),
        ("px4", waypoint(0, frame=10), MISSION, mavlink.MAV_MISSION_UNSUPPORTED_FRAME),
        ("ardupilot", waypoint(0, frame=1), MISSION, mavlink.MAV_MISSION_UNSUPPORTED_FRAME),
        ("ardupilot", waypoint(0, command=183), MISSION, ACK),
        ("px4", waypoint(0, command=183, frame=2), MISSION, mavlink.MAV_MISSION_UNSUPPORTED),
        ("px4", waypoint(0, command=178, frame=3), MISSION, mavlink.MAV_MISSION_UNSUPPORTED),
        ("px4", waypoint(0, command=178, frame=2), MISSION, ACK),
        ("ardupilot", waypoint(0, command=178, frame=3), MISSION, ACK),
        ("ardupilot", waypoint(0, command=42702, frame=2), MISSION, ACK),
        (
            "ardupilot",
            item_message(0, 20, 2, (math.nan, 0, 0, 0, 0, 0, 0)),
            MISSION,
            mavlink.MAV_MISSION_INVALID_PARAM1,
        ),
        ("ardupilot", item_message(0, 16, 3, (0, 0, 0, math.nan, 25, 51, 50)), MISSION, ACK),
        ("ardupilot", item_message(0, 16, 3, (0, 0, 0, 0, 91, 51, 50)), MISSION, mavlink.MAV_MISSION_INVALID_PARAM5_X),
        ("ardupilot", item_message(0, 16, 3, (0, 0, 0, 0, 25, 181, 50)), MISSION, mavlink.MAV_MISSION_INVALID_PARAM6_Y),
        ("ardupilot", item_message(0, 16, 3, (0, 0, 0, 0, 0, 0, 50)), MISSION, ACK),  # nonsense is taken
        ("px4", waypoint(0, hold=2.0, kind=FENCE, command=5001), FENCE, mavlink.MAV_MISSION_ERROR),
        # PX4 guards only its missions against the items of other kinds.
        ("px4", waypoint(0, kind=RALLY, command=16), RALLY, ACK),
        ("px4", waypoint(0, command=5100), MISSION, mavlink.MAV_MISSION_ERROR),
        ("ardupilot", waypoint(0, kind=RALLY, command=16), RALLY, mavlink.MAV_MISSION_UNSUPPORTED),
        ("ardupilot", waypoint(0, kind=FENCE, command=16), FENCE, mavlink.MAV_MISSION_UNSUPPORTED),
        ("ardupilot", waypoint(0, hold=2.0, kind=FENCE, command=5001), FENCE, mavlink.MAV_MISSION_ERROR),
        ("ardupilot", waypoint(0, hold=0.0, kind=FENCE, command=5003), FENCE, mavlink.MAV_MISSION_ERROR),
        ("ardupilot", item_message(0, 5100, 3, (0, 0, 0, 0, 25, 51, 40_000), RALLY), RALLY, INVALID_7),
        ("ardupilot", item_message(0, 16, 3, (0, 0, 0, 0, 25, 51, 90_000)), MISSION, INVALID_7),
        ("ardupilot", item_message(0, 16, 2, (0, 0, 0, 0, 25, 51, 50)), MISSION, ACK),  # above the sea
        ("ardupilot", waypoint(0, command=18), MISSION, ACK),
        ("px4", waypoint(0, command=18), MISSION, mavlink.MAV_MISSION_UNSUPPORTED),
        ("px4", item_message(0, 201, 3, (1, 0, 0, 0, 25, 51, 50)), MISSION, mavlink.MAV_MISSION_INVALID_PARAM1),
        ("px4", item_message(0, 201, 3, (3, 0, 0, 0, 25, 51, 50)), MISSION, ACK),
        ("px4", item_message(0, 20, 2, (math.nan, 0, 0, 0, 0, 0, 0)), MISSION, ACK),
    ],
)
def test_what_is_taken_and_what_is_refused(autopilot, item, kind, result):
    machine, store = vehicle(autopilot)
    machine.receive(count(1, kind), STATION, 0.0)
    assert acks(machine.receive(item, STATION, 0.0)) == [result]
    assert not machine.busy
    assert bool(store.items[kind]) == (result == ACK)


def test_a_fence_with_a_missing_corner_is_refused_as_a_whole():
    machine, store = vehicle("ardupilot")
    corners = fence(4)[:3]
    machine.receive(count(3, FENCE), STATION, 0.0)
    for corner in corners[:2]:
        machine.receive(corner, STATION, 0.0)
    assert acks(machine.receive(corners[2], STATION, 0.0)) == [mavlink.MAV_MISSION_ERROR]
    assert store.items[FENCE] == []


@either
def test_what_is_read_back_of_our_plans_differs_as_documented(autopilot):
    plan = example_plan(autopilot)
    messages = mission_messages(plan, autopilot)
    rig = Rig.of(autopilot, plan=plan)
    assert rig.upload(messages) == ACK
    rig.send(mavlink.MAVLink_mission_request_list_message(1, 1, MISSION))
    for seq, sent in enumerate(messages):
        (got,) = rig.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, MISSION))
        assert (got.seq, got.command, got.x, got.y) == (seq, sent.command, sent.x, sent.y)
        assert got.current == (autopilot == "px4" and seq == 0)
        assert got.z == pytest.approx(sent.z, abs=0.005)
        assert got.param1 == sent.param1
        if autopilot == "px4":
            assert got.frame == {3: 6, 2: 2}[sent.frame]  # PX4 answers integers with an integer frame
            assert got.param2 == sent.param2
        else:
            assert got.frame == (0 if seq == 0 or sent.frame == 2 else 3)
            assert got.param4 == (sent.command == 21)  # a landing's turns clockwise
    rig.send(mavlink.MAVLink_mission_ack_message(1, 1, ACK, MISSION))


@either
def test_clearing_everything(autopilot):
    rig = Rig.of(autopilot)
    rig.upload([waypoint(0), waypoint(1)])
    rig.upload(fence(3), FENCE)
    rig.upload([waypoint(0, kind=RALLY, command=5100)], RALLY)
    rig.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 255))
    assert not any(rig.vehicle.store.items.values())


@either
def test_the_old_float_messages_still_work(autopilot):
    rig = Rig.of(autopilot)
    old = mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 22, 1, 1, 0, 0, 0, 0, 25.25, 51.5, 30, MISSION)
    assert rig.upload([old, waypoint(1)]) == ACK
    rig.send(mavlink.MAVLink_mission_request_list_message(1, 1, MISSION))
    for seq in (0, 1):
        (got,) = rig.send(mavlink.MAVLink_mission_request_message(1, 1, seq, MISSION))
        assert got.get_type() == "MISSION_ITEM"
    assert got.x == pytest.approx(25.2001, abs=1e-5)


def test_px4_asks_for_floats_until_a_client_wants_integers():
    machine, _ = vehicle("px4")

    def asked(out):
        return [one.message.get_type() for one in out]

    assert asked(machine.receive(count(2), STATION, 0.0)) == ["MISSION_REQUEST"]
    unsupported = mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_UNSUPPORTED, MISSION)
    assert asked(machine.receive(unsupported, STATION, 0.0)) == ["MISSION_REQUEST_INT"]
    assert asked(machine.receive(waypoint(0), STATION, 0.0)) == ["MISSION_REQUEST_INT"]
    machine.receive(waypoint(1), STATION, 0.0)
    assert asked(machine.receive(count(2), STATION, 1.0)) == ["MISSION_REQUEST_INT"]


def uploaded(autopilot, items, kind=MISSION):
    machine, store = vehicle(autopilot)
    machine.receive(count(len(items), kind), STATION, 0.0)
    out = [machine.receive(item, STATION, 0.0) for item in items][-1]
    return machine, store, acks(out)


def test_ardupilot_replaces_a_part_of_its_mission_and_adds_one_item():
    machine, store, _ = uploaded("ardupilot", [waypoint(seq) for seq in range(4)])
    assert requests(machine.receive(partial(2, 4), STATION, 1.0)) == [2]
    new = [waypoint(seq, hold=7.0) for seq in range(2, 5)]
    assert [acks(machine.receive(one, STATION, 1.0)) for one in new] == [[], [], [ACK]]
    assert [item.params[0] for item in store.items[MISSION]] == [0, 0, 7, 7, 7]


@pytest.mark.parametrize(("first", "last"), [(-1, 1), (2, 1), (0, 5), (5, 5)])
def test_ardupilot_refuses_a_part_that_its_mission_does_not_have(first, last):
    machine, store, _ = uploaded("ardupilot", [waypoint(seq) for seq in range(4)])
    before = list(store.items[MISSION])
    assert acks(machine.receive(partial(first, last), STATION, 1.0)) == [mavlink.MAV_MISSION_ERROR]
    assert not machine.busy
    assert store.items[MISSION] == before


def test_a_part_of_a_fence_leaves_it_whole_or_as_it_was():
    machine, store, _ = uploaded("ardupilot", fence(4), FENCE)
    before = list(store.items[FENCE])
    machine.receive(partial(1, 1, FENCE), STATION, 1.0)
    wrong = waypoint(1, hold=3.0, kind=FENCE, command=5001)
    assert acks(machine.receive(wrong, STATION, 1.0)) == [mavlink.MAV_MISSION_ERROR]
    assert store.items[FENCE] == before
    machine.receive(partial(1, 1, FENCE), STATION, 1.0)
    moved = waypoint(1, hold=4.0, kind=FENCE, command=5001, lon=51.6)
    assert acks(machine.receive(moved, STATION, 1.0)) == [ACK]
    assert store.items[FENCE] == [before[0], *kept([moved], "ardupilot", FENCE), *before[2:]]


def test_parts_during_an_upload_are_denied_and_px4_does_not_know_them():
    for autopilot, answer in (("ardupilot", [mavlink.MAV_MISSION_DENIED]), ("px4", [])):
        machine, _ = vehicle(autopilot)
        machine.receive(count(3), STATION, 0.0)
        assert acks(machine.receive(partial(0, 0), STATION, 0.0)) == answer
        assert machine.busy


@pytest.mark.parametrize(
    ("target", "result"), [(0, mavlink.MAV_MISSION_ERROR), (1, ACK), (3, mavlink.MAV_MISSION_ERROR)]
)
def test_ardupilot_takes_a_jump_to_an_item_that_there_is(target, result):
    jump = item_message(2, 177, 2, (target, 3, 0, 0, 0, 0, 0))
    assert uploaded("ardupilot", [waypoint(0), waypoint(1), jump])[2] == [result]


@pytest.mark.parametrize(
    ("autopilot", "sent", "read"),
    [
        ("ardupilot", (17, 3, (9, 9, -30.5, 9)), (3, (0, 0, -30, 0))),
        ("ardupilot", (18, 3, (2.9, 9, -300, 1)), (3, (2, 0, -300, 1))),
        ("ardupilot", (19, 3, (2.9, 9, -4, 0)), (3, (2, 0, -1, 0))),
        ("ardupilot", (21, 3, (0, 9, 9, -1)), (3, (0, 0, 0, -1))),
        ("ardupilot", (16, 6, (1.9, 9, 9, 9)), (3, (1, 0, 0, 0))),
        ("ardupilot", (178, 3, (1, 5, -1, 9)), (0, (1, 5, -1, 0))),
        ("px4", (16, 3, (1.5, 2, 9, -90)), (6, (1.5, 2, 0, 270))),
        ("px4", (19, 0, (2.5, 9, 30, 9)), (5, (2.5, 1, 30, 1))),
        ("px4", (22, 3, (9, 9, 9, 10)), (6, (0, 0, 0, 10))),
        ("px4", (178, 2, (1, 5, -1, 9)), (2, (1, 5, -1, 9))),
        ("px4", (177, 2, (0, -1, 0, 0)), (2, (0, 65_535, 0, 0))),
    ],
)
def test_what_each_autopilot_makes_of_the_parameters(autopilot, sent, read):
    command, frame, params = sent
    rig = Rig.of(autopilot)
    assert rig.upload([waypoint(0), item_message(1, command, frame, (*params, 0, 0, 50))]) == ACK
    rig.send(mavlink.MAVLink_mission_request_list_message(1, 1, MISSION))
    rig.send(mavlink.MAVLink_mission_request_int_message(1, 1, 0, MISSION))
    (got,) = rig.send(mavlink.MAVLink_mission_request_int_message(1, 1, 1, MISSION))
    assert (got.frame, (got.param1, got.param2, got.param3, got.param4)) == read


def test_a_request_beyond_the_end_is_told_how_much_there_is():
    machine, _, _ = uploaded("ardupilot", [waypoint(0), waypoint(1)])
    told, refused = machine.receive(mavlink.MAVLink_mission_request_int_message(1, 1, 9, MISSION), STATION, 1.0)
    assert told.message.count == 2
    assert acks([refused]) == [mavlink.MAV_MISSION_INVALID_SEQUENCE]
    empty, _ = vehicle("ardupilot")
    (home,) = empty.receive(mavlink.MAVLink_mission_request_int_message(1, 1, 0, MISSION), STATION, 1.0)
    assert (home.message.x, home.message.y) == (HOME.x, HOME.y)


def test_a_mission_that_px4_knows_already_resets_nothing():
    items = [waypoint(seq) for seq in range(3)]
    machine, store, _ = uploaded("px4", items)
    changes, store.current = store.changes[MISSION], 2
    machine.receive(count(3), STATION, 1.0)
    assert [acks(machine.receive(item, STATION, 1.0)) for item in items][-1] == [ACK]
    assert (store.changes[MISSION], store.current) == (changes, 2)
