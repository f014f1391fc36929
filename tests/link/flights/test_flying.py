"""A mission from arming to disarming on the practice autopilot; each way in which it can end otherwise."""

from __future__ import annotations

import numpy as np
import pytest
from pymavlink import mavutil

from link.bad_link import BadLink
from link.flight_rig import STOPS, Witness, practice, short_plan, url_of
from sparsor.errors import LeftBehindError, LinkError, StoppedError
from sparsor.journeys.flying import Choice, FlightOptions, fly_mission
from sparsor.link.flights.modes import flight_modes
from sparsor.link.practice.flavour import Mode
from sparsor.link.vehicles import FoundVehicle
from sparsor.mission import plan_bytes

RADIUS_M = 2.0  # the quad profile's; PX4's is in the items


@pytest.fixture(autouse=True)
def a_vehicle_without_a_fix_is_not_waited_for(monkeypatch):
    monkeypatch.setattr("sparsor.link.missions.checks.POSITION_S", 0.3)


@pytest.fixture
def plan_file(tmp_path):
    def write(autopilot="ardupilot"):
        path = tmp_path / "short.plan"
        path.write_bytes(plan_bytes(short_plan(autopilot)))
        return path

    return write


def flown(path, url, witness=None, **options):
    tlog = path.with_name("flight.tlog")
    return fly_mission(path, url, tlog, FlightOptions(**options), witness or Witness())


def nearest_m(track, place):
    """How near straight lines between the points of a track come to (east, north)."""
    points = track[:, 0] + 1j * track[:, 1] - complex(*place)
    start, step = points[:-1], np.diff(points)
    along = np.clip(np.real(-start * np.conj(step)) / np.maximum(np.abs(step) ** 2, 1e-12), 0, 1)
    return float(np.abs(start + along * step).min())


def messages_of(path):
    log = mavutil.mavlink_connection(str(path))
    found = []
    while (message := log.recv_msg()) is not None:
        found.append(message)
    log.close()
    return found


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_mission_is_flown_and_recorded_with_nothing_lost(autopilot, plan_file):
    path, witness = plan_file(autopilot), Witness()
    with practice(autopilot) as server:
        report = flown(path, url_of(server), witness, enable_fence=True)
        place = server.autopilot.flight.place
        track, sent = np.array(server.autopilot.track), list(server.autopilot.samples)
        assert not server.autopilot.flight.armed
    result = report.result
    plan = short_plan(autopilot)
    assert (result.outcome, result.missed, len(result.reached)) == ("complete", (), len(STOPS) + 1)
    assert report.upload.fence_enforced
    assert not result.warnings

    messages = messages_of(report.tlog)
    assert len(messages) == report.messages
    assert not [message for message in messages if message.get_type() == "BAD_DATA"]
    fixes = [m for m in messages if m.get_type() == "GLOBAL_POSITION_INT" and m.lat]
    told = np.array([place.metres(m.lon / 1e7, m.lat / 1e7) for m in fixes])
    for stop in STOPS:
        assert nearest_m(track, place.metres(*stop)) < RADIUS_M
        assert nearest_m(told, place.metres(*stop)) < RADIUS_M + 1
    first = 1 if autopilot == "ardupilot" else 0
    moves = {number + first for number, item in enumerate(plan.items) if item.command in (16, 21, 22)}
    assert {m.seq for m in messages if m.get_type() == "MISSION_ITEM_REACHED"} == moves

    # The samples are those of the vehicle's own list, from the first heard to the last, none missing.
    named = [(m.time_boot_ms, m.value) for m in messages if m.get_type() == "NAMED_VALUE_FLOAT"]
    own = [(round(sample.time_s * 1000), pytest.approx(sample.value, rel=1e-5)) for sample in sent]
    start = own.index(named[0])
    assert named == own[start : start + len(named)]
    assert report.samples == {"NO2": len(named)}
    assert len(named) > 0.9 * result.seconds
    airborne = sum(up > 0.05 for _, _, up in track) * 0.05
    assert result.seconds == pytest.approx(airborne, abs=4)
    assert result.distance_m == pytest.approx(np.abs(np.diff(track[:, 0] + 1j * track[:, 1])).sum(), rel=0.05)

    assert witness.views[-1].item == len(plan.items)
    assert witness.views[-1].left_m < 5


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_mission_is_flown_over_a_link_that_loses_and_repeats(autopilot, plan_file):
    path = plan_file(autopilot)
    with practice(autopilot, speedup=20) as server, BadLink(server.udp_port, loss=0.08, twice=0.05, seed=3) as link:
        report = flown(path, link.url, timeout_s=30)
        place, track = server.autopilot.flight.place, np.array(server.autopilot.track)
    assert report.result.outcome == "complete"
    assert all(nearest_m(track, place.metres(*stop)) < RADIUS_M for stop in STOPS)
    assert len(messages_of(report.tlog)) == report.messages


@pytest.mark.parametrize(
    ("autopilot", "words"),
    [("ardupilot", r"COMPONENT_ARM_DISARM is failed.*PreArm"), ("px4", r"MISSION_START is.*(rejected|denied).*says")],
)
def test_a_vehicle_that_is_not_ready_is_waited_for_and_then_left_disarmed(autopilot, words, plan_file):
    path = plan_file(autopilot)
    with practice(autopilot, speedup=10, ready_s=3000) as server:
        with pytest.raises(LeftBehindError, match=words) as failed:
            flown(path, url_of(server), ready_timeout_s=1)
        assert failed.value.vehicle_state == "disarmed, it holds the plan"
        assert failed.value.exit_code == 1
        assert not server.autopilot.flight.armed
    assert path.with_name("flight.tlog").stat().st_size > 0  # what it said is recorded


def test_it_arms_before_it_may_fly_and_is_started_again(plan_file, monkeypatch):
    monkeypatch.setattr("sparsor.link.practice.readiness.ARMS_AT", 0.0)
    with practice(ready_s=3000) as server:

        def ready():
            server.autopilot.flight.ready_s = 0.0

        witness = Witness(at="AUTO failed: requires position", do=ready)
        report = flown(plan_file(), url_of(server), witness)
    assert not witness.at
    assert report.result.outcome == "complete"


def test_an_armed_vehicle_and_a_plan_for_another_autopilot_are_refused(plan_file):
    path = plan_file("px4")
    with practice("px4", ready_s=0) as server:
        server.autopilot.parameters.set("COM_DISARM_PRFLT", 0.0)
        server.autopilot.flight.arm(force=True)
        with pytest.raises(LinkError, match="armed"):
            flown(path, url_of(server))
    with practice("ardupilot") as server, pytest.raises(LinkError, match="plan is for PX4"):
        flown(path, url_of(server))
    assert not path.with_name("flight.tlog").exists()
    with pytest.raises(LinkError, match="only copters"):
        flight_modes(FoundVehicle(1, 1, 3, 12, armed=False))


def test_a_refusal_leaves_the_recording_that_was_there(plan_file):
    path = plan_file("px4")
    old = path.with_name("flight.tlog")
    old.write_bytes(b"an earlier flight")
    with practice("ardupilot") as server:
        with pytest.raises(LinkError, match="is there already"):
            flown(path, url_of(server))
        with pytest.raises(LinkError, match="plan is for PX4"):
            flown(path, url_of(server), force=True)
    assert old.read_bytes() == b"an earlier flight"
    assert sorted(file.name for file in path.parent.iterdir()) == ["flight.tlog", "short.plan"]


def test_a_flight_that_returns_early_says_what_was_not_reached(plan_file):
    with practice() as server:
        witness = Witness(at="item 3 of", do=lambda: server.autopilot.flight.set_mode(Mode.RETURN))
        result = flown(plan_file(), url_of(server), witness).result
    assert result.outcome == "returned early"
    assert result.reached[0] == 3
    assert set(result.reached) | set(result.missed) == set(range(3, 8))
    assert {5, 6, 7} <= set(result.missed)
    assert "mode RTL" in witness.words


def test_a_vehicle_that_is_disarmed_in_the_air_is_not_called_landed(plan_file):
    with practice() as server:
        witness = Witness(at="item 3 of", do=lambda: server.autopilot.flight.disarm(force=True))
        result = flown(plan_file(), url_of(server), witness).result
    assert result.outcome == "disarmed in flight"


def test_a_link_that_is_lost_in_flight(plan_file, monkeypatch):
    monkeypatch.setattr("sparsor.link.flights.linkwatch.QUIET_S", 1.0)
    path = plan_file()
    with practice(speedup=10) as server:
        witness = Witness(at="item 3 of", do=server.stop)
        with pytest.raises(LeftBehindError, match=r"flies on by itself.*sparsor record") as failed:
            flown(path, url_of(server), witness, lost_timeout_s=2)
        record_on = f"sparsor record --connect {url_of(server)} -o {path.with_name('flight-2.tlog')}"
    assert failed.value.vehicle_state == "flies on by itself"
    assert str(failed.value).endswith(record_on)
    assert failed.value.recording == str(path.with_name("flight.tlog"))
    assert any("nothing was heard" in event.text and event.warning for event in witness.events)
    assert any(m.get_type() == "MISSION_ITEM_REACHED" for m in messages_of(path.with_name("flight.tlog")))


def interrupt():
    raise KeyboardInterrupt


def test_a_ctrl_c_in_flight_may_return_home_go_on_or_leave(plan_file):
    path = plan_file()
    with practice() as server:
        witness = Witness(at="item 3 of", do=interrupt, choice=Choice.RETURN)
        result = flown(path, url_of(server), witness).result
        assert not server.autopilot.flight.armed
    assert result.outcome == "returned early"
    assert "the vehicle returns home" in witness.words
    with practice() as server:
        witness = Witness(at="item 3 of", do=interrupt, choice=Choice.WATCH)
        assert flown(path, url_of(server), witness, force=True).result.outcome == "complete"
    with practice(speedup=10) as server:
        witness = Witness(at="item 3 of", do=interrupt, choice=Choice.LEAVE)
        with pytest.raises(StoppedError, match="flies on by itself") as stopped:
            flown(path, url_of(server), witness, force=True)
        assert stopped.value.exit_code == 130
        assert server.autopilot.flight.armed


def test_a_ctrl_c_before_take_off_disarms(plan_file):
    with practice(speedup=10, ready_s=3000) as server:
        witness = Witness(at="waiting until it is ready", do=interrupt)
        with pytest.raises(StoppedError, match="before take-off"):
            flown(plan_file(), url_of(server), witness)
        assert not server.autopilot.flight.armed


def test_a_no_leaves_the_plan_on_the_ground(plan_file):
    with practice() as server:
        with pytest.raises(LeftBehindError, match="not started") as failed:
            flown(plan_file(), url_of(server), Witness(yes=False))
        assert not server.autopilot.flight.armed
        assert server.autopilot.store.items[0]
    assert failed.value.vehicle_state == "new plan"
