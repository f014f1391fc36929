"""Several files of one mission: everything is there once."""

from __future__ import annotations

import pytest

from flightlog.logs import TlogMaker, bin_flight, flight, place
from sparsor.flightlog import read_logs, samples


@pytest.fixture
def joined(tmp_path):
    def join(*contents, **options):
        paths = []
        for number, content in enumerate(contents):
            paths.append(tmp_path / f"{number}.log")
            paths[-1].write_bytes(content)
        return read_logs(paths, **options)

    return join


@pytest.mark.parametrize("boot_ms", [0, 10**9])
def test_what_stands_at_a_files_end_is_not_put_between_two_files(joined, boot_ms):
    maker = flight()
    for _ in range(5):
        maker.named(boot_ms, 70.1, 99.0)  # behind the last word of the vehicle, with a stamp that tells nothing
    found = samples(joined(maker.content, maker.content))
    assert (found.time_s[found.value == 99.0] >= 70.0).all()
    assert found.value[found.value != 99.0].size == 60


def test_values_from_when_no_vehicle_was_heard_have_no_place(joined):
    sensor = TlogMaker()
    for second in range(60):
        sensor.named(0, 1000.0 + second, 1.0, component=191)
    log = joined(without_values(flight()).content, sensor.content)
    found = samples(log)
    assert (found.value.size, found.dropped.no_position) == (0, 60)


def without_values(maker):
    return TlogMaker([record for record in maker.records if record[8 + 7] != 251])


def test_a_recorder_whose_clock_is_right_knows_the_vehicles_boot(joined):
    maker = TlogMaker()
    for quarter in range(80):  # not one position is in both, and no time of day
        boot_s = 10.1 + quarter / 4
        maker.position(boot_s, boot_s - 10.0, *place(boot_s))  # the vehicle was powered up before the recorder's start
    assert [boot.unix_source for boot in joined(maker.content).boots] == ["receiver"]
    assert [boot.unix_source for boot in joined(maker.content, flight().content).boots] == ["vehicle"]


@pytest.mark.parametrize("timed", [True, False])
def test_a_log_and_its_repeat_count_once(joined, timed):
    content = flight().content if timed else without_time(flight()).content
    log = joined(content, content, content)
    assert samples(log).value.size == 60
    assert len(log.boots) == 1
    assert log.damage.repeated == 2 * 60
    assert log.boots[0].tracks[0].time_s.size == 241


def without_time(maker):
    return TlogMaker([record for record in maker.records if record[8 + 7] != 2])


def test_two_halves_that_overlap_are_the_whole(joined):
    records = flight().records
    log = joined(b"".join(records[:250]), b"".join(records[150:]))
    found, whole = samples(log), samples(joined(b"".join(records)))
    assert found.time_s.tolist() == whole.time_s.tolist()
    assert found.value.tolist() == whole.value.tolist()
    assert len(log.boots) == 1


def test_sorties_stay_apart_whatever_their_order(joined):
    first = flight(20)
    second = TlogMaker()
    for quarter in range(80):
        boot_s = 10.0 + quarter / 4
        second.position(boot_s, boot_s + 1000, 51.6, 25.4)
        second.named(round(boot_s * 1e3), boot_s + 1000, 1.0)
    log = joined(second.content, first.content)
    assert len(log.boots) == 2
    found = samples(log)
    assert found.value.size == 100
    assert found.lon_deg[:20].max() < 51.55  # the first sortie of the day comes first
    assert found.lon_deg[20:].min() > 51.55


def test_equal_values_in_one_file_are_as_many_as_were_sent(joined):
    maker = flight(5)
    for _ in range(3):
        maker.named(12_000, 12.0, 1.0, b"O3")
    log = joined(maker.content, maker.content)
    (values,) = [values for values in log.values if values.name == "O3"]
    assert values.value.tolist() == [1.0] * 3


def test_the_vehicles_log_and_the_ground_stations_stand_side_by_side(joined):
    log = joined(flight().content, bin_flight())
    assert log.kinds == ("tlog", "BIN")
    assert samples(log, sensor="NO2").value.size == 60
    assert samples(log, sensor="NO2S.NO2").value.size == 60


def test_what_happened_is_not_told_twice(joined):
    from pymavlink.dialects.v20 import ardupilotmega as v2

    maker = flight(5)
    maker.add(v2.MAVLink_statustext_message(6, b"hello"), 16.0)
    assert len(joined(maker.content, maker.content).events) == 1
