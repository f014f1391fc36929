"""What the practice vehicle makes of the items that are not plain waypoints."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mission_strategies import AUTOPILOT_NAMES, KNOWN_HOME, QUAD
from practice_rig import START, Rig, item_message
from sparsor.link.practice.navigator import Navigator
from sparsor.link.practice.place import FlatMap
from sparsor.link.practice.storage import StoredItem

TAKE_OFF, NEAR, FAR = (22, 3, (0.0,) * 4, 0.0), (16, 3, (0.0,) * 4, 4e-4), (16, 3, (0.0,) * 4, 8e-4)
either = pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)


def without_place(command, *params):
    return command, 2, (*params, *(0.0,) * (4 - len(params))), None


def started(autopilot, rows):
    """Upload rows of command, frame, parameters and degrees north of home, and start; 10 m high."""
    rows = list(rows)
    if autopilot == "ardupilot":
        rows.insert(0, (16, 0, (0.0,) * 4, 0.0))
    messages = []
    for seq, (command, frame, params, north) in enumerate(rows):
        place = (0.0, 0.0, 0.0) if north is None else (KNOWN_HOME.lat_deg + north, KNOWN_HOME.lon_deg, 10.0)
        messages.append(item_message(seq, command, frame, (*params, *place)))
    rig = Rig.of(autopilot, ready_s=0.0)
    assert rig.upload(messages) == 0
    rig.run(1)
    rig.take_off()
    return rig


def seconds_until(rig, condition, most=900):
    began = rig.vehicle.time_s
    assert rig.run(most, until=condition, step_s=0.05), rig.said()
    return rig.vehicle.time_s - began


@either
def test_a_jump_is_made_as_often_as_it_says_and_then_passed(autopilot):
    first = int(autopilot == "ardupilot")
    rig = started(autopilot, [TAKE_OFF, NEAR, FAR, without_place(177, 1 + first, 2), without_place(20)])
    seconds_until(rig, lambda: not rig.flight.armed)
    assert [seq - first for seq in rig.reached()] == [0, 1, 2, 1, 2, 1, 2]


@either
def test_a_jump_for_ever_goes_on_until_another_item_is_set(autopilot):
    first = int(autopilot == "ardupilot")
    rig = started(autopilot, [TAKE_OFF, NEAR, FAR, without_place(177, 1 + first, -1), without_place(20)])
    seconds_until(rig, lambda: rig.reached().count(2 + first) == 4)
    rig.send(mavlink.MAVLink_mission_set_current_message(1, 1, 4 + first))
    seconds_until(rig, lambda: not rig.flight.armed)


def test_a_mission_of_nothing_but_jumps_does_not_hang():
    items = [StoredItem(177, 2, (1.0, 9.0, 0.0, 0.0), 0, 0, 0.0), StoredItem(177, 2, (0.0, 9.0, 0.0, 0.0), 0, 0, 0.0)]
    place = FlatMap(KNOWN_HOME.lon_deg, KNOWN_HOME.lat_deg)
    rig = Rig.of("px4")
    navigator = Navigator(items, 0, place, 0.0, QUAD, radius_in_item=True)
    _, reached = navigator.step(rig.flight.motion, 0.0, landed=True)
    assert reached == []


@pytest.mark.parametrize(
    ("autopilot", "item", "wait_s"),
    [
        ("ardupilot", (16, 3, (6.0, 0, 0, 0), 4e-4), 6.0),
        ("ardupilot", (19, 3, (7.0, 0, 0, 0), 4e-4), 7.0),
        ("px4", (19, 3, (7.5, 0, 0, 0), 4e-4), 7.5),
        ("ardupilot", (18, 3, (2.0, 0, 0, 0), 4e-4), 36.0),  # two turns at 20 degrees a second
        ("ardupilot", without_place(93, 5.0), 5.0),
        ("px4", without_place(93, 5.0), 5.0),
    ],
)
def test_it_waits_where_it_is_told_to(autopilot, item, wait_s):
    first = int(autopilot == "ardupilot")
    rig = started(autopilot, [TAKE_OFF, NEAR, item, without_place(20)])
    seconds_until(rig, lambda: 1 + first in rig.reached())
    # The item lies where the vehicle is already, but for braking.
    assert wait_s <= seconds_until(rig, lambda: 2 + first in rig.reached()) + 0.1
    assert rig.vehicle.time_s < 60 + wait_s


@either
def test_a_loiter_without_limit_ends_nowhere(autopilot):
    first = int(autopilot == "ardupilot")
    rig = started(autopilot, [TAKE_OFF, (17, 3, (0.0,) * 4, 4e-4), FAR])
    assert not rig.run(300, until=lambda: 1 + first in rig.reached())
    assert rig.flight.motion.north_m == pytest.approx(44.3, abs=1)


@either
@pytest.mark.parametrize(("kind", "fastest"), [(1.0, 3.0), (0.0, 3.0), (2.0, QUAD.cruise_m_s)])
def test_a_change_of_speed_is_of_the_ground_speed_alone(autopilot, kind, fastest):
    far = (16, 3, (0.0,) * 4, 3e-3)
    rig = started(autopilot, [TAKE_OFF, without_place(178, kind, 3.0, -1.0), far, without_place(20)])
    speeds = []
    first = int(autopilot == "ardupilot")

    def there():
        speeds.append(rig.flight.motion.ground_speed_m_s)
        return 2 + first in rig.reached()

    seconds_until(rig, there)
    assert max(speeds) == pytest.approx(fastest, abs=0.01)


def test_px4_takes_off_by_itself_where_the_mission_does_not_say_so():
    rig = started("px4", [NEAR, FAR, without_place(20)])
    seconds_until(rig, lambda: rig.flight.motion.up_m > 9)
    assert rig.flight.motion.distance_m(0, 0) < 0.1
    seconds_until(rig, lambda: not rig.flight.armed)
    assert rig.reached()[:2] == [0, 1]


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([NEAR, TAKE_OFF], "Mission rejected: takeoff not first waypoint item"),
        ([(21, 3, (0.0,) * 4, 0.0)], "Mission rejected: starts with landing"),
        ([TAKE_OFF, without_place(112, 5.0)], "Mission rejected: item 2: unsupported cmd: 112"),
    ],
)
def test_px4_rejects_what_its_feasibility_check_rejects(rows, said):
    with pytest.raises(AssertionError):
        started("px4", rows)
    rig = Rig.of("px4", ready_s=0.0)
    place = (KNOWN_HOME.lat_deg, KNOWN_HOME.lon_deg, 10.0)
    messages = [item_message(seq, row[0], row[1], (*row[2], *place)) for seq, row in enumerate(rows)]
    assert rig.upload(messages) == 0
    rig.run(1)
    assert rig.command(START) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert said in rig.said()


@pytest.mark.parametrize(
    ("required", "text"), [(1, "Takeoff waypoint required."), (2, "Landing waypoint/pattern required.")]
)
def test_px4_requires_a_take_off_or_a_landing_where_it_is_told_to(required, text):
    rig = Rig.of("px4", ready_s=0.0)
    rig.vehicle.parameters.set("MIS_TKO_LAND_REQ", float(required))
    assert rig.upload([item_message(0, 16, 3, (0, 0, 0, 0, KNOWN_HOME.lat_deg, KNOWN_HOME.lon_deg, 10))]) == 0
    rig.run(1)
    assert rig.command(START) != 0
    assert f"Mission rejected: {text}"[:50] in rig.said()
