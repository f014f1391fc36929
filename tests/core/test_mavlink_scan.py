"""The compiled scanner finds in a .tlog what the recorder's reader finds in a stream, wherever the file is cut."""

from __future__ import annotations

import struct
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v10 import ardupilotmega as v1
from pymavlink.dialects.v20 import ardupilotmega as v2

from sparsor.core.mavlink_frames import FrameReader
from sparsor.core.mavlink_scan import TlogScanner

KEY = bytes(range(32))
STAMP = 1_700_000_000_000_000


def packed(dialect, number, kind, *, signed):
    sender = dialect.MAVLink(None, 1 + number % 3, 1 + number % 2)
    sender.seq = number % 256
    if signed and dialect is v2:
        sender.signing.secret_key, sender.signing.timestamp, sender.signing.sign_outgoing = KEY, 1, True
    messages = (
        lambda: dialect.MAVLink_heartbeat_message(2, 3, 81, number, 3, 3),
        lambda: dialect.MAVLink_named_value_float_message(number, b"0123456789", 0.5 * number),
        lambda: dialect.MAVLink_statustext_message(6, b"\xfe\xfd" * 12),
        lambda: dialect.MAVLink_attitude_message(number, 0, 0, 0, 0, 0, 0),
    )
    return messages[kind]().pack(sender)


frames = st.builds(
    lambda dialect, number, kind, signed: packed(dialect, number, kind, signed=signed),
    st.sampled_from([v1, v2]),
    st.integers(0, 100_000),
    st.integers(0, 3),
    st.booleans(),
)
stamps = st.integers(STAMP, STAMP + 10**10)
records = st.builds(lambda stamp, frame: (stamp, frame), stamps, frames)
dirt = st.binary(max_size=20).map(lambda data: data.replace(b"\xfe", b"x").replace(b"\xfd", b"x"))


def log_of(rows):
    return b"".join(struct.pack(">Q", stamp) + frame for stamp, frame in rows)


def scan(data, cuts=()):
    scanner = TlogScanner({0, 30, 251, 253})
    ends = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    found = []
    for number, (a, b) in enumerate(pairwise(ends)):
        block = scanner.feed(data[a:b], ended=number == len(ends) - 2)
        for one in block.records:
            payload = block.data[one["at"] : one["at"] + one["length"]].tobytes()
            sender = (int(one["system"]), int(one["component"]))
            found.append((int(one["order"]), int(one["stamp_us"]), int(one["message"]), sender, payload))
    return found, scanner


@given(st.lists(records, max_size=12), st.lists(st.integers(0, 3000), max_size=6))
@settings(deadline=None)
def test_a_whole_log_gives_the_frames_that_the_stream_reader_gives(rows, cuts):
    found, scanner = scan(log_of(rows), cuts)
    reader = FrameReader()
    theirs = [one for _, frame in rows for one in reader.feed(frame)]
    assert [one[2:] for one in found] == [
        (one.message_id, (one.system_id, one.component_id), one.payload) for one in theirs
    ]
    assert [one[1] for one in found] == [stamp for stamp, _ in rows]
    assert (scanner.frames, scanner.skipped, scanner.damaged) == (len(rows), 0, 0)


@given(st.lists(st.tuples(dirt, records), max_size=8), dirt, st.lists(st.integers(0, 3000), max_size=6))
@settings(deadline=None)
def test_what_lies_between_the_records_costs_none_and_the_cuts_never_matter(parts, tail, cuts):
    data = b"".join(noise + log_of([record]) for noise, record in parts) + tail
    found, scanner = scan(data, cuts)
    again, whole = scan(data)
    assert found == again
    assert (scanner.skipped, scanner.damaged, scanner.lost) == (whole.skipped, whole.damaged, whole.lost)
    assert [one[1] for one in found] == [record[0] for _, record in parts]
    assert scanner.skipped == len(tail) + sum(len(noise) for noise, _ in parts)


def test_unknown_messages_are_counted_and_cost_nothing():
    unknown = bytes([0xFD, 3, 0, 0, 9, 1, 1, 0xF0, 0xFF, 0xFE, 1, 2, 3, 0, 0])
    beat = packed(v2, 7, 0, signed=False)
    found, scanner = scan(log_of([(STAMP, beat), (STAMP, unknown), (STAMP, unknown), (STAMP, beat)]))
    assert len(found) == 2
    assert (scanner.unknown, scanner.skipped, scanner.damaged) == (2, 0, 0)


def test_an_unknown_message_that_claims_true_frames_does_not_get_them():
    beat = packed(v2, 7, 0, signed=False)
    greedy = bytes([0xFD, 60, 0, 0, 9, 1, 1, 0xF0, 0xFF, 0xFE, 1])
    found, scanner = scan(log_of([(STAMP, beat), (STAMP, greedy), *[(STAMP, beat)] * 4]))
    assert len(found) == 5
    assert scanner.unknown == 0


def test_a_true_frame_behind_half_a_stamp_is_not_taken_for_an_unknown_message():
    sender = v2.MAVLink(None, 1, 1)
    sender.seq = 0xFD  # with what follows, the head of a message that nobody knows: found by fuzz_logs.py
    value = v2.MAVLink_named_value_float_message(180_000, b"NO2", 1.5).pack(sender)
    beat = packed(v2, 7, 0, signed=False)
    cut = log_of([(STAMP, value)])[4:]
    found, scanner = scan(log_of([(STAMP, beat)]) + cut + log_of([(STAMP, beat)] * 3))
    assert [one[2] for one in found] == [0, 251, 0, 0, 0]
    assert scanner.unknown == 0


def test_the_senders_counters_tell_what_is_missing():
    rows = [(STAMP, packed(v2, number, 0, signed=False)) for number in (6, 12, 24, 30)]  # one sender
    _, scanner = scan(log_of(rows))
    assert scanner.lost == 5 + 11 + 5
    assert scanner.heard() == {(1, 1): 4}


@pytest.mark.parametrize("message", [30, 251])
def test_zeros_that_mavlink_2_leaves_out_are_there_again(message):
    import numpy as np

    layout = np.dtype([("time_boot_ms", "<u4"), ("rest", "u1", (14,))])
    kind = {30: 3, 251: 1}[message]
    scanner = TlogScanner({message})
    block = scanner.feed(log_of([(STAMP, packed(v2, 0, kind, signed=False))]), ended=True)
    (group,) = scanner.groups(block)
    assert block.records["length"][0] < layout.itemsize or message == 251
    assert group.fields(layout)["time_boot_ms"].tolist() == [0]


@given(st.lists(records, max_size=30))
@settings(deadline=None)
def test_the_groups_are_the_records_apart_by_message_and_sender(rows):
    scanner = TlogScanner((251, 0, 30))
    for _ in range(2):  # the second block's groups know nothing of the first one's
        block = scanner.feed(log_of(rows), ended=True)
        told = [(int(one["message"]), int(one["system"]), int(one["component"])) for one in block.records]
        groups = {(one.message, one.system, one.component): one.rows.tolist() for one in scanner.groups(block)}
        assert groups == {key: [row for row, one in enumerate(told) if one == key] for key in told}
