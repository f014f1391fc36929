"""Fetching the vehicle's logs: from the practice autopilot, over bad links, and by clients that we did not write."""

from __future__ import annotations

import json
import sys
import threading
import time

import pytest

from link.bad_link import BadLink
from link.logged_vehicle import served_logs, url_of
from link.practice.test_clients import mavsdk_system, mavutil_client
from mission_strategies import AUTOPILOT_NAMES
from practice_rig import mavlink
from sparsor.cli import main
from sparsor.errors import LinkError, LinkFailureError, OutputError
from sparsor.link.vehiclelogs import client
from sparsor.link.vehiclelogs.download import download, list_logs
from sparsor.link.vehiclelogs.window import CHUNK, Pace, Window

either = pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM


def first_of(autopilot):
    return 1 if autopilot == "ardupilot" else 0


@either
def test_the_last_log_and_all_of_them_under_the_vehicles_names(autopilot, tmp_path):
    with served_logs(autopilot, flights=2, seconds=5) as (server, held):
        vehicle, entries = list_logs(url_of(server), timeout_s=10)
        first = first_of(autopilot)
        assert vehicle.system_id == 1
        assert [(entry.number, entry.size) for entry in entries] == [(first + n, len(held[n])) for n in (0, 1)]
        assert [entry.date for entry in entries] == ["2023-11-14T22:13:30Z", "2023-11-14T22:13:36Z"]
        (last,) = download(url_of(server), tmp_path / "last", timeout_s=10).logs
        assert (last.log, last.size) == (first + 1, len(held[1]))
        assert last.file.read_bytes() == held[1]
        made = download(url_of(server), tmp_path / "made" / "here", every=True, timeout_s=10).logs
        assert [one.file.read_bytes() for one in made] == held
        names = {"ardupilot": "00000002.BIN", "px4": "log_1_2023-11-14-22-13-36.ulg"}
        assert made[1].file.name == names[autopilot]
        new = tmp_path / "new"
        (in_folder,) = download(url_of(server), new, into_folder=True, timeout_s=10).logs
        assert in_folder.file == new / names[autopilot]
        (by_number,) = download(url_of(server), tmp_path, number=first, timeout_s=10).logs
        assert by_number.file.read_bytes() == held[0]
        assert by_number.file.parent == tmp_path


@either
def test_a_log_comes_whole_over_a_link_that_loses_and_repeats(autopilot, tmp_path):
    seen = []
    with (
        served_logs(autopilot, seconds=120) as (server, held),
        BadLink(server.udp_port, loss=0.1, twice=0.1, delay_s=0.02) as bad,
    ):
        made = download(bad.url, tmp_path / "log", timeout_s=60, progress=lambda *told: seen.append(told))
    assert made.logs[0].file.read_bytes() == held[0]
    assert len(held[0]) > 30_000
    assert [done for _, done, _ in seen] == sorted(done for _, done, _ in seen)
    assert seen[-1][1:] == (len(held[0]), len(held[0]))
    assert [path.name for path in tmp_path.iterdir()] == ["log"]


def test_a_link_that_dies_leaves_no_file(tmp_path):
    with served_logs("ardupilot", seconds=120) as (server, _), BadLink(server.udp_port) as link:

        def die(*_):
            link.loss = 1.0

        with pytest.raises(LinkFailureError, match=r"stopped sending log 1 after .* of .* bytes: nothing new for 4 s"):
            download(link.url, tmp_path / "log", timeout_s=4, progress=die)
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_meant_is_refused(tmp_path):
    there = tmp_path / "there.BIN"
    there.write_bytes(b"old")
    with pytest.raises(LinkError, match=r"there.BIN' is there already; give another name, or --force"):
        download("udpout://127.0.0.1:9", there)  # before anything is sent
    with served_logs("ardupilot", flights=2, seconds=1) as (server, held):
        with pytest.raises(LinkError, match="has no log 3; it has 1, 2"):
            download(url_of(server), tmp_path / "log", number=3, timeout_s=10)
        (tmp_path / "00000002.BIN").touch()
        with pytest.raises(LinkError, match=r"00000002.BIN' is there already"):
            download(url_of(server), tmp_path, timeout_s=10)
        with pytest.raises(OutputError, match="cannot write"):
            download(url_of(server), tmp_path / "no" / "folder", timeout_s=10)
        download(url_of(server), there, replace=True, timeout_s=10)
        assert there.read_bytes() == held[1]
    with (
        served_logs("px4", flights=0) as (server, _),
        pytest.raises(LinkError, match="has no log; autopilots log from"),
    ):
        download(url_of(server), tmp_path / "log", timeout_s=10)


def armed(server):
    with mavutil_client(f"udpout:127.0.0.1:{server.udp_port}") as client:
        deadline_s = time.monotonic() + 10
        while not server.autopilot.flight.armed and time.monotonic() < deadline_s:
            client.mav.command_long_send(1, 1, ARM, 0, 1, 21196, 0, 0, 0, 0, 0)
            client.recv_match(type="COMMAND_ACK", blocking=True, timeout=1)
    assert server.autopilot.flight.armed


def test_ardupilots_refusal_while_armed_is_passed_on_after_a_warning(tmp_path):
    said = []
    with served_logs("ardupilot", seconds=1) as (server, _):
        armed(server)
        with pytest.raises(
            LinkFailureError, match=r"refuses: 'Disarm for log download'\. Fetch the log after the landing"
        ):
            download(url_of(server), tmp_path / "log", timeout_s=10, warn=said.append)
    assert "sends no log while armed" in said[0]


def test_px4_gives_what_it_has_while_armed(tmp_path):
    with served_logs("px4", seconds=1) as (server, held):
        armed(server)
        (one,) = download(url_of(server), tmp_path / "log", timeout_s=10).logs
        assert one.log == 1
        assert one.file.read_bytes()[:7] == held[0][:7]


def test_another_ground_stations_end_does_not_stop_a_download_from_px4(tmp_path):
    """PX4 then sends nothing until the logs are listed again."""
    with served_logs("px4", seconds=120) as (server, held), BadLink(server.udp_port) as link:
        ended = []

        def end(*_):
            if not ended:
                ended.append(server.autopilot._log_server._listed.clear() or server.autopilot._log_server._work.clear())

        (one,) = download(link.url, tmp_path / "log", timeout_s=20, progress=end).logs
        assert ended
        assert one.file.read_bytes() == held[0]


def test_the_vehicle_is_told_that_it_is_over_on_an_interrupt_too(tmp_path):
    with served_logs("ardupilot", seconds=120) as (server, held):
        ends = []
        served_end = server.autopilot._log_server._end
        server.autopilot._log_server._end = lambda peer: (ends.append(peer), served_end(peer))

        def press(*_):
            raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            download(url_of(server), tmp_path / "log", timeout_s=10, progress=press)
        deadline_s = time.monotonic() + 10
        while not ends and time.monotonic() < deadline_s:
            time.sleep(0.01)
        assert ends
        assert list(tmp_path.iterdir()) == []
        assert download(url_of(server), tmp_path / "log", timeout_s=10).logs[0].size == len(held[0])


def test_a_log_that_is_shorter_than_listed_ends_where_it_ends(tmp_path, monkeypatch):
    entry = client.LogEntry

    def generous(number, size, unix_s):
        return entry(number, size + 1000, unix_s)

    with served_logs("ardupilot", seconds=5) as (server, held):
        monkeypatch.setattr(client, "LogEntry", generous)
        (one,) = download(url_of(server), tmp_path / "log", timeout_s=10).logs
    assert one.size == len(held[0])
    assert one.file.read_bytes() == held[0]


@either
def test_mavsdks_own_client_downloads_the_logs(autopilot, tmp_path):
    from mavsdk.plugins.log_files import LogFiles, LogFilesResult

    with served_logs(autopilot, flights=2) as (server, held), mavsdk_system(url_of(server)) as system:
        client = LogFiles(system)
        entries = [entry for entry in client.get_entries() if entry.size_bytes]
        assert [entry.size_bytes for entry in entries] == [len(one) for one in held]
        for entry, expected in zip(entries, held, strict=True):
            path, over, results = tmp_path / str(entry.id), threading.Event(), []

            def told(result, *_, over=over, results=results):
                results.append(result)
                if result != LogFilesResult.NEXT:
                    over.set()

            client.download_log_file_async(entry, str(path), told)
            assert over.wait(20)
            assert results[-1] == LogFilesResult.SUCCESS
            assert path.read_bytes() == expected


@either
def test_mavutil_gets_the_same_bytes_by_hand(autopilot):
    with (
        served_logs(autopilot) as (server, held),
        mavutil_client(f"udpout:127.0.0.1:{server.udp_port}") as client,
    ):
        client.mav.log_request_list_send(1, 1, 0, 0xFFFF)
        entry = client.recv_match(type="LOG_ENTRY", blocking=True, timeout=10)
        got = bytearray()
        while len(got) < entry.size:  # a few at a time: a socket's buffer holds no more on a busy machine
            wanted = min(10 * CHUNK, entry.size - len(got))
            client.mav.log_request_data_send(1, 1, entry.id, len(got), wanted)
            end = len(got) + wanted
            while len(got) < end:
                piece = client.recv_match(type="LOG_DATA", blocking=True, timeout=10)
                assert piece.ofs == len(got)
                got += bytes(piece.data[: piece.count])
        assert bytes(got) == held[0]


def run(monkeypatch, capsys, *words):
    monkeypatch.setattr(sys, "argv", ["sparsor", "download", *map(str, words)])
    with pytest.raises(SystemExit) as end:
        main.main()
    return end.value.code, *capsys.readouterr()


def test_the_command_tells_what_it_fetched(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with served_logs("ardupilot", flights=2, seconds=1) as (server, held):
        base = ("--connect", url_of(server), "--timeout", 10)
        code, out, _ = run(monkeypatch, capsys, *base, "--list", "--json")
        assert code == 0
        assert [(one["log"], one["bytes"]) for one in json.loads(out)["logs"]] == [(1, len(held[0])), (2, len(held[1]))]
        code, out, err = run(monkeypatch, capsys, *base, "--json")
        assert (code, err) == (0, "")
        told = json.loads(out)
        assert told.pop("seconds") > 0
        assert told == {
            "vehicle": "ArduPilot quadrotor, system 1, disarmed",
            "file": "00000002.BIN",
            "bytes": len(held[1]),
            "log": 2,
        }
        assert (tmp_path / "00000002.BIN").read_bytes() == held[1]
        code, _, err = run(monkeypatch, capsys, *base)
        assert code == 2
        assert "is there already" in err
        code, out, _ = run(monkeypatch, capsys, *base, "--all", "-o", "all", "-q")
        assert code == 0
        assert out.split() == ["all/00000001.BIN", "all/00000002.BIN"]
    code, _, err = run(monkeypatch, capsys, *base, "--all", "--log", 1)
    assert code == 2
    assert "--log, --all and --list exclude each other" in err


def test_a_window_asks_for_gaps_and_joins_those_that_are_close():
    window = Window(start=0, size=10 * CHUNK)
    assert window.stretch(0.0) == (0, 9)
    for place in (0, 2, 3, 4, 6, 7, 8, 9):
        assert window.take(place * CHUNK, bytes([place]) * CHUNK) == place
    assert window.missing == {1, 5}
    assert window.stretch(0.0) == (1, 1)
    assert window.stretch(3.0) == (1, 5)
    assert window.take(CHUNK + 1, bytes(CHUNK)) is None
    assert window.take(10 * CHUNK, bytes(CHUNK)) is None
    assert window.missing == {1, 5}


def test_an_end_is_believed_when_it_is_said_twice():
    window = Window(start=0, size=10 * CHUNK)
    window.take(0, bytes(CHUNK))
    window.take(CHUNK, bytes(7))
    assert len(window.data) == 10 * CHUNK
    window.take(CHUNK, bytes(7))
    assert (len(window.data), window.missing, window.cut) == (CHUNK + 7, {1}, True)


def test_the_dearer_a_request_the_more_is_asked_for_at_once():
    cheap, dear = Pace(), Pace()
    times_s = [0.001 * number for number in range(100)]
    cheap.learn(-0.001, times_s, times_s[-1])
    dear.learn(-0.5, times_s, times_s[-1] + 0.2)
    assert cheap.worth < 2
    assert dear.worth > 100
