"""What is made of the messages of a flight, one by one."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from link.flight_rig import LAT, LON, STOPS, short_plan
from sparsor.core.mavlink_frames import Frame
from sparsor.errors import LinkFailureError
from sparsor.link.flights.linkwatch import LinkWatch
from sparsor.link.flights.route import Route
from sparsor.link.flights.samples import SampleCounter
from sparsor.link.flights.statustexts import StatusTexts
from sparsor.link.flights.watching import Tracker
from sparsor.link.inbox import Received
from sparsor.link.vehicles import FoundVehicle

CODEC = mavlink.MAVLink(None, 1, 1)
AUTO = 3


class Watched:
    """A tracker of an ArduCopter, its counter, and the words of all events."""

    def __init__(self):
        self.samples = SampleCounter()
        self.samples.system_id = 1
        self.tracker = Tracker(short_plan(), FoundVehicle(1, 1, 3, 2, armed=False), self.samples, "AUTO")
        self.events = []

    def hear(self, message):
        received = Received(Frame(bytes(message.pack(CODEC))), message, 0.0)
        self.samples(received)
        if received.kind != "NAMED_VALUE_FLOAT":
            self.events += self.tracker.take(received)

    def beat(self, *, armed=True, mode=AUTO):
        self.hear(mavlink.MAVLink_heartbeat_message(2, 3, 1 | (128 if armed else 0), mode, 4, 3))

    def fix(self, seconds, lon=LON, lat=LAT, up_m=20.0, down_m_s=0.0, east_m_s=0.0):
        height = round(up_m * 1000)
        self.hear(
            mavlink.MAVLink_global_position_int_message(
                round(seconds * 1000),
                round(lat * 1e7),
                round(lon * 1e7),
                height,
                height,
                0,
                round(east_m_s * 100),
                round(down_m_s * 100),
                0,
            )
        )

    def state(self, landed):
        self.hear(mavlink.MAVLink_extended_sys_state_message(0, landed))

    def sample(self, value=20.0):
        self.hear(mavlink.MAVLink_named_value_float_message(0, b"NO2", value))

    @property
    def words(self):
        return [event.text for event in self.events]

    @property
    def warnings(self):
        return [event.text for event in self.events if event.warning]


@pytest.fixture
def flying():
    watched = Watched()
    watched.beat()
    watched.fix(10)
    watched.sample()
    return watched


def test_samples_that_stop_are_told_once_by_the_vehicles_clock(flying):
    for second in range(11, 20):
        flying.fix(second)
    assert not flying.warnings
    for second in range(20, 40):
        flying.fix(second)
    assert flying.warnings == ["no sample for 11 s"]
    flying.sample()
    flying.fix(40)
    assert flying.words[-1] == "samples come again"
    assert flying.tracker.view().sample == "NO2 20.0"


def test_a_sensor_that_never_spoke_is_told():
    watched = Watched()
    watched.beat()
    for second in range(15):
        watched.fix(second)
    assert watched.warnings == ["no sample came yet"]


def test_the_rate_is_of_the_vehicles_time(flying):
    for step in range(40):
        flying.fix(11 + step * 0.5)
        flying.sample()
    assert flying.samples.rate_hz == pytest.approx(2.0)
    assert flying.samples.total == 41


def test_a_low_battery_is_told_once(flying):
    for percent in (90, 19, 18):
        flying.hear(mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 0, 0, percent, 0, 0, 0, 0, 0, 0))
    assert flying.warnings == ["battery at 19 %"]
    assert flying.tracker.view().battery_percent == 18


def test_a_waypoint_counts_as_reached_when_its_word_was_lost_but_it_was_passed(flying):
    flying.hear(mavlink.MAVLink_mission_current_message(3))  # item 2 of the plan, the first waypoint
    flying.fix(11, *STOPS[0])
    flying.hear(mavlink.MAVLink_mission_current_message(4))
    assert flying.tracker.reached == {2}
    flying.hear(mavlink.MAVLink_mission_current_message(6))  # never near the next two
    assert flying.tracker.reached == {2}
    flying.hear(mavlink.MAVLink_mission_item_reached_message(4))
    assert flying.tracker.reached == {2, 3}
    assert flying.words[-1] == "item 4 of 8 reached"


def test_landed_or_fallen(flying):
    flying.fix(11, up_m=0.2, down_m_s=0.5)
    flying.state(1)
    flying.beat(armed=False)
    assert flying.tracker.ended
    assert flying.tracker.on_ground


def test_a_vehicle_that_falls_is_not_landed_whatever_it_says(flying):
    flying.state(2)
    flying.fix(11, up_m=15, down_m_s=6)
    flying.state(1)
    flying.beat(armed=False)
    flying.fix(12, up_m=0)
    assert flying.tracker.ended
    assert not flying.tracker.on_ground


def test_armed_on_the_ground_is_no_flight():
    watched = Watched()
    watched.beat()
    watched.fix(1, up_m=0)
    watched.state(1)
    watched.beat(armed=False)
    assert not watched.tracker.flown
    assert not watched.tracker.ended


def test_a_speed_on_the_ground_is_noise_where_the_vehicle_says_that_it_stands():
    watched = Watched()
    watched.beat()
    watched.state(1)
    watched.fix(1, up_m=0, east_m_s=2.0)
    assert not watched.tracker.flown
    watched.state(0)  # a rover says nothing of the kind
    watched.fix(2, up_m=0, east_m_s=2.0)
    assert watched.tracker.flown


def test_a_height_from_before_it_was_armed_is_no_flight():
    watched = Watched()
    watched.fix(1, up_m=3)  # the barometer drifted; home is set when it is armed
    watched.beat()
    watched.state(0)
    assert not watched.tracker.flown
    watched.fix(2, up_m=3)
    assert watched.tracker.flown


def test_a_slow_boat_is_under_way_when_it_has_gone_some_metres():
    watched = Watched()
    watched.fix(1, up_m=0)
    watched.beat()
    watched.fix(2, up_m=0, east_m_s=0.5)
    assert not watched.tracker.flown
    watched.fix(14, lon=LON + 0.00006, up_m=0, east_m_s=0.5)  # six metres
    assert watched.tracker.flown


def test_a_vehicle_that_is_down_and_stays_armed_is_told_of_once(flying):
    for second in range(11, 80):
        flying.fix(second, up_m=0.1)  # as a rover at a stop: not told
        flying.sample()
    assert not flying.warnings
    flying.state(1)
    for second in range(80, 109):
        flying.fix(second, up_m=0.1)
        flying.sample()
    assert not flying.warnings
    for second in range(109, 160):
        flying.fix(second, up_m=0.1)
        flying.sample()
    assert flying.warnings == ["it stands still and stays armed: disarm it, or end the recording with Ctrl-C"]


def test_a_rover_that_is_done_and_stays_armed_is_told_of(flying):
    flying.hear(mavlink.MAVLink_mission_item_reached_message(max(flying.tracker.waypoints) + 1))
    for second in range(11, 50):
        flying.fix(second, up_m=0.1)
        flying.sample()
    assert any("stays armed" in warning for warning in flying.warnings)


class Line:
    """Stands in for a connection: how long it was silent, and what was sent."""

    def __init__(self):
        self.silence_s, self.sent = 0.0, []

    def silent_s(self, _system):
        return self.silence_s

    def send(self, message):
        self.sent.append(message)


def test_silence_is_told_once_and_its_end_too():
    line = Line()
    watch = LinkWatch(line, FoundVehicle(1, 1, 3, 2, armed=True))
    assert watch.check(60.0, flying=True) is None
    line.silence_s = 5.0
    told = watch.check(60.0, flying=True)
    assert (told.text, told.warning) == ("nothing was heard for 5 s: the vehicle flies on by itself", True)
    assert watch.check(60.0, flying=True) is None
    line.silence_s = 0.1
    assert watch.check(60.0, flying=True).text == "the vehicle is heard again"
    line.silence_s = 61.0
    with pytest.raises(LinkFailureError, match="link was lost: nothing was heard of the vehicle for 61 s"):
        watch.check(60.0, flying=True)


def test_what_does_not_come_is_asked_for_again(monkeypatch):
    line = Line()
    watch = LinkWatch(line, FoundVehicle(1, 1, 3, 2, armed=True))
    watch.check(None, flying=False)
    assert not line.sent
    monkeypatch.setattr("sparsor.link.flights.linkwatch.MISSING_S", -1.0)
    watch.check(None, flying=False)
    assert {mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT} <= {
        int(message.param1) for message in line.sent
    }


def test_what_a_vehicle_says_in_pieces():
    texts = StatusTexts()
    long = "PreArm: " + "x" * 70
    assert texts.take(mavlink.MAVLink_statustext_message(2, long[:50].encode(), 7, 0)) is None
    said = texts.take(mavlink.MAVLink_statustext_message(2, long[50:].encode(), 7, 1))
    assert (said.text, said.serious) == (long, True)
    texts.take(mavlink.MAVLink_statustext_message(6, b"calm"))
    texts.take(mavlink.MAVLink_statustext_message(2, b"PreArm: GPS"))
    texts.take(mavlink.MAVLink_statustext_message(2, b"PreArm: GPS"))
    assert texts.last() == (long, "PreArm: GPS")


def test_the_rest_of_a_route_shrinks_to_nothing():
    plan = short_plan()
    route = Route(plan)
    left = [route.left_m(place, LON, LAT) for place in range(len(plan.items))]
    assert left[0] > left[3] > left[-1]
    assert left[-1] == pytest.approx(0, abs=1)
    assert route.left_s(0, left[0], 20) > route.left_s(4, left[4], 20) > 20


def test_on_the_way_home_the_way_home_is_what_is_left(flying):
    flying.beat(mode=3)
    flying.fix(20, lon=LON + 0.0006, lat=LAT + 0.0006)
    of_the_mission = flying.tracker.view()
    flying.beat(mode=6)  # RTL
    home = flying.tracker.view()
    straight_m = 0.0006 * 111_000 * (1 + 0.906**2) ** 0.5
    assert home.left_m == pytest.approx(straight_m, rel=0.02)
    assert home.left_m < of_the_mission.left_m
    assert home.left_s < of_the_mission.left_s


def test_it_lands_before_it_is_disarmed_whichever_is_heard_first(flying):
    flying.state(2)
    flying.state(4)
    flying.fix(60, up_m=0.1)
    flying.beat(armed=False)
    flying.state(1)
    assert flying.words[-2:] == ["landed", "disarmed"]
    assert flying.words.count("landed") == 1


def test_a_vehicle_disarmed_in_the_air_did_not_land(flying):
    flying.state(2)
    flying.fix(60, up_m=20)
    flying.beat(armed=False)
    assert "landed" not in flying.words


@pytest.mark.parametrize(("value", "words"), [(31.456, "NO2 31.5"), (0.034567, "NO2 0.0346"), (1234.5, "NO2 1234.5")])
def test_a_sample_is_shown_rounded(flying, value, words):
    flying.sample(value)
    assert flying.tracker.view().sample == words
