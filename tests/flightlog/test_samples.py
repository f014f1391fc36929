"""Samples have the place where they were measured, whatever clock their sender stamps them with."""

from __future__ import annotations

import numpy as np
import pytest

from flightlog.logs import BOOT_UNIX_S, START_US, TlogMaker, flight, place, v2, value_at
from sparsor.errors import LogError
from sparsor.flightlog import samples
from sparsor.flightlog.assembly import assemble
from sparsor.flightlog.tlog import read_tlog

PER_SECOND = abs(value_at(place(1.0)[0]) - value_at(place(0.0)[0]))


def log_of(maker):
    return assemble("made.tlog", read_tlog([maker.content]))


def error_s(found):
    """How far from its true time each sample was put, seconds: the made-up field is linear along the flight."""
    return np.abs(found.value - np.array([value_at(lon) for lon in found.lon_deg])) / PER_SECOND


def with_stamps(stamp_of, *, rate=1.0, seconds=60, component=1, system=1, delay_of=lambda _: 0.0):
    """A flight whose samples, true at their time since boot, carry the stamps of another clock."""
    maker = TlogMaker()
    for quarter in range(4 * seconds + 1):
        boot_s = 10.0 + quarter / 4
        maker.position(boot_s, boot_s / rate, *place(boot_s))
        if quarter % 4 == 2:
            received_s = (boot_s + 0.1 + delay_of(quarter)) / rate
            value = value_at(place(boot_s + 0.1)[0])
            maker.named(stamp_of(boot_s + 0.1), received_s, value, system=system, component=component)
            maker.records.sort(key=lambda record: record[:8])  # as a recorder writes them
    return maker


STAMPS = {
    "milliseconds": lambda s: round(s * 1e3),
    "seconds with a fraction lost": lambda s: int(s),
    "microseconds": lambda s: round(s * 1e6),
}


@pytest.mark.parametrize("unit", STAMPS)
@pytest.mark.parametrize("component", [1, 191])
def test_the_vehicles_clock_is_recognised_in_any_unit(unit, component):
    found = samples(log_of(with_stamps(STAMPS[unit], component=component, rate=10.0)))
    assert {use.clock for use in found.clocks} == {"vehicle"}
    assert error_s(found).max() < (1.0 if unit.startswith("seconds") else 2e-3)


@pytest.mark.parametrize(("rate", "start_s"), [(0.1, 5.0), (1.0, -4000.0), (1.0001, -500.0), (1000.0, 7.0)])
def test_a_companions_clock_is_mapped_by_rate_and_offset(rate, start_s):
    clock = lambda s: round((s - start_s) * rate * 1e3)  # noqa: E731
    found = samples(log_of(with_stamps(clock, component=191, delay_of=lambda n: 0.3 * (n % 3 == 0))))
    (use,) = found.clocks
    assert use.clock == "companion"
    assert use.rate == pytest.approx(rate, rel=0.01)
    assert use.offset_s == pytest.approx(start_s, abs=max(1.0, abs(start_s) * 0.01))
    assert error_s(found).max() < 0.5


def test_a_companion_that_was_started_again_has_two_clocks():
    clock = lambda s: round((s - (30.0 if s > 40 else 5.0)) * 1e3)  # noqa: E731
    found = samples(log_of(with_stamps(clock, component=191)))
    assert [use.clock for use in found.clocks] == ["companion", "companion"]
    assert [round(use.offset_s) for use in found.clocks] == [5, 30]
    assert error_s(found).max() < 0.3


@pytest.mark.parametrize("stamp", [0, 12_345])
def test_a_stamp_that_stands_still_is_not_a_clock(stamp):
    found = samples(log_of(with_stamps(lambda _: stamp, component=191)))
    assert {use.clock for use in found.clocks} == {"receive"}
    assert set(found.clock) == {"receive"}
    assert error_s(found).max() < 0.3


def test_a_clock_by_the_time_of_day_is_the_vehicles_when_its_power_up_is_known():
    maker = flight(30)
    for second in range(30):
        boot_s = 10.5 + second
        stamp_us = round((BOOT_UNIX_S + boot_s) * 1e6)
        value = value_at(place(boot_s)[0])
        maker.add(v2.MAVLink_debug_vect_message(b"gas", stamp_us, value, 0, 0), boot_s + 0.2, component=191)
    maker.records.sort(key=lambda record: record[:8])
    found = samples(log_of(maker), sensor="gas.x")
    assert {use.clock for use in found.clocks} == {"vehicle"}
    assert error_s(found).max() < 0.01


def test_late_values_of_the_autopilot_keep_their_own_time():
    maker = with_stamps(lambda s: round(s * 1e3), delay_of=lambda n: 12.0 * (n % 8 == 2), seconds=90)
    found = samples(log_of(maker))
    assert {use.clock for use in found.clocks} == {"vehicle"}
    assert error_s(found).max() < 2e-3


def test_the_recorders_clock_may_step_both_ways():
    maker = flight(60)
    for number in range(len(maker.records)):
        if 80 < number < 160:
            stamp = int.from_bytes(maker.records[number][:8], "big") + (1 if number < 120 else -1) * 86_400_000_000
            maker.records[number] = stamp.to_bytes(8, "big") + maker.records[number][8:]
    found = samples(log_of(maker))
    assert error_s(found).max() < 1e-3
    assert found.time_s.size == 60


def test_bursts_that_share_a_stamp_keep_all_their_values():
    maker = flight(20)
    for name in (b"a", b"b", b"c"):
        for second in range(20):
            maker.named(10_500 + 1000 * second, 10.6 + second, float(second), name)
    maker.records.sort(key=lambda record: record[:8])
    assert samples(log_of(maker), sensor="b").value.tolist() == list(range(20))


def test_positions_are_interpolated_and_never_held():
    maker = TlogMaker()
    for boot_s in (10.0, 12.0, 14.0, 30.0, 32.0):
        maker.position(boot_s, boot_s, *place(boot_s))
    for boot_s in (9.5, 11.0, 13.5, 20.0, 31.0, 32.0, 33.0):
        maker.named(round(boot_s * 1e3), boot_s, value_at(place(boot_s)[0]))
    maker.records.sort(key=lambda record: record[:8])
    found = samples(log_of(maker))
    assert found.time_s.tolist() == [11.0, 13.5, 31.0, 32.0]
    assert found.dropped.no_position == 3
    assert error_s(found).max() < 2e-3
    assert samples(log_of(maker), max_gap_s=20.0).time_s.tolist() == [11.0, 13.5, 20.0, 31.0, 32.0]


def test_places_across_the_antimeridian_are_between_their_neighbours():
    maker = TlogMaker()
    for number, lon in enumerate((179.9998, 179.9999, -179.9999, -179.9998)):
        maker.position(10.0 + number, 10.0 + number, lon, 1.0)
    for boot_s in (10.5, 11.5, 12.5):
        maker.named(round(boot_s * 1e3), boot_s + 0.01, 1.0)
    maker.records.sort(key=lambda record: record[:8])
    found = samples(log_of(maker))
    assert np.abs(found.lon_deg) == pytest.approx([179.99985, 180.0, 179.99985], abs=1e-6)


def test_false_positions_are_dropped_and_counted():
    maker = TlogMaker()
    for quarter in range(80):
        boot_s = 10.0 + quarter / 4
        lon, lat = (0.0, 0.0) if quarter < 5 else place(boot_s)
        lat += 0.01 if quarter in (20, 21, 50) else 0.0  # a kilometre off
        maker.position(boot_s, boot_s, lon, lat)
        if quarter % 4 == 2:
            maker.named(round(boot_s * 1e3) + 50, boot_s + 0.05, value_at(place(boot_s + 0.05)[0]))
    (boot,) = log_of(maker).boots
    assert (boot.tracks[0].dropped.zero, boot.tracks[0].dropped.jumping) == (5, 3)
    found = samples(log_of(maker))
    assert np.abs(found.lat_deg - place(0)[1]).max() < 1e-9
    assert error_s(found).max() < 2e-3
    assert found.dropped.no_position == 1


def test_the_receiver_stands_in_where_the_estimate_is_silent():
    maker = TlogMaker()
    for quarter in range(80):
        boot_s = 10.0 + quarter / 4
        maker.position(boot_s, boot_s, *(place(boot_s) if quarter < 20 else (0.0, 0.0)))
        maker.gps(boot_s, boot_s, *place(boot_s), fix=3 if quarter < 60 else 1)
        if quarter % 4 == 2:
            maker.named(round(boot_s * 1e3), boot_s + 0.05, value_at(place(boot_s)[0]))
    found = samples(log_of(maker))
    assert found.track == "GLOBAL_POSITION_INT, GPS_RAW_INT"
    assert found.time_s.max() < 25.0
    assert found.time_s.size == 15
    assert error_s(found).max() < 2e-3
    assert found.height_m == pytest.approx(np.full(15, 30.0), abs=0.01)


def test_values_that_are_no_numbers_are_dropped_and_counted():
    maker = flight(10)
    maker.named(15_000, 15.0, float("nan"))
    maker.records.sort(key=lambda record: record[:8])
    found = samples(log_of(maker))
    assert (found.value.size, found.dropped.not_finite) == (10, 1)


def test_sorties_are_in_order_of_the_day():
    maker = flight(10, start_s=20.0)
    flight(10, start_s=2.0, maker=maker)
    found = samples(log_of(maker))
    assert sorted(found.boot.tolist()) == [0] * 10 + [1] * 10
    assert (np.diff(found.unix_s) >= 0).all()
    assert error_s(found).max() < 1e-3


def test_sorties_are_flown_one_after_the_other_whatever_the_clocks_say():
    maker = flight(10)
    flight(10, start_s=2.0, maker=maker)  # by the time of day, one began before the other had ended
    found = samples(log_of(maker))
    assert np.flatnonzero(np.diff(found.boot)).tolist() == [9]
    assert error_s(found).max() < 1e-3


@pytest.mark.parametrize("late_s", [1.6, -1.6])
def test_a_companion_powered_up_with_the_vehicle_has_a_clock_of_its_own(late_s):
    found = samples(log_of(with_stamps(lambda s: round((s - late_s) * 1e3), component=191)))
    assert set(found.clock) == {"companion"}
    assert error_s(found).max() < 0.3


def test_the_sensor_of_another_system_flies_on_the_only_vehicle():
    maker = with_stamps(lambda s: round((s + 77) * 1e3), system=2, component=158)
    found = samples(log_of(maker))
    assert (found.system, tuple(found.sender)) == (1, (2, 158))
    assert error_s(found).max() < 0.3


def two_vehicles():
    maker = flight(10)
    for boot_s in range(10, 20):
        maker.position(boot_s, boot_s, 51.6, 25.4, system=7)
    maker.named(12_000, 12.0, 3.0, b"O3", system=9)
    maker.records.sort(key=lambda record: record[:8])
    return log_of(maker)


def test_the_sensors_own_vehicle_is_taken_and_another_one_can_be_named():
    assert samples(two_vehicles(), sensor="NO2").system == 1
    found = samples(two_vehicles(), sensor="NO2@1/1", system=7)
    assert found.system == 7
    assert found.lon_deg == pytest.approx(np.full(found.lon_deg.size, 51.6))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, ["NO2@1/1", "O3@9/1", "--sensor"]),
        ({"sensor": "CO"}, ["'CO'", "NO2@1/1", "O3@9/1"]),
        ({"sensor": "O3"}, ["9/1", "1, 7", "--system"]),
        ({"sensor": "NO2", "system": 3}, ["system 3", "1, 7"]),
    ],
)
def test_what_is_not_clear_is_an_error_that_lists_the_choices(options, words):
    with pytest.raises(LogError) as error:
        samples(two_vehicles(), **options)
    assert all(word in str(error.value) for word in words), error.value


def test_a_log_without_a_sensor_says_who_was_heard():
    maker = TlogMaker()
    maker.position(1.0, 1.0, 51.5, 25.3)
    with pytest.raises(LogError, match=r"no sensor is in the log, only messages of 1/1 \(1 messages\)"):
        samples(log_of(maker))


def test_a_log_without_positions_says_so():
    maker = TlogMaker()
    maker.named(1000, 1.0, 5.0)
    with pytest.raises(LogError, match="no position of any vehicle"):
        samples(log_of(maker))


def test_times_of_day_are_the_vehicles():
    found = samples(log_of(flight(10)))
    assert found.unix_s - found.time_s == pytest.approx(np.full(10, BOOT_UNIX_S), abs=0.01)
    assert abs(BOOT_UNIX_S - START_US / 1e6) > 1.0  # else the recorder's clock could have told it
