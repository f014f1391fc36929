"""Frames out of a byte stream: what pymavlink packs comes out, however the stream is cut or soiled."""

from __future__ import annotations

import hashlib
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v10 import ardupilotmega as v1
from pymavlink.dialects.v20 import ardupilotmega as v2
from pymavlink.generator.mavcrc import x25crc

from sparsor.core.mavlink_frames import Frame, FrameReader, checksum

SIGNING_KEY = hashlib.sha256(b"key").digest()


def packed(dialect, number, kind, *, signed=False):
    """One frame by pymavlink; kinds of messages with trailing zeros, arrays and text among them."""
    sender = dialect.MAVLink(None, srcSystem=1 + number % 250, srcComponent=number % 200)
    sender.seq = number % 256
    if signed:
        sender.signing.secret_key = SIGNING_KEY
        sender.signing.timestamp = 1
        sender.signing.sign_outgoing = True
    messages = (
        lambda: dialect.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3),
        lambda: dialect.MAVLink_named_value_float_message(number, b"NO2", 0.5 * number),
        lambda: dialect.MAVLink_mission_ack_message(0, 0, 0),
        lambda: dialect.MAVLink_statustext_message(6, b"\xfe\xfd" * 12),
        lambda: dialect.MAVLink_param_request_list_message(0, 0),
    )
    return messages[kind % len(messages)]().pack(sender)


frames = st.builds(
    lambda dialect, number, kind, signed: packed(dialect, number, kind, signed=signed and dialect is v2),
    st.sampled_from([v1, v2]),
    st.integers(0, 10_000),
    st.integers(0, 4),
    st.booleans(),
)
# Noise that cannot be taken for the beginning of a frame; noise that can is a test of its own.
noise = st.binary(max_size=30).map(lambda data: data.replace(b"\xfe", b"x").replace(b"\xfd", b"x"))


def read(data, cuts=()):
    reader = FrameReader()
    ends = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    found = [frame for a, b in pairwise(ends) for frame in reader.feed(data[a:b])]
    found += reader.flush()
    return [frame.raw for frame in found], reader.skipped


@given(st.lists(st.tuples(noise, frames), max_size=8), noise, st.lists(st.integers(0, 2000), max_size=12))
def test_all_frames_come_out_whatever_lies_between_and_wherever_it_is_cut(parts, tail, cuts):
    stream = b"".join(dirt + frame for dirt, frame in parts) + tail
    found, skipped = read(stream, cuts)
    assert found == [frame for _, frame in parts]
    assert skipped == len(tail) + sum(len(dirt) for dirt, _ in parts)


@given(st.binary(max_size=300), st.lists(frames, max_size=5), st.lists(st.integers(0, 2000), max_size=12))
def test_the_cuts_never_matter_and_no_byte_is_lost(dirt, parts, cuts):
    stream = dirt + b"".join(parts)
    found, skipped = read(stream, cuts)
    assert (found, skipped) == read(stream)
    assert sum(map(len, found)) + skipped == len(stream)
    assert set(parts[2:]) <= set(found) or len(dirt) > 0


@given(frames, frames, st.data())
def test_a_frame_cut_short_costs_only_itself(first, second, data):
    kept = data.draw(st.integers(0, len(first) - 1))
    after = [second] * 12  # a cut header may claim the 280 bytes that follow it, not more
    found, _ = read(first[:kept] + b"".join(after))
    assert found[-10:] == after[-10:]  # a signature that is cut short is made up from the bytes that follow


@given(frames, st.data())
def test_one_changed_byte_is_noticed(frame, data):
    place = data.draw(st.integers(1, len(frame) - 1))
    signed = Frame(frame).signed
    if signed and place >= len(frame) - 13:
        return  # the signature is not covered by the checksum
    changed = bytearray(frame)
    changed[place] ^= data.draw(st.integers(1, 255))
    heard = v2.mavlink_map.get(Frame(bytes(changed)).message_id)
    if heard is None:
        return  # a message that nobody knows has no checksum to judge by
    assert bytes(changed) not in read(bytes(changed))[0]


@given(st.binary(max_size=300))
@settings(max_examples=50)
def test_the_checksum_is_pymavlinks(data):
    assert checksum(data) == x25crc(data).crc


@pytest.mark.parametrize("dialect", [v1, v2])
def test_a_frame_says_what_pymavlink_says(dialect):
    raw = packed(dialect, 77, 1)
    message = v2.MAVLink(None).decode(bytearray(raw))
    frame = Frame(raw)
    assert (frame.system_id, frame.component_id) == (message.get_srcSystem(), message.get_srcComponent())
    assert (frame.sequence, frame.message_id) == (message.get_seq(), message.get_msgId())
    assert frame.payload == raw[6:-2] if dialect is v1 else raw[10:-2]


def test_a_message_nobody_knows_is_kept_between_frames_without_a_gap():
    unknown = bytes([0xFD, 3, 0, 0, 9, 1, 1, 0xF0, 0xFF, 0xFE, 1, 2, 3, 0, 0])
    beat = packed(v2, 1, 0)
    assert read(beat + unknown + beat)[0] == [beat, unknown, beat]
    assert read(beat + unknown)[0] == [beat, unknown]
    assert read(beat + unknown + b"x" + beat)[0] == [beat, beat]
    assert read(beat + b"x" + unknown + beat)[0] == [beat, beat]


def test_a_frame_with_an_unknown_incompatibility_flag_is_passed_over():
    odd = bytearray(packed(v2, 1, 0))
    odd[2] = 0x02
    assert read(bytes(odd))[0] == []
