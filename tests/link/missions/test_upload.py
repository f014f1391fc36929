"""A plan onto a vehicle with the real mavsdk: checked, sent, read back; every failure names the state left behind."""

from __future__ import annotations

import dataclasses
import json
import threading
import time

import pytest

from link.vehicle_endpoint import ARDUPILOT, PX4, Vehicle, VehicleEndpoint
from mission_strategies import example_plan
from sparsor.errors import InputError, LinkError, LinkFailureError, MissionError, StoppedError
from sparsor.journeys.uploading import choose_plan, upload_mission
from sparsor.link.connection import Connection
from sparsor.link.missions.checks import check_plan
from sparsor.link.missions.readback import differences
from sparsor.link.missions.upload import upload_plan
from sparsor.link.missions.wire import FENCE, MISSION, RALLY, wire_items
from sparsor.link.vehicles import FoundVehicle, find_vehicle
from sparsor.mission import ComplexItem, Fence, MissionItem, plan_bytes
from sparsor.vehicle import autopilot_named

NAMES = {ARDUPILOT: "ardupilot", PX4: "px4"}


@pytest.fixture(autouse=True)
def no_thread_is_left():
    before = set(threading.enumerate())
    yield
    assert not [thread for thread in threading.enumerate() if thread not in before and "link" in thread.name]


def uploaded(vehicle, plan=None, **options):
    plan = plan or example_plan(NAMES[vehicle.autopilot], 12)
    with VehicleEndpoint(vehicle) as endpoint, Connection(endpoint.url) as connection:
        return upload_plan(plan, connection, find_vehicle(connection, vehicle.systems[0]), **options)


def held(vehicle, kind):
    return [(item.command, item.x, item.y, item.z) for item in vehicle.stored[kind]]


def expected(plan, name, kind):
    return [
        (item.command, item.x, item.y, pytest.approx(item.z)) for item in wire_items(plan, autopilot_named(name))[kind]
    ]


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_the_vehicle_holds_what_the_plan_says(autopilot):
    name, told = NAMES[autopilot], []
    plan, vehicle = example_plan(name, 12), Vehicle(autopilot=autopilot)
    report = uploaded(vehicle, plan, progress=lambda *step: told.append(step))
    assert (report.verified, report.vehicle_state) == (True, "new plan")
    assert (report.items, report.rally_points) == (len(plan.items), len(plan.rally_points))
    for kind in (MISSION, FENCE, RALLY):
        assert held(vehicle, kind) == expected(plan, name, kind)
    assert vehicle.current == 0
    assert report.fence_enforced is (name == "px4")
    assert ("send mission", len(vehicle.stored[0]), len(vehicle.stored[0])) in told
    harmless = "Home (item 0) is where the vehicle is" if name == "ardupilot" else "0 instead of nan in parameter 4"
    assert any(harmless in sentence for sentence in report.changed)


def test_what_the_plan_lacks_is_cleared_on_the_vehicle():
    vehicle = Vehicle()
    uploaded(vehicle)
    assert vehicle.stored[FENCE]
    uploaded(vehicle, dataclasses.replace(example_plan(stops=3), fences=(), rally_points=()))
    assert vehicle.stored[FENCE] == vehicle.stored[RALLY] == []


def test_a_dry_run_sends_nothing():
    vehicle = Vehicle(fence_enable=1.0)
    report = uploaded(vehicle, dry_run=True)
    assert (report.verified, report.vehicle_state, report.fence_enforced) == (None, "unchanged", True)
    assert vehicle.stored == {0: [], 1: [], 2: []}
    assert any("vehicle's altitude fence at 50 m" in sentence for sentence in report.warnings)


def test_duplicated_frames_do_no_harm():
    vehicle = Vehicle(copies=2)
    assert uploaded(vehicle).verified
    assert len(vehicle.stored[MISSION]) == len(example_plan(stops=12).items) + 1


def found(autopilot=3, *, armed=False):
    return FoundVehicle(1, 1, autopilot, 2, armed)


def test_a_plan_for_another_autopilot_or_an_armed_vehicle_is_refused():
    plan = example_plan()
    with pytest.raises(LinkError, match=r"plan is for ArduPilot.*PX4.*--autopilot px4") as refused:
        check_plan(plan, found(12))
    assert isinstance(refused.value, InputError)
    assert refused.value.exit_code == 2
    with pytest.raises(LinkError, match=r"armed.*--force"):
        check_plan(plan, found(armed=True))
    assert any("armed" in sentence for sentence in check_plan(plan, found(armed=True), force=True))
    with pytest.raises(LinkError, match="ArduPilot and PX4 only"):
        check_plan(plan, found(4))


def with_item(plan, *values):
    return dataclasses.replace(plan, items=(*plan.items[:2], MissionItem(16, 3, values), *plan.items[2:]))


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda plan: with_item(plan, 0, 0, 0, 0, 0.0, 0.0, 50), "lies at 0/0"),
        (lambda plan: with_item(plan, 0, 0, 0, 0, 26.0, 52.0, 50), "outside fence"),
        (lambda plan: dataclasses.replace(plan, items=plan.items[:1] + plan.items[1:2] * 700), "more than the 650"),
        (
            lambda plan: dataclasses.replace(plan, fences=(Fence((51.4, 51.6, 51.6, 51.4), (25.2, 25.4, 25.2, 25.4)),)),
            "crosses itself",
        ),
        (lambda plan: dataclasses.replace(plan, complex_items=(ComplexItem("corridor", 0),)), "corridor"),
        (lambda plan: dataclasses.replace(plan, items=()), "nothing is flown"),
    ],
)
def test_a_faulty_plan_is_refused(spoil, words):
    with pytest.raises(LinkError, match=words):
        check_plan(spoil(example_plan()), found())


def test_a_take_off_at_0_0_means_here():
    plan = example_plan()
    first = MissionItem(22, 3, (0, 0, 0, 0, 0, 0, 50))
    check_plan(dataclasses.replace(plan, items=(first, *plan.items[1:])), found())


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"refuses": FENCE}, r"fence failed.*DENIED.*no plan, as before"),
        ({"room": 5}, r"no room.*no plan, as before"),
        ({"spoils": {"x": 252_900_000}}, r"another plan than was sent.*item 2.*25.29"),
        ({"spoils": {"z": 61.0}}, r"altitude 61 m instead of 60 m"),
        ({"spoils": {"command": 17}}, r"NAV_LOITER_UNLIM instead of"),
    ],
)
def test_a_refused_or_spoiled_transfer_names_what_the_vehicle_is_left_with(wrong, words):
    vehicle = Vehicle(**wrong)
    plan = example_plan(stops=4)
    plan = dataclasses.replace(plan, items=(plan.items[0], *plan.items[2:]))  # so that item 2 is a waypoint
    with pytest.raises(LinkFailureError, match=words) as failed:
        uploaded(vehicle, plan)
    assert failed.value.exit_code == 1
    assert vehicle.stored == {0: [], 1: [], 2: []}


class Forgetful(VehicleEndpoint):
    """Reads item 2 back wrong in the first uploads after it was told to."""

    def __init__(self, times):
        super().__init__(Vehicle())
        self.times, self.counts = times, 0

    def on_mission_count(self, message):
        self.counts += message.mission_type == MISSION
        self.vehicle.spoils = {"x": 252_900_000} if self.counts <= self.times else {}
        super().on_mission_count(message)


def test_what_is_read_back_otherwise_is_sent_again_twice():
    plan = example_plan(stops=4)
    with Forgetful(2) as endpoint, Connection(endpoint.url) as connection:
        assert upload_plan(plan, connection, find_vehicle(connection, 1)).verified
        assert endpoint.counts == 3
    with Forgetful(9) as endpoint, Connection(endpoint.url) as connection:
        with pytest.raises(LinkFailureError, match=r"another plan than was sent.*no plan, as before") as failed:
            upload_plan(plan, connection, find_vehicle(connection, 1))
        assert endpoint.counts >= 3
    assert failed.value.vehicle_state == "it holds no plan, as before"


def test_the_old_plan_is_back_after_a_refusal():
    vehicle = Vehicle()
    uploaded(vehicle, example_plan(stops=3))
    before = {kind: held(vehicle, kind) for kind in (MISSION, RALLY)}
    vehicle.room = 10
    with pytest.raises(LinkFailureError, match="old plan again"):
        uploaded(vehicle, example_plan(stops=12))
    assert {kind: held(vehicle, kind)[1:] for kind in before} == {kind: items[1:] for kind, items in before.items()}


def test_a_vehicle_that_takes_neither_the_new_plan_nor_the_old_is_emptied():
    vehicle = Vehicle()
    uploaded(vehicle, example_plan(stops=3))
    vehicle.room = 2
    with pytest.raises(LinkFailureError, match="the new plan was cleared, it holds none now") as failed:
        uploaded(vehicle, example_plan(stops=12))
    assert failed.value.vehicle_state == "the new plan was cleared, it holds none now"
    assert vehicle.stored == {0: [], 1: [], 2: []}


def test_a_second_ctrl_c_leaves_the_state_unknown(monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("sparsor.link.missions.upload._sent", interrupt)
    monkeypatch.setattr("sparsor.link.missions.upload._restored", interrupt)
    with pytest.raises(StoppedError, match=r"interrupted\. The vehicle: state unknown, do not arm") as stopped:
        uploaded(Vehicle())
    assert (stopped.value.exit_code, stopped.value.vehicle_state) == (130, "state unknown, do not arm")


def test_a_plan_for_another_kind_of_vehicle_is_sent_with_a_warning():
    rover = FoundVehicle(1, 1, 3, 10, armed=False)
    assert any("another kind of vehicle (MAV_TYPE 2)" in sentence for sentence in check_plan(example_plan(), rover))


def test_a_link_that_dies_leaves_the_state_unknown(monkeypatch):
    monkeypatch.setattr("sparsor.link.missions.dialogue.SILENT_S", 1.5)
    monkeypatch.setattr("sparsor.link.missions.upload.LIFE_S", 0.6)
    begun = time.monotonic()
    with pytest.raises(LinkFailureError, match="state unknown, do not arm"):
        uploaded(Vehicle(dies_at=4))
    assert time.monotonic() - begun < 15


def test_a_changed_hold_matters_and_a_dropped_radius_does_not():
    plan = example_plan("px4")
    sent = wire_items(plan, autopilot_named("px4"))[MISSION]
    place = next(number for number, item in enumerate(sent) if item.command == 16)
    for params, harmless in (((9.0, *sent[place].params[1:]), False), ((sent[place].params[0], 0.0, 0.0, 0.0), True)):
        back = [*sent[:place], dataclasses.replace(sent[place], params=params), *sent[place + 1 :]]
        assert {one.harmless for one in differences(MISSION, sent, back, home_is_item_0=False)} == {harmless}
    assert not differences(MISSION, sent, sent, home_is_item_0=False)


def test_a_folder_with_several_sorties_asks_which(tmp_path):
    with pytest.raises(MissionError, match="is a folder without"):
        choose_plan(tmp_path)
    for number in (1, 2, 12):
        (tmp_path / f"doha-{number}.plan").write_bytes(plan_bytes(example_plan()))
    with pytest.raises(MissionError, match=r"3 plans.*--sortie"):
        choose_plan(tmp_path)
    assert choose_plan(tmp_path, 2).name == "doha-2.plan"
    with pytest.raises(MissionError, match="no sortie 3"):
        choose_plan(tmp_path, 3)
    with pytest.raises(MissionError, match="there is no"):
        choose_plan(tmp_path / "gone.plan")


def run(arguments):
    import typer
    from typer.testing import CliRunner

    from sparsor.cli.upload import upload

    app = typer.Typer()
    app.command()(upload)
    return CliRunner().invoke(app, [str(word) for word in arguments])


def test_the_command_prints_one_json_object_and_its_exit_codes_are_right(tmp_path):
    path = tmp_path / "a.plan"
    path.write_bytes(plan_bytes(example_plan(stops=3)))
    with VehicleEndpoint() as endpoint:
        ran = run([path, "--connect", endpoint.url, "--json"])
        assert ran.exit_code == 0, ran.output
        result = json.loads(ran.stdout)
        assert (result["autopilot"], result["vehicle"], result["verified"]) == ("ArduPilot", "quadrotor", True)
        assert result["vehicle_state"] == "new plan"
        endpoint.vehicle.armed = True
        assert run([path, "--connect", endpoint.url]).exit_code == 2
    assert run([path, "--connect", "somewhere"]).exit_code == 2
    silent = run([path, "--connect", "udpout://127.0.0.1:9", "--timeout", "0.3"])
    assert silent.exit_code == 1
    assert "nothing came" in silent.stderr


def test_a_journey_tells_which_vehicle_before_it_sends(tmp_path):
    path = tmp_path / "a.plan"
    path.write_bytes(plan_bytes(example_plan(stops=3)))
    seen = []
    with VehicleEndpoint() as endpoint:
        upload_mission(path, endpoint.url, found=lambda vehicle: seen.append((vehicle.words, len(endpoint.heard))))
    assert seen[0][0] == "ArduPilot quadrotor, system 1, disarmed"
