"""Logs of real flights and of ArduPilot in simulation, where they are at hand (SPARSOR_LOGS, or beside the project)."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from sparsor.flightlog import read_log, read_logs, samples
from sparsor.flightlog.messages import NAMED_VALUE_FLOAT, WANTED, layout, read_messages

FOLDER = Path(os.environ.get("SPARSOR_LOGS", Path(__file__).resolve().parents[3] / "shared" / "logs"))
M_PER_DEG = 111_318.845
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no logs in {FOLDER}")
TLOGS = sorted(FOLDER.glob("*.tlog")) if FOLDER.is_dir() else []


def truth(found):
    """What the simulated field was where the samples are (its formula is beside the logs)."""
    north = (found.lat_deg - 25.3) * M_PER_DEG
    east = (found.lon_deg - 51.5) * M_PER_DEG * np.cos(np.radians(25.3))
    bump = np.exp(-((north - 180) ** 2 + (east - 150) ** 2) / (2 * 120**2))
    return 20 + 60 * bump * np.exp(-(found.alt_m - 10) / 200) + 0.02 * east


def pymavlink_rows(path):
    """Sender and wanted fields of every wanted message, by pymavlink."""
    from pymavlink import mavutil

    rows = Counter()
    log = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
    while (message := log.recv_match()) is not None:
        number = message.get_msgId()
        if number in WANTED and message.get_type() != "BAD_DATA":
            who = (message.get_srcSystem(), message.get_srcComponent())
            rows[(number, *who, *(plain(getattr(message, name)) for name in layout(number).names))] += 1
    return rows


def plain(value):
    if isinstance(value, str):
        return value.encode("utf-8", "surrogateescape").split(b"\x00")[0]
    if isinstance(value, bytes):
        return value.split(b"\x00")[0]
    return tuple(value) if isinstance(value, list) else value


@pytest.mark.parametrize("path", TLOGS, ids=[path.stem for path in TLOGS])
def test_the_same_messages_as_pymavlink(path):
    tables, _ = read_messages([path.read_bytes()])
    ours = Counter()
    for key, table in tables.items():
        for fields in table.fields.tolist():
            ours[(*key, *(plain(value) for value in fields))] += 1
    assert ours == pymavlink_rows(path)


def test_samples_meet_the_simulated_field_at_their_own_place():
    found = samples(read_log(FOLDER / "arducopter_30wp_no2.tlog"))
    assert found.value.size == 1266
    assert np.abs(found.value - truth(found)).max() < 0.01
    assert set(found.clock) == {"vehicle"}


def test_a_companions_clock_at_a_tenth_of_the_rate_is_recovered():
    log = read_log(FOLDER / "arducopter_4wp_companion.tlog")
    assert np.abs((own := samples(log, sensor="NO2")).value - truth(own)).max() < 0.01
    found = samples(log, sensor="NO2C")
    (use,) = found.clocks
    assert (use.clock, round(use.rate, 2)) == ("companion", 0.1)
    # The vehicle's own log says when each of these values came in.
    vehicle = read_log(FOLDER / "arducopter_4wp_companion.BIN.xz")
    (came,) = [values for values in vehicle.values if values.name == "NO2C"]
    time_s, _ = vehicle.clocks[1].at(came.order, came.received_s)
    when = dict(zip(came.value.tolist(), time_s.tolist(), strict=True))
    off = [
        at - when[value] for at, value in zip(found.time_s.tolist(), found.value.tolist(), strict=True) if value in when
    ]
    assert len(off) > 100
    assert np.abs(off).max() < 1.0


def test_the_vehicles_log_agrees_with_the_ground_stations():
    paths = [FOLDER / f"arducopter_4wp_companion.{end}" for end in ("tlog", "BIN.xz")]
    log = read_logs(paths)
    assert len(log.boots) == 1
    script, sent = samples(log, sensor="NO2S.NO2"), samples(log, sensor="NO2")
    assert np.abs(script.value - truth(script)).max() < 0.01
    inside = (script.time_s > sent.time_s[0]) & (script.time_s < sent.time_s[-1])
    apart = np.abs(np.interp(script.time_s, sent.time_s, sent.value) - script.value)[inside]
    assert apart.max() < 0.02
    assert log.damage.repeated == 104  # the companion's values are in both


def test_a_real_vehicles_bursts_and_a_truncated_log():
    log = read_log(FOLDER / "ardusub_named_values.tlog")
    assert sum(v.value.size for v in log.values if v.message == "NAMED_VALUE_FLOAT") == 4224
    assert log.damage.places == 4
    assert len({str(sender) for sender in log.heard}) == 5
    quad = read_log(FOLDER / "quad_truncated.tlog")
    assert quad.vehicles == (10,)
    assert len({e.value for e in quad.events if e.kind == "item_reached"}) == 36
    assert NAMED_VALUE_FLOAT not in {v.message for v in quad.values}
