"""A flight that is cut at 40 %: its log, what is planned for the rest, the flight of that, the map of both logs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from sparsor.core.metrics import centred_relative_error
from sparsor.geodesy.lengths import distance_m
from sparsor.journeys.folder import write_mission
from sparsor.journeys.planning import plan_mission
from sparsor.journeys.reconstructing import ReconstructRequest, reconstruct
from sparsor.journeys.resuming import resumed_specification
from sparsor.mission.specification import specification
from test_whole_journey import (
    ALTITUDE_M,
    BEGIN_UNIX_US,
    BOX,
    SENSOR,
    Flown,
    cell_means,
    log_of,
    practice_flight,
)

CUT, SEEDS, LATER_US = 0.4, 4, 1_500_000_000


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A mission and its flight without a break."""
    folder = tmp_path_factory.mktemp("missions") / "known"
    asked = {
        "name": "known",
        "area": {"bbox": BOX},
        "search": {"iterations": 3000, "budget": "12%"},
        "flight": {"altitude_m": ALTITUDE_M, "speed_m_s": 10.0},
        "sensor": {"t90_s": SENSOR.t90_s},
    }
    with threadpool_limits(1):  # beside other test processes
        mission = plan_mission(specification(asked, base=folder))
    write_mission(mission, folder, preview=False)
    return Flown(mission, folder, *practice_flight(mission))


def cut(flown):
    """Return the flight up to 40 % of the time between its first stop and its last: there the recording ends."""
    time_s, lon, lat, up_m = flown.track.T
    ends = [flown.mission.plan.stops[k] for k in (0, -1)]
    away_m = [np.where(up_m > 0.9 * ALTITUDE_M, distance_m(lon, lat, one.lon_deg, one.lat_deg), np.inf) for one in ends]
    half = time_s.size // 2
    first_s, last_s = time_s[away_m[0][:half].argmin()], time_s[away_m[1].argmin()]
    end_s = first_s + CUT * (last_s - first_s)
    heard = [one for one in flown.positions if one.time_boot_ms <= 1000 * end_s]
    return replace(flown, track=flown.track[time_s <= end_s], positions=heard)


def error(truth, logs, folder, *, whole):
    """Return the error of the map of logs, as it is stated; no stop of whole flights is missed."""
    with threadpool_limits(1):
        made = reconstruct(ReconstructRequest(logs=logs, mission=folder, unit="ppb", decoder="mmse"))
    assert (made.measured.missed.size == 0) == whole
    return float(centred_relative_error(truth[None], made.decoded.values[None])[0])


def home(mission):
    return mission.plan.home.lon_deg, mission.plan.home.lat_deg


@pytest.mark.timeout(300)
def test_the_map_of_a_flight_that_was_cut_and_resumed_is_as_good_as_that_of_one_without_a_break(whole, tmp_path):
    part = cut(whole)
    logs = [log_of(part, seed, tmp_path / f"part-{seed}.tlog") for seed in range(SEEDS)]
    soon = {"search": {"iterations": 3000}}
    with threadpool_limits(1):
        spec, before = resumed_specification(whole.folder, logs[:1], soon, base=tmp_path)
        rest = plan_mission(spec, before=before)
    folder = whole.folder.parent / spec.name
    write_mission(rest, folder, preview=False)
    assert before.covered.length_m == pytest.approx(CUT * whole.mission.path_length_m, rel=0.1)
    assert before.covered.length_m + rest.path_length_m <= 0.12 * whole.mission.place.full_coverage_m
    assert rest.flyable
    assert distance_m(*home(whole.mission), *home(rest)) < 0.1
    assert rest.expected_relative_error < 1.1 * whole.mission.expected_relative_error

    later = Flown(rest, folder, *practice_flight(rest))
    truth = cell_means(whole.mission.place.grid)
    errors = {"whole": [], "resumed": [], "part": []}
    for seed, log in enumerate(logs):
        more = log_of(later, SEEDS + seed, tmp_path / f"later-{seed}.tlog", BEGIN_UNIX_US + LATER_US)
        unbroken = log_of(whole, seed, tmp_path / f"whole-{seed}.tlog")
        for name, flown, its_folder in (
            ("whole", (unbroken,), whole.folder),
            ("part", (log,), whole.folder),
            ("resumed", (log, more), folder),
        ):
            errors[name].append(error(truth, flown, its_folder, whole=name != "part"))
    mean = {name: np.mean(each) for name, each in errors.items()}
    assert mean["resumed"] < 1.1 * mean["whole"], mean
    assert mean["resumed"] < 0.7 * mean["part"], mean
