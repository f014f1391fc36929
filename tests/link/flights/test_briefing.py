"""What is known, said and refused before a vehicle is armed."""

from __future__ import annotations

import pytest

from link.flight_rig import STOPS, Witness, practice, short_plan, url_of
from mission_strategies import KNOWN_HOME, QUAD
from sparsor.cli.flightscreen import briefing_lines
from sparsor.errors import LeftBehindError, LinkError
from sparsor.journeys.flying import FlightOptions, fly_mission
from sparsor.journeys.uploading import profile_of, upload_mission
from sparsor.link.connection import Connection
from sparsor.link.flights.briefing import brief
from sparsor.link.flights.samples import LastSample, SampleCounter
from sparsor.link.vehicles import find_vehicle
from sparsor.mission import Home, build_mission, plan_bytes
from sparsor.vehicle import flight_seconds


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr("sparsor.link.vehicles.OTHERS_S", 0.3)
    monkeypatch.setattr("sparsor.link.missions.checks.POSITION_S", 0.5)
    monkeypatch.setattr("sparsor.link.flights.briefing.ANSWER_S", 0.5)


@pytest.fixture
def briefed():
    def get(server, plan, **options):
        with Connection(url_of(server), timeout_s=10) as connection:
            return brief(plan, connection, find_vehicle(connection), **options)

    return get


def away_plan(north_deg):
    """Return a plan whose home and stops lie north of the vehicle."""
    lon, lat = zip(*STOPS, strict=True)
    home = Home(KNOWN_HOME.lon_deg, KNOWN_HOME.lat_deg + north_deg, 12.5, altitude_known=True)
    moved = [one + north_deg for one in lat]
    return build_mission(lon, moved, home=home, vehicle=QUAD, autopilot="ardupilot", altitude_m=12, hold_s=2)


def test_it_says_how_far_how_long_and_how_full(briefed):
    plan = short_plan()
    with practice(ready_s=0.0) as server:
        briefing = briefed(server, plan, profile=QUAD)
    assert briefing.home_m < 1 < 40 < briefing.first_m < 80
    assert briefing.height_m == 12
    assert briefing.battery_percent == 100
    assert briefing.warnings == ()
    stops = [(stop.lon_deg, stop.lat_deg) for stop in plan.stops]
    # Our own estimate of the same flight knows braking as well.
    known_s = flight_seconds(
        QUAD, path_length_m=briefing.length_m, transit_m=0, stops=len(stops), hold_s=2, altitude_m=12, speed_m_s=None
    )
    assert 0.6 * known_s < briefing.seconds < 1.1 * known_s


@pytest.mark.parametrize(("north_deg", "said"), [(0.0005, False), (0.002, True)])
def test_who_stands_beside_home_is_told_that_heights_count_from_there(briefed, north_deg, said):
    with practice(ready_s=0.0) as server:
        briefing = briefed(server, away_plan(north_deg), profile=QUAD)
    assert any("heights will count from the ground where it takes off" in one for one in briefing.warnings) is said


@pytest.mark.parametrize("north_deg", [0.07, 5.0])
def test_a_plan_for_another_place_is_not_started_and_not_even_sent(tmp_path, north_deg):
    path = tmp_path / "far.plan"
    path.write_bytes(plan_bytes(away_plan(north_deg)))
    with practice(ready_s=0.0) as server:
        before = list(server.autopilot.store.items[0])
        with pytest.raises(LinkError, match=r"plan's home lies [\d.]+ km from the vehicle, more than 5 km"):
            fly_mission(path, url_of(server), tmp_path / "a.tlog", FlightOptions(), Witness())
        with pytest.raises(LinkError, match="first waypoint lies"):
            upload_mission(path, url_of(server), start=lambda *_: True)
        assert server.autopilot.store.items[0] == before
        assert not server.autopilot.flight.armed
    assert list(tmp_path.iterdir()) == [path]


def test_who_insists_is_warned_before_the_question(tmp_path):
    path = tmp_path / "far.plan"
    path.write_bytes(plan_bytes(away_plan(0.07)))
    witness = Witness(yes=False)
    with practice(ready_s=0.0) as server, pytest.raises(LeftBehindError, match="not started"):
        server.autopilot.flight.battery.level = 0.2
        fly_mission(path, url_of(server), tmp_path / "a.tlog", FlightOptions(force=True), witness)
    said = " ".join(witness.briefing.warnings)
    assert "home lies 7.8 km" in said
    assert "first waypoint lies" in said
    assert "battery is at 20 %" in said


def test_a_battery_that_is_empty_unknown_or_too_small(briefed, monkeypatch):
    plan = short_plan()
    with practice(ready_s=0.0) as server:
        battery = server.autopilot.flight.battery
        battery.level = 0.29
        with pytest.raises(LinkError, match=r"battery is at 29 %, below 30 %.*--force"):
            briefed(server, plan)
        battery.level = 0.4
        assert briefed(server, plan).warnings == ()  # nobody knows what the battery is good for
        weak = QUAD.model_copy(update={"endurance_s": 120.0})
        (warning,) = briefed(server, plan, profile=weak).warnings
        assert "The battery at 40 % lasts for 1 min by the profile of the quad, the flight takes" in warning
        monkeypatch.setattr("sparsor.link.flights.briefing.BATTERY_MESSAGES", ("BATTERY_STATUS",))
        monkeypatch.setattr("sparsor.link.flights.briefing.TRIES", 0)
        briefing = briefed(server, plan)
    assert briefing.battery_percent is None
    assert briefing.warnings == ("The vehicle does not say how full its battery is.",)


def test_the_question_comes_after_a_briefing(tmp_path):
    path = tmp_path / "m.plan"
    path.write_bytes(plan_bytes(short_plan()))
    witness = Witness(yes=False)
    with practice(ready_s=0.0) as server, pytest.raises(LeftBehindError):
        fly_mission(path, url_of(server), tmp_path / "a.tlog", FlightOptions(), witness)
    samples = SampleCounter()
    lines = briefing_lines(witness.report, witness.briefing, samples)
    assert lines[0].startswith("from the vehicle: 0 m to home, 6")
    assert "battery: 100 %" in lines
    assert "NOT enforced" in lines[3]
    assert lines[-1] == "sensor: not heard yet"
    samples.counts, samples.last = {"NO2": 3}, LastSample("NO2", 1.0, None)
    assert briefing_lines(witness.report, witness.briefing, samples)[-1] == "sensor: heard (3 NO2)"


def test_the_vehicle_of_a_mission_folder_is_known_and_that_of_a_bare_plan_is_not(tmp_path):
    bare = tmp_path / "m.plan"
    bare.write_bytes(plan_bytes(short_plan()))
    assert profile_of(bare) is None
    (tmp_path / "mission.toml").write_text('name = "m"\n[area]\nbbox = [51.5, 25.27, 51.53, 25.3]\n')
    assert profile_of(bare).name == "quad"
    assert profile_of(tmp_path / "other.plan") is None
