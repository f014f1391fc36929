"""`reconstruct-map`: from logs and a mission to files, and a clear word where that cannot be."""

from __future__ import annotations

import csv
import gzip
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rasterio

from flightlog.logs import flight as recorded_flight
from sparsor.flightlog.messages import NAMED_VALUE_FLOAT
from sparsor.geodesy.lengths import distance_m
from sparsor.mission import read_plan
from sparsor.mission.sidecar import read_sidecar, sidecar_npz
from sparsor.vehicle import load_sensor

SPEED_M_S, HEIGHT_M, NOISE = 8.0, 50.0, 0.3
KEYS = {"samples", "cells_measured", "cells_missed", "decoder", "clock", "unit", "outputs", "warnings"}


def truth(lon_deg, lat_deg):
    """A hill of 2 km beside the middle of the box, ppb."""
    east, north = (np.asarray(lon_deg) - 51.52) / 0.01, (np.asarray(lat_deg) - 25.28) / 0.01
    return 20.0 + 30.0 * np.exp(-(east**2 + north**2) / 2)


def flight(plan, *, part=1.0, noise=NOISE):
    """A table of what a vehicle samples that flies over a plan's stops once."""
    stops = np.array([[stop.lon_deg, stop.lat_deg] for stop in read_plan(plan).stops])
    legs_m = distance_m(stops[:-1, 0], stops[:-1, 1], stops[1:, 0], stops[1:, 1])
    at_m = np.concatenate(([0.0], np.cumsum(legs_m)))
    along_m = np.arange(0.0, part * at_m[-1], SPEED_M_S)
    lon, lat = (np.interp(along_m, at_m, stops[:, k]) for k in (0, 1))
    value = truth(lon, lat) + noise * np.random.default_rng(3).standard_normal(lon.size)
    time_s = 100.0 + along_m / SPEED_M_S
    return np.column_stack((time_s, lon, lat, np.full(lon.size, 10.0 + HEIGHT_M), np.full(lon.size, HEIGHT_M), value))


def written(path, rows, header="time_s,lon_deg,lat_deg,alt_m,height_m,NO2"):
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.8f")
    return path


@pytest.fixture(scope="module")
def made(tmp_path_factory, cache):
    """A mission folder and a log of its flight; copied by the tests that change them."""
    from sparsor.journeys.folder import write_mission
    from sparsor.journeys.planning import plan_mission
    from sparsor.mission.specification import specification

    folder = tmp_path_factory.mktemp("missions") / "doha"
    asked = {
        "name": "doha",
        "area": {"bbox": (51.50, 25.27, 51.53, 25.30)},
        "search": {"planner": "monte-carlo", "iterations": 30, "budget": "15%"},  # of no sensor that it knows
        "flight": {"altitude_m": HEIGHT_M, "sorties": False},
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SPARSOR_CACHE_DIR", str(cache))
        write_mission(plan_mission(specification(asked, base=folder)), folder, preview=False)
    written(folder.parent / "flight.csv", flight(folder / "doha.plan"))
    return folder.parent


@pytest.fixture
def here(console, made, tmp_path):
    """The same in the test's own folder, which is the working one."""
    shutil.copytree(made / "doha", tmp_path / "doha")
    shutil.copy(made / "flight.csv", tmp_path)
    return console


def reconstructed(console, *options):
    ran = console("reconstruct-map", "flight.csv", "--mission", "doha", "--json", "--unit", "ppb", *options)
    assert ran.code == 0, ran.err
    return ran.result


def test_a_flight_becomes_a_map_in_the_missions_folder(here):
    result = reconstructed(here)
    assert set(result) >= KEYS
    assert result["outputs"] == [f"doha/doha{suffix}" for suffix in (".tif", ".nc", ".png", ".html", ".csv")]
    assert all(Path(path).stat().st_size > 1000 for path in result["outputs"])
    assert (result["cells_missed"], result["clock"], result["unit"]) == (0, "file", "ppb")
    with rasterio.open("doha/doha.tif") as dataset:
        value, deviation, measured = dataset.read()
        row, column = np.indices(value.shape)
        lon, lat = rasterio.transform.xy(dataset.transform, row.ravel(), column.ravel())
        assert dataset.units[0] == "ppb"
        assert "doha" in dataset.tags()["mission"]
        assert dataset.tags()["logs"].startswith("flight.csv, sha256 ")
    wanted = truth(lon, lat).reshape(value.shape)
    off = np.abs(value - wanted)
    assert np.linalg.norm(off) < 0.5 * np.linalg.norm(wanted - wanted.mean())
    assert (off < 1.96 * deviation).mean() > 0.8
    assert measured.sum() == result["cells_measured"]
    with Path("doha/doha.csv").open(encoding="utf-8") as stream:
        assert sum(line["used"] == "1" for line in csv.DictReader(stream)) == result["samples"]


def test_what_is_there_is_replaced_when_told_to_and_by_the_same_bytes(here, tree):
    reconstructed(here)
    before = tree()
    refused = here("reconstruct-map", "flight.csv", "--mission", "doha", "--unit", "ppb")
    assert refused.code == 2
    assert "doha.tif" in refused.said
    assert "--force" in refused.said
    assert tree() == before
    reconstructed(here, "--force")
    assert tree() == before


def test_people_get_a_table_and_the_warnings_beside_it(here):
    ran = here("reconstruct-map", "flight.csv", "--mission", "doha", "-o", "map.csv")
    assert ran.code == 0, ran.err
    for word in ("samples", "cells", "no stop missed", "decoder", "uncertainty", "expected error", "map.csv"):
        assert word in ran.out
    assert "Nothing tells the unit of the readings: ppb is taken" in ran.said
    assert "its lag is not undone, and may look like drift; give --t90" in ran.said
    quiet = here("sparsor", "reconstruct", "flight.csv", "--mission", "doha", "-o", "quiet.csv", "-q")
    assert quiet.out.split() == ["quiet.csv"]
    assert not Path("doha/doha.tif").exists()


def test_a_plan_and_its_box_do_instead_of_a_folder(here):
    shutil.copy("doha/doha.plan", "anybodys.plan")
    shutil.rmtree("doha")
    box = ("--bbox", 51.50, 25.27, 51.53, 25.30)
    ran = here("reconstruct-map", "flight.csv", "--plan", "anybodys.plan", *box, "--json", "--decoder", "mmse")
    assert ran.code == 0, ran.err
    assert ran.result["outputs"][0] == "anybodys.tif"
    assert (ran.result["decoder"], ran.result["cells_missed"]) == ("mmse", 0)
    assert any("built-in" in warning for warning in ran.result["warnings"])
    swapped = here("reconstruct-map", "flight.csv", "--plan", "anybodys.plan", "--bbox", 51.6, 25.27, 51.63, 25.30)
    assert swapped.code == 2
    assert "none of the" in swapped.said


def test_a_partial_flight_gives_a_map_and_lists_what_was_missed(here):
    written(Path("flight.csv"), flight(Path("doha/doha.plan"), part=0.4))
    result = reconstructed(here, "-o", "part.tif", "--decoder", "kriging")
    assert result["cells_missed"] == len(result["missed_stops"]) > 0
    assert any("missed" in warning for warning in result["warnings"])


def test_two_halves_give_the_map_of_the_whole(here):
    whole = reconstructed(here, "-o", "whole.csv", "--decoder", "kriging")
    rows = np.loadtxt("flight.csv", delimiter=",", skiprows=1)
    rows[:, 0] += 1.7e9  # by the time of day, or nobody knows which half was first
    halves = [written(Path(f"{name}.csv"), part) for name, part in zip("ab", np.array_split(rows, 2), strict=True)]
    Path("b.csv.gz").write_bytes(gzip.compress(halves[1].read_bytes()))
    command = ("reconstruct-map", "b.csv.gz", "a.csv", "--mission", "doha", "--unit", "ppb", "--decoder", "kriging")
    ran = here(*command, "--json", "-o", "halves.csv")
    assert ran.code == 0, ran.err
    assert ran.result["samples"] == whole["samples"]
    assert ran.result["level"] == pytest.approx(whole["level"], rel=0.02)


def test_readings_are_converted_from_the_profiles_unit(here):
    profile = Path("no2.toml")
    profile.write_text('name = "mine"\ngas = "NO2"\nunit = "ppb"\nt90_s = 0.0\nnoise_sd = 0.3\n', encoding="utf-8")
    options = ("--mission", "doha", "--json", "--decoder", "kriging", "--sensor-profile", profile)
    levels = {}
    for unit in ("ppb", "ug/m3"):
        ran = here("reconstruct-map", "flight.csv", *options, "--unit", unit, "-o", f"{unit[:2]}.tif")
        assert ran.code == 0, ran.err
        assert ran.result["unit"] == unit
        levels[unit] = ran.result["level"]
    assert levels["ug/m3"] / levels["ppb"] == pytest.approx(1.88, rel=0.01)  # NO2 at 25 degrees C and 1013 hPa
    wrong = here("reconstruct-map", "flight.csv", *options, "--unit", "furlongs", "-o", "x.tif")
    assert wrong.code == 2
    assert "furlongs" in wrong.said


def test_the_missions_own_sensor_is_taken_unless_another_is_given(here):
    sidecar = read_sidecar(Path("doha/doha.npz"))
    told = load_sensor().model_copy(update={"unit": "ug/m3", "t90_s": 4.0})
    Path("doha/doha.npz").write_bytes(sidecar_npz(replace(sidecar, sensor=told)))
    for options, unit, done in (
        ((), "ug/m3", "response of t90 4 s undone"),
        (("--t90", 0), "ug/m3", "response not undone"),
        (("--unit", "ppb"), "ppb", "converted from ug/m3 to ppb"),
    ):
        ran = here("reconstruct-map", "flight.csv", "--mission", "doha", "-o", "m.csv", "--force", *options)
        assert ran.code == 0, ran.err
        assert done in " ".join(ran.out.split())
        assert "Nothing tells the unit" not in ran.said
        assert unit in ran.out


def test_a_finer_map_where_the_decoder_allows_it(here):
    reconstructed(here, "--decoder", "kriging", "--finer", 3, "-o", "fine.tif")
    with rasterio.open("fine.tif") as dataset:
        assert dataset.shape == (96, 96)
        assert tuple(dataset.bounds) == pytest.approx((51.50, 25.27, 51.53, 25.30), abs=1e-9)
    result = reconstructed(here, "--decoder", "lasso", "--finer", 3, "-o", "coarse.tif")
    assert any("not finer" in warning for warning in result["warnings"])


def test_an_edited_plan_is_still_good_and_inspect_says_what_was_changed(here):
    plan = Path("doha/doha.plan")
    said = here("sparsor", "inspect", plan).out
    assert "Unchanged" in said
    document = json.loads(plan.read_text(encoding="utf-8"))
    items = document["mission"]["items"]
    stop = next(index for index, item in enumerate(items) if item["command"] == 16)
    del items[stop]
    plan.write_text(json.dumps(document), encoding="utf-8")
    result = reconstructed(here, "-o", "map.tif", "--decoder", "kriging")
    assert any("doha.plan was edited" in warning for warning in result["warnings"])
    said = here("sparsor", "inspect", plan).out
    assert "Edited since sparsor wrote it" in said
    assert "1 of " in said
    assert "have no stop any more" in said


def test_a_plan_that_became_unreadable_does_not_keep_the_map_away(here):
    Path("doha/doha.plan").write_text("{", encoding="utf-8")
    result = reconstructed(here, "-o", "map.tif", "--decoder", "lasso-sums")
    assert any("cannot be read" in warning for warning in result["warnings"])
    assert (result["decoder"], result["cells_missed"]) == ("lasso-sums", 0)


MISTAKES = {
    "no mission": (("flight.csv",), "Give --mission DIR, or --plan"),
    "two missions": (("flight.csv", "--mission", "doha", "--plan", "doha/doha.plan"), "Give --mission DIR, or --plan"),
    "a plan without its box": (("flight.csv", "--plan", "doha/doha.plan"), "--bbox"),
    "a model beside a folder": (("flight.csv", "--mission", "doha", "--model", "m.npz"), "--model goes with --plan"),
    "no such folder": (("flight.csv", "--mission", "dohha"), "'dohha' does not exist"),
    "a plan as a folder": (("flight.csv", "--mission", "doha/doha.plan"), "is a file; for a plan give --plan"),
    "a folder without a sidecar": (("flight.csv", "--mission", "empty"), "holds no sidecar"),
    "no such log": (("flihgt.csv", "--mission", "doha"), "flihgt.csv"),
    "an empty log": (("empty/empty.tlog", "--mission", "doha"), "is empty"),
    "a log from elsewhere": (("elsewhere.csv", "--mission", "doha"), "km from its middle"),
    "a log that brushes the box": (("beside.csv", "--mission", "doha"), "give the mission that was flown"),
    "a log without the sensor": (("flight.csv", "--mission", "doha", "--sensor", "CO"), "NO2@1/1"),
    "a log without any sensor": (("bare.tlog", "--mission", "doha"), "no sensor is in the log, only messages of 1/1"),
    "no such vehicle": (("flight.csv", "--mission", "doha", "--system", 9), "system 9"),
    "an unknown suffix": (("flight.csv", "--mission", "doha", "-o", "map.pdf"), ".tif, .nc, .png, .html, .csv"),
    "over the log": (("flight.csv", "--mission", "doha", "--force", "-o", "flight.csv"), "would be written over"),
    "too fine": (("flight.csv", "--mission", "doha", "--finer", 99), "--finer is 99"),
    "no such profile": (("flight.csv", "--mission", "doha", "--sensor-profile", "x.toml"), "x.toml"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_explained_and_nothing_is_written(here, tree, mistake):
    Path("empty").mkdir()
    Path("empty/empty.tlog").touch()
    Path("bare.tlog").write_bytes(b"".join(one for one in recorded_flight(10).records if one[15] != NAMED_VALUE_FLOAT))
    rows = flight(Path("doha/doha.plan"))
    written(Path("beside.csv"), rows + np.array([0, 0.0299, 0, 0, 0, 0]))
    rows[:, 1] += 1.0
    written(Path("elsewhere.csv"), rows)
    before = tree()
    words, said = MISTAKES[mistake]
    ran = here("reconstruct-map", *words)
    assert ran.code == 2, ran.err
    assert said in ran.said
    assert "Traceback" not in ran.err
    assert tree() == before


def test_all_of_the_files_are_written_or_none(here, tree):
    Path("in_the_way").touch()
    before = tree()
    ran = here("reconstruct-map", "flight.csv", "--mission", "doha", "-o", "new/map.tif", "-o", "in_the_way/map.csv")
    assert ran.code == 1
    assert tree() == before
    ran = here("reconstruct-map", "flight.csv", "--mission", "doha", "-o", "new/map.tif", "-o", "newer/map.csv", "-q")
    assert ran.code == 0, ran.err
    assert Path("new/map.tif").is_file()
    assert Path("newer/map.csv").is_file()
