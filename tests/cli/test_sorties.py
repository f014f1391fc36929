"""`--sorties`: a route beyond one battery becomes several plans; every stop in one of them, each within endurance."""

from __future__ import annotations

from pathlib import Path

import pytest

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
    whole = console.mission(*words, iterations=100)
    planned = read_sidecar(tmp_path / "missions/m/m.npz").stops
    ran = console.mission(*words, "--sorties", "--force", iterations=100)
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
    again = console.mission(*words, "--force", iterations=100)
    assert again.code == 0
    assert [path.name for path in folder.glob("*.plan")] == ["m.plan"]


def test_what_is_beyond_reach_stays_a_study(console):
    ran = console.mission("--name", "m", "--home", 51.2, 25.2, "--sorties", "--json")
    assert ran.code == 0
    assert not ran.result["flyable"]
    assert ran.result["sorties"] == 1
    assert any("are farther from home than one battery reaches" in one for one in ran.result["warnings"])


def test_quiet_prints_every_plan(console):
    ran = console.mission("--name", "m", "--budget", "30km", "--sorties", "-q", *HOME, iterations=100)
    assert ran.out.split() == [f"missions/m/m-{n}.plan" for n in range(1, len(ran.out.split()) + 1)]
