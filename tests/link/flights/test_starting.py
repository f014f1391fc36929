"""How a start can fail or be stopped, what is said of it, and that a vehicle is called disarmed only when it is."""

from __future__ import annotations

import pytest

from link.flight_rig import Witness, practice, short_plan, url_of
from link.vehicle_endpoint import Vehicle, VehicleEndpoint
from sparsor.errors import LeftBehindError, LinkFailureError, StoppedError
from sparsor.journeys.flying import Choice, FlightOptions, fly_mission
from sparsor.journeys.uploading import upload_mission
from sparsor.link.connection import Connection
from sparsor.link.flights.orders import disarm
from sparsor.link.practice.flavour import Mode
from sparsor.link.vehicles import find_vehicle
from sparsor.mission import plan_bytes


@pytest.fixture(autouse=True)
def nobody_waits_long(monkeypatch):
    monkeypatch.setattr("sparsor.link.missions.checks.POSITION_S", 0.3)
    monkeypatch.setattr("sparsor.link.flights.orders.ANSWER_S", 0.2)
    monkeypatch.setattr("sparsor.link.flights.flying.UNDER_WAY_S", 1.0)


@pytest.fixture
def plan_file(tmp_path):
    path = tmp_path / "short.plan"
    path.write_bytes(plan_bytes(short_plan()))
    return path


def flown(path, url, witness, **options):
    return fly_mission(path, url, path.with_name("flight.tlog"), FlightOptions(**options), witness)


def interrupt(*_):
    raise KeyboardInterrupt


def test_a_ctrl_c_at_the_question_leaves_the_plan(plan_file):
    witness = Witness()
    witness.confirm = interrupt
    with practice(speedup=10) as server:
        with pytest.raises(StoppedError, match=r"interrupted before the start.*holds the new plan") as stopped:
            flown(plan_file, url_of(server), witness)
        assert not server.autopilot.flight.armed
        assert server.autopilot.store.items[0]
    assert (stopped.value.exit_code, stopped.value.vehicle_state) == (130, "new plan")
    with practice(speedup=10) as server, pytest.raises(StoppedError, match="flies it if it has taken off") as stopped:
        upload_mission(plan_file, url_of(server), start=interrupt)
    assert (stopped.value.exit_code, stopped.value.vehicle_state) == (130, "new plan, perhaps under way")


def test_a_no_starts_nothing(plan_file):
    with practice(speedup=10) as server:
        assert upload_mission(plan_file, url_of(server), start=lambda *_: False).started is False
        assert not server.autopilot.flight.armed


def test_a_link_that_is_lost_while_the_vehicle_is_started(plan_file):
    with practice(speedup=10, ready_s=3000) as server:
        witness = Witness(at="waiting until it is ready", do=server.stop)
        with pytest.raises(LeftBehindError, match=r"does not answer.*while it was started.*may take off") as failed:
            flown(plan_file, url_of(server), witness)
    assert failed.value.vehicle_state == "state unknown, it may take off by itself"


@pytest.mark.parametrize(
    ("disarms", "state"),
    [(True, "disarmed, it holds the plan"), (False, "armed on the ground, it holds the plan")],
)
def test_a_vehicle_that_accepts_the_start_and_stays(disarms, state, plan_file):
    with practice(speedup=10, ready_s=0) as server:
        flight = server.autopilot.flight
        flight.start_mission = lambda: 0
        server.autopilot.parameters.set("DISARM_DELAY", 0.0)
        if not disarms:
            flight.disarm = lambda **_: 0  # it says yes and does not
        with pytest.raises(LeftBehindError, match="accepted the start and stays where it is") as failed:
            flown(plan_file, url_of(server), Witness(), ready_timeout_s=0.1)
        assert failed.value.vehicle_state == state
        assert flight.armed is not disarms


def test_a_yes_to_an_earlier_order_is_not_taken_for_disarmed():
    with VehicleEndpoint(Vehicle(armed=True)) as endpoint, Connection(endpoint.url) as connection:
        vehicle = find_vehicle(connection, 1)
        assert not disarm(connection, vehicle)  # it accepts every command and stays armed
        endpoint.vehicle.armed = False
        assert disarm(connection, vehicle)
        endpoint.vehicle.beats = False
        endpoint.vehicle.dead = True
        assert not disarm(connection, vehicle, tries=1)


def test_a_vehicle_that_does_not_return_home_says_so(plan_file):
    with practice() as server:
        obeys = server.autopilot.flight.set_mode

        def refuses(mode):
            return 4 if mode is Mode.RETURN else obeys(mode)

        server.autopilot.flight.set_mode = refuses
        witness = Witness(at="item 3 of", do=interrupt, choice=Choice.RETURN)
        result = flown(plan_file, url_of(server), witness).result
    assert result.outcome == "complete"
    assert "the vehicle does not return home: failed" in result.warnings


def test_nothing_is_left_of_a_flight_that_nobody_answered(plan_file):
    before = plan_file.with_name("flight.tlog")
    before.write_bytes(b"an earlier flight")
    with pytest.raises(LinkFailureError, match="nothing came"):
        flown(plan_file, "udpout://127.0.0.1:9", Witness(), timeout_s=0.3, force=True)
    assert before.read_bytes() == b"an earlier flight"
    with pytest.raises(LinkFailureError, match="nobody answers"):
        fly_mission(plan_file, "tcpout://127.0.0.1:9", None, FlightOptions(timeout_s=0.3), Witness())
    assert sorted(path.name for path in plan_file.parent.iterdir()) == ["flight.tlog", "short.plan"]


def test_where_it_is_recorded_is_said_once_the_vehicle_is_to_fly(plan_file):
    with practice() as server:
        witness = Witness()
        flown(plan_file, url_of(server), witness)
    assert witness.words[0] == f"recording to {plan_file.with_name('flight.tlog')}"


def test_a_vehicle_without_a_fix_cannot_be_told_to_be_near(plan_file):
    with practice(speedup=1, ready_s=3000) as server:
        report = upload_mission(plan_file, url_of(server), dry_run=True)
    assert any("does not say where it is" in warning for warning in report.warnings)


@pytest.mark.parametrize("kind", ["vtol", "plane", "rover", "boat"])
def test_modes_are_known_of_every_kind_that_we_plan_for(kind):
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    from sparsor.link.flights.modes import flight_modes, mode_title
    from sparsor.link.practice.flavour import ARDUPILOT, Mode
    from sparsor.link.vehicles import FoundVehicle
    from sparsor.vehicle import load_vehicle

    flavour, mav_type = ARDUPILOT.on(kind), load_vehicle(kind).mav_type
    for mode in (Mode.MISSION, Mode.GUIDED, Mode.RETURN):
        beat = mavlink.MAVLink_heartbeat_message(mav_type, 3, 1, flavour.custom_mode(mode), 4, 3)
        assert mode_title(beat) == flavour.mode_title(mode)
    found = FoundVehicle(1, 1, 3, mav_type, armed=False)
    modes = flight_modes(found)
    assert modes.mission == "AUTO"
    assert flavour.mode_of(modes.arming) in (Mode.MISSION, Mode.HOLD)
