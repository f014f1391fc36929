"""The practice vehicle's own logs, read by pymavlink and pyulog, and served by the log protocol."""

from __future__ import annotations

import math
from itertools import count, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import DFReader
from pyulog import ULog

from link.logged_vehicle import COMPANION, logged_rig
from mission_strategies import AUTOPILOT_NAMES, example_plan
from practice_rig import ARM, STATION, Peer, Rig, mavlink, mission_messages
from sparsor.errors import OutputError
from sparsor.link.practice.dataflash import KINDS
from sparsor.link.practice.ulogfile import TOPICS

either = pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
CLOCK_S = count(1e6, 0.01)  # later than any rig's
# As in a log of ArduCopter 4.6.2: number, length, letters, fields.
REAL = {
    "FMT": (128, 89, "BBnNZ", "Type,Length,Name,Format,Columns"),
    "FMTU": (118, 44, "QBNN", "TimeUS,FmtType,UnitIds,MultIds"),
    "POS": (74, 31, "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    "GPS": (94, 51, "QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U"),
    "NVAL": (247, 37, "QINfBB", "TimeUS,TimeBootMS,Name,Value,SSys,SCom"),
    "MODE": (122, 14, "QMBB", "TimeUS,Mode,ModeNum,Rsn"),
    "BAT": (88, 41, "QBfffffcfBBB", "TimeUS,Inst,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct,H,SH"),
    "ARM": (186, 18, "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method"),
}


def flown(autopilot, folder):
    """A mission from take-off to disarming, with a companion's value on the way."""
    plan = example_plan(autopilot, stops=1)
    rig = Rig.of(autopilot, plan=plan, truth=lambda *_: 0.5, logs=folder)
    rig.run(10)
    rig.upload(mission_messages(plan, autopilot))
    rig.take_off()
    rig.run(5)
    rig.send(mavlink.MAVLink_named_value_float_message(77, b"0123456789", 3.5), COMPANION)
    assert rig.run(2000, until=lambda: not rig.flight.armed, step_s=0.05)
    rig.run(1)
    (path,) = folder.iterdir()
    return rig, path


@pytest.fixture(scope="module")
def bin_flight(tmp_path_factory):
    return flown("ardupilot", tmp_path_factory.mktemp("bin"))


@pytest.fixture(scope="module")
def ulg_flight(tmp_path_factory):
    return flown("px4", tmp_path_factory.mktemp("ulg"))


def bin_messages(path):
    reader = DFReader.DFReader_binary(str(path))
    found = {}
    while (message := reader.recv_msg()) is not None:
        found.setdefault(message.get_type(), []).append(message)
    return reader, found


def track_heights(rig, times_s):
    """How high the vehicle was, from what the rig saw; None where it did not look."""
    seen = {round(time_s, 3): up for time_s, _, _, up in rig.track}
    return [seen.get(round(time_s, 3)) for time_s in times_s]


def test_pymavlink_reads_a_flight_from_the_bin(bin_flight):
    rig, path = bin_flight
    assert path.name == "00000001.BIN"
    reader, found = bin_messages(path)
    assert reader.percent == pytest.approx(100, abs=0.1)
    for name, (number, length, letters, fields) in REAL.items():
        kind = next(one for one in reader.formats.values() if one.name == name)
        assert (kind.type, kind.len, kind.format, ",".join(kind.columns)) == (number, length, letters, fields)
    positions = found["POS"]
    assert [round((b.TimeUS - a.TimeUS) * 1e-6, 3) for a, b in pairwise(positions)] == [0.1] * (len(positions) - 1)
    assert [round((b.TimeUS - a.TimeUS) * 1e-6, 3) for a, b in pairwise(found["GPS"])] == [0.2] * (
        len(found["GPS"]) - 1
    )
    heights = track_heights(rig, [one.TimeUS * 1e-6 for one in positions])
    compared = [(one.RelHomeAlt, up) for one, up in zip(positions, heights, strict=True) if up is not None]
    assert len(compared) > 100
    assert max(abs(logged - up) for logged, up in compared) < 1e-3
    home = rig.vehicle.settings.home
    assert (positions[0].Lat, positions[0].Lng) == pytest.approx((home.lat_deg, home.lon_deg), abs=1e-6)
    assert max(one.Alt for one in positions) == pytest.approx(home.alt_amsl_m + 60, abs=0.5)
    assert [one.ArmState for one in found["ARM"]] == [1, 0]
    assert [one.CId for one in found["CMD"]][:2] == [16, 22]
    assert [one.ModeNum for one in found["MODE"]][:2] == [0, 3]
    texts = [one.Message for one in found["MSG"]]
    assert "Arming motors" in texts
    assert texts[-1] == "Disarming motors"


def test_a_bins_gps_time_is_the_vehicles_clock(bin_flight):
    rig, path = bin_flight
    _, found = bin_messages(path)
    for one in (found["GPS"][0], found["GPS"][-1]):
        unix_s = 315_964_800 + one.GWk * 604_800 + one.GMS * 1e-3 - 18
        assert unix_s == pytest.approx(rig.vehicle.settings.boot_unix_s + one.TimeUS * 1e-6, abs=6e-4)


def test_named_values_are_in_the_bin_with_their_senders(bin_flight):
    rig, path = bin_flight
    _, found = bin_messages(path)
    theirs = [one for one in found["NVAL"] if one.SCom == COMPANION.component]
    assert [(one.Name, one.Value, one.TimeBootMS, one.SSys) for one in theirs] == [("0123456789", 3.5, 77, 1)]
    ours = [(one.TimeUS * 1e-6, one.Value) for one in found["NVAL"] if one.Name == "NO2"]
    begun_s = found["ARM"][0].TimeUS * 1e-6
    ended_s = found["ARM"][1].TimeUS * 1e-6
    sent = [(one.time_s, one.value) for one in rig.vehicle.samples if begun_s < one.time_s <= ended_s - 0.06]
    assert len(sent) > 60
    assert [time_s for time_s, _ in ours][: len(sent)] == pytest.approx([time_s for time_s, _ in sent])
    assert [value for _, value in ours][: len(sent)] == pytest.approx([value for _, value in sent])


def test_every_kind_of_a_bin_has_a_unit_and_a_multiplier_for_each_field(bin_flight):
    _, path = bin_flight
    _, found = bin_messages(path)
    units, multipliers = ({chr(one.Id) for one in found[name]} for name in ("UNIT", "MULT"))
    assert {one.FmtType for one in found["FMTU"]} == {kind.number for kind in KINDS.values()}
    for one in found["FMTU"]:
        kind = next(kind for kind in KINDS.values() if kind.number == one.FmtType)
        assert len(one.UnitIds) == len(one.MultIds) == len(kind.letters) == len(kind.fields.split(","))
        assert set(one.UnitIds) <= units
        assert set(one.MultIds) <= multipliers


def test_pyulog_reads_a_flight_from_the_ulg(ulg_flight):
    rig, path = ulg_flight
    assert path.name.startswith("log_1_2023-11-14-22-13-")
    log = ULog(str(path))
    assert not log.file_corruption
    assert log.msg_info_dict["sys_name"] == "PX4"
    assert log.initial_parameters["MIS_DIST_1WP"] == rig.vehicle.parameters["MIS_DIST_1WP"]
    assert {one.name for one in log.data_list} == {topic.name for topic in TOPICS}
    position = log.get_dataset("vehicle_global_position").data
    times_s = position["timestamp"] * 1e-6
    assert all(math.isclose(b - a, 0.2, abs_tol=1e-6) for a, b in pairwise(times_s))
    home = rig.vehicle.settings.home
    heights = track_heights(rig, times_s)
    compared = [(alt, up) for alt, up in zip(position["alt"], heights, strict=True) if up is not None]
    assert len(compared) > 50
    assert max(abs(alt - home.alt_amsl_m - up) for alt, up in compared) < 1e-3
    assert (position["lat"][0], position["lon"][0]) == pytest.approx((home.lat_deg, home.lon_deg), abs=1e-6)
    status = log.get_dataset("vehicle_status").data
    assert (status["arming_state"][0], status["arming_state"][-1]) == (2, 1)
    assert 3 in status["nav_state"]
    gps = log.get_dataset("vehicle_gps_position").data
    boot_us = round(rig.vehicle.settings.boot_unix_s * 1e6)
    assert abs(int(gps["time_utc_usec"][-1]) - boot_us - int(gps["timestamp"][-1])) <= 1
    assert "Disarming motors" in [one.message for one in log.logged_messages]


def test_named_values_are_in_the_ulg_with_nine_characters(ulg_flight):
    rig, path = ulg_flight
    data = ULog(str(path)).get_dataset("debug_key_value").data
    rows = len(data["value"])
    keys = [bytes(int(data[f"key[{i}]"][row]) for i in range(10)).rstrip(b"\0").decode() for row in range(rows)]
    assert data["value"][keys.index("012345678")] == 3.5
    own = [value for key, value in zip(keys, data["value"], strict=True) if key == "NO2"]
    sent = {round(one.value, 3) for one in rig.vehicle.samples}
    assert len(own) > 60
    assert {round(float(value), 3) for value in own} <= sent


@either
def test_each_arming_begins_a_log_and_nothing_is_logged_while_disarmed(autopilot, tmp_path):
    suffix = "BIN" if autopilot == "ardupilot" else "ulg"
    (tmp_path / (f"00000007.{suffix}" if suffix == "BIN" else f"log_7_x.{suffix}")).write_bytes(b"of an earlier day")
    rig = logged_rig(autopilot, flights=2, logs=tmp_path)
    paths = [log.path for log in rig.vehicle._log.stored]
    assert [int(path.name.removeprefix("log_").split("_")[0].split(".")[0]) for path in paths] == [8, 9]
    sizes = [path.stat().st_size for path in paths]
    rig.send(mavlink.MAVLink_named_value_float_message(77, b"NO2C", 3.5), COMPANION)
    rig.run(5)
    assert [path.stat().st_size for path in paths] == sizes
    rig.vehicle._log.erase()
    assert all(path.exists() for path in paths)  # a folder of the user's


def test_a_full_card_ends_the_log_and_not_the_flight(tmp_path):
    folder = tmp_path / "logs"
    rig = Rig.of("ardupilot", logs=folder)
    folder.rmdir()
    rig.run(10)
    assert rig.command(ARM, 1) == 0
    rig.run(3)
    assert [text for text in rig.said() if text.startswith("Logging failed")] == [
        "Logging failed: No such file or directory"
    ]
    assert rig.flight.armed
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot make the folder"):
        Rig.of("ardupilot", logs=tmp_path / "file" / "logs")


def answers(rig, message, peer=STATION):
    """What comes, at once and later, until nothing comes any more."""
    out = [one.message for one in rig.vehicle.receive(message, peer, next(CLOCK_S))]
    while more := rig.vehicle._log_server.advance(next(CLOCK_S), armed=rig.flight.armed):
        out += [one.message for one in more]
    return out


def asked(rig, number, offset, count):
    out = answers(rig, mavlink.MAVLink_log_request_data_message(1, 1, number, offset, count))
    assert all(one.id == number for one in out)
    return [(one.ofs, bytes(one.data[: one.count])) for one in out]


@pytest.fixture(scope="module", params=AUTOPILOT_NAMES)
def twice_logged(request):
    return request.param, logged_rig(request.param, flights=2, seconds=5)


def test_the_list_counts_as_the_autopilot_does(twice_logged):
    autopilot, rig = twice_logged
    out = answers(rig, mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    first = 1 if autopilot == "ardupilot" else 0
    assert [(one.id, one.num_logs, one.last_log_num) for one in out] == [(first + n, 2, first + 1) for n in (0, 1)]
    assert [one.size for one in out] == [log.path.stat().st_size for log in rig.vehicle._log.stored]
    empty = answers(Rig.of(autopilot), mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert [(one.id, one.num_logs, one.size) for one in empty] == [(0, 0, 0)]


@given(offset=st.integers(0, 30_000), length=st.integers(0, 5_000), second=st.booleans())
def test_any_range_is_the_files_own_bytes(twice_logged, offset, length, second):
    autopilot, rig = twice_logged
    answers(rig, mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    whole = rig.vehicle._log.stored[second].path.read_bytes()
    got = asked(rig, int(second) + (autopilot == "ardupilot"), offset, length)
    assert b"".join(data for _, data in got) == whole[offset : offset + length]
    assert [at for at, _ in got] == [offset + 90 * n for n in range(len(got))]
    # The end of the log shows: a piece that is not full.
    assert len(got[-1][1]) < 90 or offset + length <= len(whole)


def test_what_is_not_there_is_not_answered(twice_logged):
    autopilot, rig = twice_logged
    answers(rig, mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert asked(rig, 2 + (autopilot == "ardupilot"), 0, 90) == []
    answers(rig, mavlink.MAVLink_log_request_end_message(1, 1))
    # PX4 sends data to those who listed; ArduPilot to anybody.
    assert bool(asked(rig, 1, 0, 90)) == (autopilot == "ardupilot")


def test_data_comes_at_a_bounded_rate():
    rig = logged_rig("ardupilot")
    server = rig.vehicle._log_server
    rig.vehicle.receive(mavlink.MAVLink_log_request_data_message(1, 1, 1, 0, 0xFFFFFFFF), STATION, 0.0)
    assert len(server.advance(100.0, armed=False)) == 40
    assert len(server.advance(100.0011, armed=False)) == 4


def test_ardupilot_sends_no_log_while_armed_and_says_so_once():
    rig = logged_rig("ardupilot")
    request = mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF)
    rig.command(ARM, 1)
    assert [one.text for one in answers(rig, request)] == ["Disarm for log download"]
    assert answers(rig, request) == []
    rig.command(ARM, 0)
    assert [one.get_type() for one in answers(rig, request)] == ["LOG_ENTRY"] * 2


def test_px4_sends_the_log_that_it_is_writing():
    rig = logged_rig("px4")
    rig.command(ARM, 1)
    rig.run(5)
    first, second = answers(rig, mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert 0 < second.size < first.size


def test_ardupilot_serves_one_link_at_a_time_and_px4_each():
    other = Peer(254, 190, 2)
    request = mavlink.MAVLink_log_request_data_message(1, 1, 1, 0, 0xFFFFFFFF)
    rig = logged_rig("ardupilot")
    assert len(rig.vehicle.receive(request, STATION, 0.0)) == 1
    assert rig.vehicle.receive(request, STATION, 0.0) == []
    (refused,) = rig.vehicle.receive(request, other, 0.0)
    assert (refused.message.text, refused.link) == ("Log download in progress", 2)
    rig.vehicle.leave(STATION.link)
    assert [one.link for one in rig.vehicle.receive(request, other, 0.0)] == [2]
    rig = logged_rig("px4", flights=2)
    for peer in (STATION, other):
        answers(rig, mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF), peer)
        assert [one.link for one in rig.vehicle.receive(request, peer, 0.0)] == [peer.link]


@either
def test_erased_logs_are_gone(autopilot):
    rig = logged_rig(autopilot, flights=2)
    paths = [log.path for log in rig.vehicle._log.stored]
    answers(rig, mavlink.MAVLink_log_erase_message(1, 1))
    (empty,) = answers(rig, mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert empty.num_logs == 0
    assert not any(path.exists() for path in paths)
