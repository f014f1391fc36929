"""A route beyond one battery becomes several plans; every stop in one of them, each within endurance."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from sparsor.design.legs import unit_legs
from sparsor.journeys.flown import mission_of_folder
from sparsor.journeys.uploading import choose_plan
from sparsor.mission import read_plan, time_plan
from sparsor.mission.sidecar import read_sidecar
from sparsor.vehicle import SteadyWind, load_vehicle

pytestmark = pytest.mark.usefixtures("no_picture")
EXAMPLE = Path(__file__).parents[2] / "geo" / "keep-out-example.geojson"
HOME = ("--home", 51.504, 25.2815)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("quad", ("--budget", "30km", "--wind", 4, 300)),
        ("quad", ("--budget", "25km", "--keep-out", EXAMPLE, "--autopilot", "px4")),
        ("rover", ("--budget", "50km", "--export", "waypoints")),
        ("plane", ("--budget", "90km", "--hold", 60)),
    ],
)
def test_the_sorties_fly_the_route(console, tmp_path, kind, options):
    words = ("--name", "m", "--vehicle", kind, "--json", *HOME, *options)
    whole = console.mission(*words, "--no-sorties", iterations=100)
    planned = read_sidecar(tmp_path / "missions/m/m.npz").stops
    ran = console.mission(*words, "--force", iterations=100)
    assert ran.code == 0, ran.err
    result, folder = ran.result, tmp_path / "missions/m"
    if whole.result["flyable"]:
        assert result["sorties"] == 1
        return
    assert result["flyable"]
    assert result["sorties"] == len(result["plans"])
    numbered = [f"m-{n}.plan" for n in range(1, result["sorties"] + 1)]
    names = numbered if len(numbered) > 1 else ["m.plan"]  # one flight, in another order
    assert result["plans"] == [str(Path("missions/m") / name) for name in names]
    assert sorted(path.name for path in folder.glob("*.plan")) == sorted(names)
    vehicle = load_vehicle(kind)
    wind = SteadyWind(4, 300) if "--wind" in options else SteadyWind()
    plans = [read_plan(Path(path)) for path in result["plans"]]
    usable_s = vehicle.endurance_s * (1 - vehicle.reserve_fraction)
    times = [time_plan(plan, vehicle, wind) for plan in plans]
    assert all(time.used_s <= usable_s for time in times)
    assert result["sortie_times_s"] == pytest.approx([time.seconds for time in times])

    sidecar = read_sidecar(folder / "m.npz")
    assert sorted(sidecar.plans) == sorted(Path(path).name for path in result["plans"])
    assert sidecar.stops.size == result["stops"] == whole.result["stops"]
    assert set(sidecar.stops.tolist()) == set(planned.tolist())
    passed = set(sidecar.passing)
    stops = [
        (stop.lon_deg, stop.lat_deg)
        for plan in plans
        for stop in plan.stops
        if (stop.lon_deg, stop.lat_deg) not in passed
    ]
    cells = sidecar.grid.cell_at(*zip(*stops, strict=True))
    assert cells.tolist() == sidecar.stops.tolist()
    if len(names) > 1:
        assert choose_plan(folder, 2).name == "m-2.plan"
    assert mission_of_folder(folder).warnings == ()
    checked = console("sparsor", "check", folder)
    assert checked.code == 0, checked.out
    assert names[0] in checked.out
    # Made again as one study, no old sortie lies beside it.
    again = console.mission(*words, "--no-sorties", "--force", iterations=100)
    assert again.code == 0
    assert [path.name for path in folder.glob("*.plan")] == ["m.plan"]


def test_what_is_beyond_reach_stays_a_study(console):
    ran = console.mission("--name", "m", "--home", 51.2, 25.2, "--json")
    assert ran.code == 0
    assert not ran.result["flyable"]
    assert ran.result["sorties"] == 1
    assert ran.result["warnings"][0].startswith("A planning study")
    assert any("are farther from home than one battery reaches" in one for one in ran.result["warnings"])
    assert any("1, 2, 3, 4, 5" in one and "--drop-unreachable" not in one for one in ran.result["warnings"])
    asked = console.mission("--name", "m", "--home", 51.2, 25.2, "--drop-unreachable", "--json", "--force")
    assert (asked.code, asked.result["flyable"]) == (0, False)  # nothing would be left


def test_what_is_beyond_reach_is_named_or_left_out(console, tmp_path):
    words = ("--name", "m", "--home", 51.4455, 25.27, "--json", "--budget", "20km")
    study = console.mission(*words, iterations=100)
    assert (study.code, study.result["flyable"], study.result["stops_dropped"]) == (0, False, 0)
    said = next(one for one in study.result["warnings"] if "beyond" in one or "farther from home" in one)
    count = int(re.search(r"sorties: (\d+) of", said)[1])
    named = [int(number) for number in re.search(r"\(([0-9, ]+)", said)[1].split(",") if number.strip()]
    assert len(named) == min(count, 10)
    assert f"and {count - 10} more" in said or count <= 10

    ran = console.mission(*words, "--drop-unreachable", "--force", iterations=100)
    assert ran.code == 0, ran.err
    result, vehicle = ran.result, load_vehicle("quad")
    assert result["flyable"]
    assert result["stops_dropped"] == count
    assert result["stops"] == study.result["stops"] - count
    kept = read_sidecar(tmp_path / "missions/m/m.npz")
    assert kept.stops.size == result["stops"]
    lost = result["expected_relative_error"] - study.result["expected_relative_error"]
    assert lost > 0
    warning = next(one for one in result["warnings"] if "left out" in one)
    assert warning.startswith(f"{count} of {study.result['stops']} stops are beyond reach")
    assert f"{result['expected_relative_error']:.3f}" in warning
    assert f"{study.result['expected_relative_error']:.3f}" in warning
    for path in result["plans"]:
        assert time_plan(read_plan(Path(path)), vehicle).used_s <= vehicle.endurance_s * (1 - vehicle.reserve_fraction)
    assert console("sparsor", "check", tmp_path / "missions/m").code == 0


def test_what_is_left_out_needs_sorties(console):
    ran = console.mission("--no-sorties", "--drop-unreachable")
    assert ran.code == 2
    assert "leave out --no-sorties" in ran.err


def test_the_error_is_that_of_what_the_sorties_fly(console, tmp_path):
    words = ("--name", "m", "--budget", "20km", "--json", *HOME)
    whole = console.mission(*words, "--no-sorties", iterations=100)
    ran = console.mission(*words, "--force", iterations=100)
    sidecar, result = read_sidecar(tmp_path / "missions/m/m.npz"), ran.result
    assert result["sorties"] > 1
    legs = unit_legs(sidecar.grid.shape)
    flown = [sidecar.grid.cell_at(*zip(*((s.lon_deg, s.lat_deg) for s in read_plan(Path(path)).stops), strict=True))
             for path in result["plans"]]  # fmt: skip
    under = set(np.concatenate([legs.cells_under(one) for one in flown]).tolist())
    assert set(np.flatnonzero(sidecar.phi.any(axis=0)).tolist()) == under
    assert result["cells_flown_over"] == result["cells_measured"] == len(under)
    assert result["expected_relative_error"] != whole.result["expected_relative_error"]
    assert sidecar.expected["relative_error"] == result["expected_relative_error"]


def test_the_paper_s_sums_do_not_depend_on_the_order(console):
    words = ("--name", "m", "--planner", "monte-carlo", "--budget", "20km", "--json", *HOME)
    whole = console.mission(*words, "--no-sorties")
    ran = console.mission(*words, "--force")
    assert ran.result["sorties"] > 1
    assert ran.result["expected_relative_error"] == whole.result["expected_relative_error"]


def test_quiet_prints_every_plan(console):
    ran = console.mission("--name", "m", "--budget", "30km", "-q", *HOME, iterations=100)
    assert ran.out.split() == [f"missions/m/m-{n}.plan" for n in range(1, len(ran.out.split()) + 1)]
