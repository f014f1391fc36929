"""A long log is thinned: what is left out lies as near as promised to what is kept, and every value stays."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightlog.logs import TlogMaker, bin_flight, flight, place, v2
from sparsor.flightlog import samples
from sparsor.flightlog.assembly import assemble
from sparsor.flightlog.binlog import read_bin
from sparsor.flightlog.positions import interpolated
from sparsor.flightlog.sampling import MAX_GAP_S
from sparsor.flightlog.thinning import CLOCK_S, PLACE_DEG, PLACE_M, ChangedRows, Course, Rows, ThinnedRows
from sparsor.flightlog.tlog import read_tlog

WITHIN, APART = 2.0, 7.0
steps = st.sampled_from([0.0, 0.5, 1.0, 1.0, 1.0, 1.0, 3.0, 9.0, -4.0])
rises = st.sampled_from([0.0, 0.0, 0.0, 1.0, -1.0, 2.5, 50.0])
rows = st.lists(st.tuples(steps, rises, rises, st.sampled_from([0, 0, 0, 0, 0, 0, 1])), max_size=80)


def columns_of(steps_and_rises):
    changes = np.array(steps_and_rises, dtype=np.float64).reshape(-1, 4)
    along, one, other = np.cumsum(changes[:, :3], axis=0).T
    return np.arange(along.size), along, one, other, changes[:, 3].astype(np.int64)


def course_of(_number, along, one, other, state):
    return Course(along, np.stack((one, other), axis=1), state)


def thinned(columns, cuts=(), whole=0):
    kept = ThinnedRows(course_of, (WITHIN, WITHIN), APART, whole)
    ends = [0, *sorted(cut % (columns[0].size + 1) for cut in cuts), columns[0].size]
    for start, end in pairwise(ends):
        kept.add(*(column[start:end] for column in columns))
    return kept.joined()


@given(rows, st.lists(st.integers(0, 80), max_size=6))
@settings(deadline=None)
def test_lines_between_the_rows_that_are_kept_meet_the_others(steps_and_rises, cuts):
    columns = columns_of(steps_and_rises)
    number, along, *across, state = columns
    result = thinned(columns, cuts)
    if number.size == 0:
        assert result == ()
        return
    kept, stands_for = result[0], result[-1]
    assert kept[0] == 0
    assert (np.diff(kept) > 0).all()
    for first, last, count in zip(kept, kept[1:], stands_for[1:], strict=False):
        between = np.arange(first + 1, last)
        assert count == between.size + 1
        here = along[between] == along[first]  # said again at once
        line = between[~here]
        if line.size:
            assert along[last] - along[first] <= APART
            assert (along[first] <= along[line]).all()
            assert (along[line] <= along[last]).all()
            assert (state[first : last + 1] == state[first]).all()
        for values in across:
            assert (np.abs(values[between[here]] - values[first]) <= WITHIN).all()
            at = np.interp(along[line], along[[first, last]], values[[first, last]])
            assert (np.abs(values[line] - at) <= WITHIN + 1e-9).all()
    behind = np.arange(kept[-1] + 1, number.size)  # nothing but repetitions of the last row
    assert (along[behind] == along[kept[-1]]).all()


@given(rows, st.lists(st.integers(0, 80), max_size=6))
@settings(deadline=None)
def test_the_blocks_never_matter_and_few_rows_are_all_kept(steps_and_rises, cuts):
    columns = columns_of(steps_and_rises)
    for one, other in zip(thinned(columns), thinned(columns, cuts), strict=True):
        assert one.tolist() == other.tolist()
    for one, other in zip(thinned(columns, cuts, whole=80), columns, strict=False):
        assert one.tolist() == other.tolist()


@given(st.lists(st.lists(st.integers(0, 2), max_size=9), max_size=9))
@settings(deadline=None)
def test_rows_come_out_as_they_went_in_and_changes_once(blocks):
    kept, changed = Rows(), ChangedRows()
    for block in blocks:
        for collected in (kept, changed):
            collected.add(np.array(block, dtype=np.float32), np.array(block, dtype=np.int64))
    values = [value for block in blocks for value in block]
    for collected, expected in ((kept, values), (changed, values[:1] + [b for a, b in pairwise(values) if a != b])):
        for column in collected.joined():
            assert column.tolist() == expected


def long_flight():
    """Straight legs, a stop, a turn, climbs, a time without position, a restart, and values of a companion."""
    maker = TlogMaker()
    for boot, start_s in enumerate((10.0, 3.0)):
        lon, lat, up = *place(start_s), 0.0
        for tenth in range(4000):
            boot_s = start_s + tenth / 10
            received_s = 1000.0 * boot + boot_s + 0.01 * (tenth % 3)
            leg = tenth // 500 % 4
            lon += (5e-6, 0.0, 3e-6, -5e-6)[leg]
            lat += (0.0, 0.0, 3e-6 * np.sin(tenth / 40), 1e-6)[leg]
            up += 0.1 if leg == 1 else 0.0
            known = not 2000 <= tenth < 2100
            maker.position(boot_s, received_s, *((lon, lat) if known else (0.0, 0.0)), up=up)
            maker.add(v2.MAVLink_attitude_message(round(boot_s * 1e3) + 20, 0, 0, 0, 0, 0, 0), received_s + 0.021)
            if tenth % 5 == 2:
                maker.gps(boot_s, received_s + 0.03, lon, lat, fix=3 if tenth > 50 else 1)
                maker.named(round(boot_s * 1e3), received_s + 0.04, 0.5 * tenth)
                maker.named(round(boot_s * 50) + 77, received_s + 0.05, 0.1 * tenth, b"NO2C", component=191)
            if tenth % 10 == 0:
                maker.time(boot_s, received_s + 0.06)
                armed = 128 if 300 < tenth < 3000 else 0
                maker.add(v2.MAVLink_heartbeat_message(2, 3, armed, leg, 4, 3), received_s + 0.07)
    return maker.content


@pytest.fixture(scope="module")
def whole_and_thinned():
    content = long_flight()
    blocks = [content[at : at + 50_000] for at in range(0, len(content), 50_000)]
    return assemble("whole", read_tlog(blocks)), assemble("thinned", read_tlog(blocks, whole=1000))


def test_a_thinned_log_has_few_positions_left_and_all_values(whole_and_thinned):
    whole, few = whole_and_thinned
    for one, other in zip(whole.values, few.values, strict=True):
        assert (one.name, one.value.tolist(), one.stamp_s.tolist()) == (
            other.name,
            other.value.tolist(),
            other.stamp_s.tolist(),
        )
    assert [(event.kind, event.value, event.boot) for event in whole.events] == [
        (event.kind, event.value, event.boot) for event in few.events
    ]
    assert np.abs([a.time_s - b.time_s for a, b in zip(whole.events, few.events, strict=True)]).max() <= 2 * CLOCK_S
    for one, other in zip(whole.boots, few.boots, strict=True):
        assert (one.number, one.start_s) == (other.number, other.start_s)
        assert one.end_s == pytest.approx(other.end_s, abs=CLOCK_S)
        assert one.unix_offset_s == pytest.approx(other.unix_offset_s, abs=2 * CLOCK_S)
        for mine, theirs in zip(one.tracks, other.tracks, strict=True):
            assert theirs.time_s.size < 0.2 * mine.time_s.size
            assert theirs.dropped == mine.dropped


def test_a_thinned_track_passes_every_position_as_near_as_promised(whole_and_thinned):
    whole, few = whole_and_thinned
    for one, other in zip(whole.boots, few.boots, strict=True):
        for mine, theirs in zip(one.tracks, other.tracks, strict=True):
            at, known = interpolated(theirs, mine.time_s, MAX_GAP_S)
            assert (known == interpolated(mine, mine.time_s, MAX_GAP_S)[1]).all()
            assert np.abs(at.lon_deg - mine.places.lon_deg)[known].max() <= PLACE_DEG * 1.01
            assert np.abs(at.lat_deg - mine.places.lat_deg)[known].max() <= PLACE_DEG * 1.01
            assert np.abs(at.alt_amsl_m - mine.places.alt_amsl_m)[known].max() <= PLACE_M * 1.01


@pytest.mark.parametrize("sensor", ["NO2", "NO2C"])
def test_the_samples_of_a_thinned_log_are_where_those_of_the_whole_one_are(whole_and_thinned, sensor):
    one, other = (samples(log, sensor=sensor) for log in whole_and_thinned)
    assert one.value.tolist() == other.value.tolist()
    assert [use.clock for use in one.clocks] == [use.clock for use in other.clocks]
    fast_deg_s = 7e-5
    for name in ("lon_deg", "lat_deg"):
        apart = np.abs(getattr(one, name) - getattr(other, name)).max()
        assert apart <= PLACE_DEG * 1.01 + (0.0 if sensor == "NO2" else CLOCK_S * fast_deg_s)
    assert np.abs(one.time_s - other.time_s).max() <= (0.0 if sensor == "NO2" else CLOCK_S)


def test_a_short_log_is_not_thinned():
    content = flight(60).content
    (boot,), (same,) = (assemble("x", read_tlog([content], **how)).boots for how in ({}, {"whole": 241}))
    assert boot.tracks[0].time_s.size == same.tracks[0].time_s.size == 241


def test_a_thinned_bin_log_keeps_its_values_and_their_places():
    content = bin_flight(120)
    blocks = [content[at : at + 5000] for at in range(0, len(content), 5000)]
    one, other = (assemble("x", read_bin(blocks, whole=whole)) for whole in (10**6, 50))
    mine, theirs = (log.boots[0].tracks[0] for log in (one, other))
    assert theirs.time_s.size < 0.2 * mine.time_s.size
    at, known = interpolated(theirs, mine.time_s, MAX_GAP_S)
    assert known.all()
    assert np.abs(at.lon_deg - mine.places.lon_deg).max() <= PLACE_DEG * 1.01
    for sensor in ("NO2S.NO2", "NO2C"):
        whole, few = (samples(log, sensor=sensor) for log in (one, other))
        assert whole.value.tolist() == few.value.tolist()
        assert np.abs(whole.time_s - few.time_s).max() <= CLOCK_S
