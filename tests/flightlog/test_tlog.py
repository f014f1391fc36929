"""Real .tlog records, whole and damaged: what pymavlink packs comes out, and nothing else."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flightlog.logs import BOOT_UNIX_S, TlogMaker, flight, v1, v2
from sparsor.core.mavlink_frames import LONGEST, FrameReader
from sparsor.flightlog.assembly import assemble
from sparsor.flightlog.messages import NAMED_VALUE_FLOAT, WANTED, Table, layout, read_messages
from sparsor.flightlog.tlog import read_tlog

names = st.binary(min_size=1, max_size=10).filter(lambda raw: b"\x00" not in raw)


def named_values(content):
    """(Source, boot time, name, value) of every NAMED_VALUE_FLOAT, by us."""
    return Counter(
        (values.sender, round(stamp * 1e3), values.name, repr(value))  # NaN equals itself in words
        for values in read_tlog([content]).values
        if values.message == "NAMED_VALUE_FLOAT"
        for stamp, value in zip(values.stamp_s.tolist(), values.value.tolist(), strict=True)
    )


def collisions(content):
    """Every frame with a right checksum that nobody sent: one false beginning in 65 536 makes one."""
    found = set()
    for at in range(len(content)):
        if content[at] in (0xFD, 0xFE):
            found |= {frame.raw for frame in FrameReader().feed(content[at : at + LONGEST])[:1]}
    return found - {record[8:] for record in RECORDS}


@given(st.lists(st.tuples(st.integers(0, 2**32 - 1), names, st.floats(width=32, allow_nan=False)), max_size=20))
@settings(deadline=None)
@pytest.mark.parametrize("dialect", [v1, v2])
def test_what_pymavlink_writes_is_read_back(dialect, rows):
    maker = TlogMaker(dialect=dialect, key=bytes(32) if dialect is v2 and len(rows) % 2 else None)
    for stamp_ms, name, value in rows:
        maker.named(stamp_ms, 1.0, value, name)
    tables, scanner = read_messages([maker.content])
    table = tables.get((NAMED_VALUE_FLOAT, 1, 1), Table.empty(NAMED_VALUE_FLOAT))
    assert table.fields["time_boot_ms"].tolist() == [row[0] for row in rows]
    assert table.fields["name"].tolist() == [row[1] for row in rows]
    assert table.fields["value"].tolist() == [row[2] for row in rows]
    assert (scanner.frames, scanner.skipped) == (len(rows), 0)


def test_every_layout_begins_as_pymavlinks():
    for message in WANTED:
        kind = v2.mavlink_map[message]
        assert layout(message).names == tuple(kind.ordered_fieldnames[: len(layout(message).names)])
        assert layout(message).itemsize <= kind.unpacker.size


WHOLE = flight(10).content
WHOLE_VALUES = named_values(WHOLE)
RECORDS = flight(10).records

damages = st.one_of(
    st.tuples(st.just("cut"), st.integers(0, len(WHOLE)), st.integers(1, 300)),
    st.tuples(st.just("insert"), st.integers(0, len(WHOLE)), st.binary(min_size=1, max_size=300)),
    st.tuples(st.just("flip"), st.integers(0, len(WHOLE) - 1), st.integers(1, 255)),
)


@given(st.lists(damages, min_size=1, max_size=8), st.randoms(use_true_random=False), st.booleans())
@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_damage_adds_nothing_and_costs_only_what_it_touches(hurt, random, shuffled):
    records = list(RECORDS)
    if shuffled:
        random.shuffle(records)
    content = bytearray(b"".join(records))
    for kind, at, what in hurt:
        if kind == "cut":
            del content[at : at + what]
        elif kind == "insert":
            content[at:at] = what
        elif at < len(content):
            content[at] ^= what
    damaged = bytes(content)
    found = named_values(damaged)
    foreign = set(found) - set(WHOLE_VALUES)
    survived = Counter()
    for record in records:
        if record[8:] in damaged:
            survived += named_values(record)
    if foreign or not survived <= found:  # a collision adds what it says and may hide what lies inside it
        collided = collisions(damaged)
        assert collided
        assert foreign <= set().union(*(named_values(bytes(8) + raw) for raw in collided))
    assemble("damaged", read_tlog([damaged]))


@given(st.binary(max_size=2000))
@settings(deadline=None)
def test_any_bytes_are_read_to_the_end(content):
    log = assemble("noise", read_tlog([content]))
    assert log.damage.skipped_bytes <= len(content)


@given(st.lists(st.integers(0, len(WHOLE)), max_size=5))
@settings(max_examples=20, deadline=None)
def test_the_blocks_never_matter(cuts):
    ends = [0, *sorted(cuts), len(WHOLE)]
    parts = [WHOLE[a:b] for a, b in pairwise(ends)]
    one, other = assemble("x", read_tlog(parts)), assemble("x", read_tlog([WHOLE]))
    assert one.damage == other.damage
    assert np.array_equal(one.values[0].value, other.values[0].value)
    assert np.array_equal(one.boots[0].tracks[0].time_s, other.boots[0].tracks[0].time_s)


def test_boots_are_told_apart_and_dated():
    maker = flight(30)
    flight(30, start_s=2.0, maker=maker)
    log = assemble("two", read_tlog([maker.content]))
    assert [(boot.number, boot.start_s, boot.end_s) for boot in log.boots] == [(0, 10.0, 40.0), (1, 2.0, 32.0)]
    assert [boot.unix_offset_s for boot in log.boots] == pytest.approx([BOOT_UNIX_S] * 2, abs=0.01)


def test_a_ground_stations_time_is_not_the_vehicles():
    maker = flight(10)
    maker.add(v2.MAVLink_system_time_message(5 * 10**15, 0), 5.0, system=255, component=190)
    (boot,) = assemble("x", read_tlog([maker.content])).boots
    assert (boot.system, boot.unix_source) == (1, "vehicle")
    assert boot.unix_offset_s == pytest.approx(BOOT_UNIX_S, abs=0.01)


def test_what_happened_is_listed_once():
    maker = TlogMaker()
    for second in range(8):
        maker.position(second, second, 51.5, 25.3)
        armed = 128 if 2 <= second < 6 else 0
        maker.add(v2.MAVLink_heartbeat_message(2, 3, armed, 3 if armed else 0, 4, 3), second + 0.1)
        maker.add(v2.MAVLink_heartbeat_message(18, 8, 128, 9, 4, 3), second + 0.2, component=191)
        maker.add(v2.MAVLink_mission_current_message(second // 4), second + 0.3)
        maker.add(v2.MAVLink_extended_sys_state_message(0, 2 if armed else 1), second + 0.4)
    maker.add(v2.MAVLink_mission_item_reached_message(1), 8.0)
    maker.add(v2.MAVLink_statustext_message(4, b"a" * 50, 7, 0), 8.1)
    maker.add(v2.MAVLink_statustext_message(4, b"end", 7, 1), 8.2)
    events = assemble("x", read_tlog([maker.content])).events
    told = [(event.kind, event.value) for event in events if event.kind != "text"]
    assert Counter(told) == Counter(
        [
            *[("armed", 0), ("disarmed", 0), ("mode", 0), ("mode", 3), ("mode", 0), ("item_reached", 1)],
            *[("item_current", 0), ("item_current", 1), ("landed_state", 1), ("landed_state", 2), ("landed_state", 1)],
        ]
    )
    assert [event.text for event in events if event.kind == "text"] == ["a" * 50 + "end"]
    assert 1.0 < next(event.time_s for event in events if event.kind == "armed") < 3.0


def test_vectors_arrays_and_integers_are_named_by_part():
    maker = flight(5)
    maker.add(v2.MAVLink_debug_vect_message(b"wind", 11_000_000, 1.0, 2.0, 3.0), 6.0)
    maker.add(v2.MAVLink_debug_float_array_message(11_000_000, b"cells", 1, [0.5, 0.0, 1.5] + [0.0] * 55), 6.0)
    maker.add(v2.MAVLink_named_value_int_message(11_000, b"count", -7), 6.0)
    series = {values.name: values.value.tolist() for values in read_tlog([maker.content]).values}
    assert {name: series[name] for name in series if name != "NO2"} == {
        "wind.x": [1.0],
        "wind.y": [2.0],
        "wind.z": [3.0],
        "cells[0]": [0.5],
        "cells[1]": [0.0],
        "cells[2]": [1.5],
        "count": [-7.0],
    }
