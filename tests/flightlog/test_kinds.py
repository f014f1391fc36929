"""Logs of every kind give the same samples; what is no log, or a broken one, is an error in words."""

from __future__ import annotations

import gzip
import lzma
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flightlog.logs import bin_flight, flight, table_flight, ulog_flight, value_at
from sparsor.errors import LogError
from sparsor.flightlog import read_log, read_logs, samples
from sparsor.flightlog.assembly import assemble
from sparsor.flightlog.binlog import read_bin
from sparsor.flightlog.opening import LogFile
from sparsor.flightlog.table import read_table
from sparsor.flightlog.ulog import read_ulog
from sparsor.flightlog.ulogrepair import mended

KINDS = {
    "tlog": (flight().content, None),
    "BIN": (bin_flight(), "NO2S.NO2"),
    "ulg": (ulog_flight(), "NO2"),
    "CSV": (table_flight(), None),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pack", [bytes, gzip.compress, lzma.compress], ids=["plain", "gz", "xz"])
def test_the_contents_say_what_a_file_is(tmp_path, kind, pack):
    content, sensor = KINDS[kind]
    path = tmp_path / "flight.dat"
    path.write_bytes(pack(content))
    log = read_log(path)
    found = samples(log, sensor=sensor)
    assert log.kinds == (kind,)
    assert found.value.size == 60
    assert found.value == pytest.approx([value_at(lon) for lon in found.lon_deg], abs=1e-3)
    assert found.time_s == pytest.approx(10.5 + np.arange(60), abs=0.11)
    assert found.alt_m == pytest.approx(np.full(60, 40.0), abs=1e-3)


@pytest.mark.parametrize("kind", ["tlog", "BIN", "CSV"])
def test_garbage_at_the_start_does_not_hide_the_kind(tmp_path, kind):
    path = tmp_path / "flight"
    path.write_bytes((b"# a note, of the user\n" if kind == "CSV" else bytes(range(1, 200))) + KINDS[kind][0])
    if kind == "CSV":
        with pytest.raises(LogError, match="its columns are"):
            read_log(path)
    else:
        log = read_log(path)
        assert log.kinds == (kind,)
        assert log.damage.skipped_bytes > 0


@pytest.mark.parametrize("pack", [gzip.compress, lzma.compress])
def test_a_packed_file_that_breaks_off_is_read_to_there(tmp_path, pack):
    path = tmp_path / "flight.tlog.packed"
    whole = pack(flight(600).content)
    path.write_bytes(whole[: len(whole) * 2 // 3])
    log = read_log(path)
    assert 0 < samples(log).value.size < 600
    assert log.damage.places >= 1


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (bytes(5000), "is not a flight log"),
        (b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 9, "is not a flight log"),
        (b"a,b,c\n1,2,3\n", "its columns are a, b, c"),
        (b"time,lon,lat\n1,2,3\n", "its columns are time, lon, lat"),
        (b"ULog\x01\x12\x35\x01" + bytes(3), "cannot be read"),
        (gzip.compress(b"", mtime=0), "is empty"),
    ],
)
def test_what_is_no_log_is_an_error_that_names_it(tmp_path, content, words):
    path = tmp_path / "thing"
    path.write_bytes(content)
    with pytest.raises(LogError, match=words) as error:
        samples(read_log(path))
    assert str(path) in str(error.value) or path.name in str(error.value)
    assert error.value.exit_code == 2


def test_a_missing_file_a_folder_and_no_file_at_all(tmp_path):
    with pytest.raises(LogError, match="No such file"):
        read_log(tmp_path / "none.tlog")
    with pytest.raises(LogError, match="is a folder"):
        read_log(tmp_path)
    with pytest.raises(LogError, match="no log was given"):
        read_logs([])


def test_progress_ends_at_the_whole_file(tmp_path):
    path = tmp_path / "flight.tlog"
    path.write_bytes(flight().content)
    told = []
    read_log(path, progress=lambda task, done, total: told.append((task, done, total)))
    size = path.stat().st_size
    assert told[-1] == ("reading flight.tlog", size, size)


def test_a_bin_log_holds_what_the_vehicle_received_and_any_field_that_is_asked_for(tmp_path):
    path = tmp_path / "flight.BIN"
    path.write_bytes(bin_flight())
    log = read_log(path, sensor="TEMP.T")
    companion = samples(log, sensor="NO2C")
    assert (tuple(companion.sender), companion.clocks[0].clock) == ((1, 191), "companion")
    assert companion.clocks[0].rate == pytest.approx(0.1, rel=1e-3)
    assert samples(log, sensor="TEMP.T").value.tolist() == [21.0] * 60
    assert "TEMP.T" in log.fields
    assert [event.kind for event in log.events] == ["armed"]
    with pytest.raises(LogError, match=r"NO2S has .*NO2S\.NO2"):
        samples(log, sensor="NO2S.SO2")


def test_a_px4_log_holds_vectors_texts_and_landings(tmp_path):
    path = tmp_path / "flight.ulg"
    path.write_bytes(ulog_flight())
    log = read_log(path)
    assert samples(log, sensor="wind.y").value.tolist() == [2.0] * 60
    assert [(event.kind, event.value, event.text) for event in log.events] == [
        ("landed_state", 1, ""),
        ("text", 6, "take-off"),
        ("landed_state", 2, ""),
    ]


TABLES = {
    "other names": "Timestamp;Latitude (deg);Longitude (deg);Altitude [m];NO2\n{t};25.3;51.5;40;7,5\n",
    "tabs and milliseconds": "time_ms\tlng\tlat\tNO2 ppb\n{ms}\t51.5\t25.3\t7.5\n",
    "dates": "date_time,lat,lon,alt,NO2\n{date},25.3,51.5,40,7.5\n",
    "unix milliseconds": "t,lat,lon,NO2\n1700000000000,25.3,51.5,7.5\n",
}


@pytest.mark.parametrize("kind", TABLES)
def test_tables_come_in_many_shapes(kind):
    text = TABLES[kind].format(t="12.25", ms="12250", date="2023-11-14T22:13:20Z")
    (values,) = read_table([text.encode()]).values
    assert values.value.tolist() == [7.5]
    assert values.places is not None
    assert (values.places.lon_deg.tolist(), values.places.lat_deg.tolist()) == ([51.5], [25.3])
    log = assemble("t.csv", read_table([text.encode()]))
    if "12" in text[-40:] and kind in ("other names", "tabs and milliseconds"):
        assert values.stamp_s.tolist() == [12.25]
    else:
        assert log.boots[0].unix_offset_s + values.stamp_s[0] == 1_700_000_000


def test_a_missing_value_leaves_out_only_itself():
    text = "time,lon,lat,NO2,O3\n1,51.5,25.3,1,\n2,51.5,25.3,,3\n3,,25.3,4,5\n4,51.5,25.3,6,7\n"
    recording = read_table([text.encode()])
    assert {values.name: values.value.tolist() for values in recording.values} == {"NO2": [1.0, 6.0], "O3": [3.0, 7.0]}
    assert recording.damage.places == 1


@pytest.mark.parametrize("cell", ["1\x1f", "1_0", "\u0661", "0x10", "1e", "inf", "1 2"])
def test_a_cell_that_is_no_plain_number_is_no_value(cell):
    (values,) = read_table([f"time,lon,lat,NO2\n1,51.5,25.3,{cell}\n2,51.5,25.3, +2.5e0\t\n".encode()]).values
    assert values.value.tolist() == [2.5]


def readers(content):
    for read in (lambda data: read_bin([data], "NO2S.NO2"), read_ulog, lambda data: read_table([data])):
        yield lambda read=read: assemble("damaged", read(content))


@given(
    st.sampled_from(["BIN", "ulg", "CSV"]),
    st.lists(st.tuples(st.sampled_from("xid"), st.integers(0, 20_000), st.binary(min_size=1, max_size=40)), max_size=8),
)
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_damage_is_never_more_than_a_log_error(kind, hurt):
    content = bytearray({"BIN": SHORT_BIN, "ulg": SHORT_ULOG, "CSV": SHORT_TABLE}[kind])
    for how, place, what in hurt:
        at = place % max(len(content), 1)
        end = at if how == "i" else at + len(what)
        content[at:end] = b"" if how == "d" else what
    for read in readers(bytes(content)):
        try:
            log = read()
        except LogError as error:
            assert str(error)
            continue
        for values in log.values:
            with suppress(LogError):
                samples(log, sensor=f"{values.name}@{values.sender}")


def test_the_blocks_of_a_bin_log_never_matter():
    content = bin_flight(20)
    one = read_bin([content])
    other = read_bin([content[at : at + 700] for at in range(0, len(content), 700)])
    assert [v.value.tolist() for v in one.values] == [v.value.tolist() for v in other.values]
    assert one.damage == other.damage


@given(st.lists(st.tuples(st.integers(300, 5000), st.integers(0, 60), st.binary(max_size=60)), min_size=1, max_size=4))
@settings(max_examples=60, deadline=None)
def test_damage_in_a_px4_log_costs_the_messages_that_it_touches(hurt):
    content = bytearray(LONG_ULOG)
    at = len(content)
    touched = 0
    for back, cut, inserted in hurt:  # from the end to the definitions
        at = max(at - back, 1000)
        content[at : at + cut] = inserted
        touched += len(inserted) + cut
    places, skipped = (mended(bytes(content))[number] for number in (2, 1))
    whole, damaged = read_ulog(LONG_ULOG), read_ulog(bytes(content))
    for one in whole.values:
        rest = next(values for values in damaged.values if values.name == one.name)
        # Beside what a cut touches, the message before it is lost with the head that it led to; what is inserted may
        # pass for a message of at most half a thousand bytes.
        lost = one.value.size - rest.value.size
        assert lost <= len(hurt) * (2 + 512 // 30)
    assert skipped <= touched + len(hurt) * 2 * 512
    assert places <= 4 * len(hurt) + touched


def test_rubbish_behind_a_names_end_is_no_other_sensor():
    content = bytearray(LONG_ULOG)
    at = content.rfind(b"NO2\x00\x00") + 5
    content[at] = 0x80
    whole, other = (
        [(one.name, one.value.tolist()) for one in read_ulog(bytes(one)).values] for one in (LONG_ULOG, content)
    )
    assert other == whole


def test_a_whole_px4_log_and_one_that_breaks_off_are_left_alone():
    for end in (len(LONG_ULOG), len(LONG_ULOG) - 5, len(LONG_ULOG) // 2):
        content = LONG_ULOG[:end]
        assert mended(content)[0] is content


def test_a_cut_in_a_bin_log_costs_the_message_it_cuts():
    content = bin_flight(20)
    whole, cut = read_bin([content]), read_bin([content[:3000] + content[3010:]])
    lost = [a.value.size - b.value.size for a, b in zip(whole.values, cut.values, strict=True)]
    assert cut.damage.places == 1
    assert sum(lost) <= 1
    for a, b in zip(whole.values, cut.values, strict=True):
        assert set(b.value.tolist()) <= set(a.value.tolist())


@pytest.mark.parametrize("size", [1, 7, 1000])
@pytest.mark.parametrize("kind", TABLES)
def test_the_blocks_of_a_table_never_matter(kind, size):
    text = TABLES[kind].format(t="12.25", ms="12250", date="2023-11-14T22:13:20Z")
    content = f'\ufeff{text}no time,"a\nb",\u00b5\n\n'.encode()
    one, other = read_table([content]), read_table([content[at : at + size] for at in range(0, len(content), size)])
    assert [v.value.tolist() for v in one.values] == [v.value.tolist() for v in other.values]
    assert one.damage == other.damage


def test_a_log_that_has_to_be_read_at_once_may_not_be_endless(tmp_path):
    path = tmp_path / "flight.ulg"
    path.write_bytes(ulog_flight(5))
    with pytest.raises(LogError, match=r"flight\.ulg' is longer than 0\.0 GB .* give the logs of single flights"):
        LogFile(path).contents(most=1000)
    assert LogFile(path).contents() == path.read_bytes()


def test_damage_in_a_table_costs_the_rows_that_it_touches():
    rows = [f"{second},51.5,25.3,40,{second}.5" for second in range(9)]
    rows[3], rows[5], rows[7] = '3,51.5,"25.3,40,3.5', "5,5\r1.5,25.3,40,5.5", "7,51.5," + "2" * 200_000
    (values,) = read_table(["\n".join(["time_s,lon,lat,alt,NO2", *rows, ""]).encode()]).values
    assert values.value.tolist() == [0.5, 1.5, 2.5, 4.5, 6.5, 8.5]


@pytest.mark.parametrize("time", ["01.05.2024 12:00:00", "12:00:00", ""])
def test_a_table_whose_times_nobody_can_read_is_refused(time):
    with pytest.raises(LogError, match="none of its 1 rows has a time and a place"):
        read_table([f"time,lon,lat,NO2\n{time},51.5,25.3,1\n".encode()])


def test_a_table_without_a_value_is_refused():
    with pytest.raises(LogError, match="no number stands under NO2, O3"):
        read_table([b"time,lon,lat,NO2,O3\n1,51.5,25.3,nan,\n"])


LONG_ULOG = ulog_flight(60)
SHORT_BIN, SHORT_ULOG, SHORT_TABLE = bin_flight(5), ulog_flight(5), table_flight(5)
