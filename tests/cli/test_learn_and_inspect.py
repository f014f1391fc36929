"""`sparsor learn`, missions with what it makes, and `sparsor inspect` on every kind of file."""

from __future__ import annotations

import json
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from flightlog.recorded import recorded_flight
from sparsor.mission.sidecar import read_sidecar
from sparsor.prior.model import read_model

pytestmark = pytest.mark.usefixtures("no_picture")


def learned(console, field, *options):
    ran = console("sparsor", "learn", field, "-o", "m.npz", "--json", *options)
    assert ran.code == 0, ran.err
    return ran.result


@pytest.fixture(scope="module")
def small_model(smooth_field, tmp_path_factory):
    from sparsor.journeys.learning import LearnRequest, learn_from_fields

    path = tmp_path_factory.mktemp("models") / "small.npz"
    learn_from_fields(LearnRequest((smooth_field,), atoms=64, dictionary="dct"), path)
    return path


def test_learn_tells_what_it_did(console, smooth_field):
    result = learned(console, smooth_field, "--atoms", 20, "--bbox", *console.FIELD_BOX)
    assert set(result) >= {"maps", "window_m", "atoms", "validation_relative_error", "gaps"}
    model = read_model(Path("m.npz"))
    assert result["window_m"] == pytest.approx(list(model.window_m))
    assert result["atoms"] == model.atoms == 20
    assert result["maps"] > int(model.provenance["training_maps"]) + len(model.validation)  # those between left out
    assert 0 < result["validation_relative_error"] < 0.2  # round hills, every cell known
    assert result["gaps"] == {"windows_dropped": 0, "windows_filled": 0}

    words = console("sparsor", "learn", smooth_field, "-o", "words.npz", "--atoms", 20, "--bbox", *console.FIELD_BOX)
    assert words.code == 0
    for word in ("windows", "20 atoms", "validation", "lambda", "gaps"):
        assert word in words.out
    assert Path("words.npz").read_bytes() == Path("m.npz").read_bytes()


def test_all_months_of_an_archive_are_learned_from_and_planned_with(console, smooth_field):
    import rasterio
    import xarray as xr

    with rasterio.open(smooth_field) as dataset:
        values = dataset.read(1)[::-1].astype(float)
    axes = {
        "time": np.datetime64("2020-01-01", "ns") + np.arange(3) * np.timedelta64(31, "D"),
        "lat": ("lat", 25.13 + 0.01 * np.arange(88), {"units": "degrees_north"}),
        "lon": ("lon", 51.0 + 0.01 * np.arange(88), {"units": "degrees_east"}),
    }
    months = np.stack([values, values[::-1], np.full_like(values, np.nan)])
    xr.Dataset({"no2": (("time", "lat", "lon"), months, {"units": "ppb"})}, coords=axes).to_netcdf("months.nc")

    one = learned(console, "months.nc", "--dictionary", "dct", "--atoms", 20, "--field-time", "2020-01")
    every = learned(console, "months.nc", "--dictionary", "dct", "--atoms", 20, "--field-time", "all")
    assert every["maps"] == 2 * one["maps"]
    assert "1 time steps were left out" in every["warnings"][0]
    assert read_model(Path("m.npz")).provenance["source"].startswith("months.nc: no2, 3 time steps, sha256 ")
    options = ("--field", "months.nc", "--field-time", "all", "--atoms", 10, "--name", "months", "--json")
    ran = console.mission(*options, box=console.FIELD_BOX)
    assert ran.code == 0, ran.err
    assert "months.nc: no2, 3 time steps" in read_sidecar(Path("missions/months/months.npz")).model.provenance["source"]


def test_gaps_are_counted(console, smooth_field, geotiff):
    import rasterio

    with rasterio.open(smooth_field) as dataset:
        values = dataset.read(1)
    values[:10, 20] = np.nan
    values[64:, 40:] = np.nan
    result = learned(console, geotiff(Path("gaps.tif"), values), "--dictionary", "dct", "--atoms", 20)
    assert result["gaps"]["windows_filled"] > 0
    assert result["gaps"]["windows_dropped"] > 0
    assert (
        result["maps"] + result["gaps"]["windows_dropped"]
        == learned(console, smooth_field, "--dictionary", "dct", "--atoms", 20)["maps"]
    )


def test_more_atoms_than_windows_are_said(console, smooth_field):
    result = learned(console, smooth_field, "--atoms", 500)
    assert result["atoms"] < 500
    assert any("atoms, not 500" in warning for warning in result["warnings"])


def test_a_mission_with_a_field_and_with_its_model(console, smooth_field):
    field = console.mission("--field", smooth_field, "--name", "field", "--json", box=console.FIELD_BOX)
    assert field.code == 0, field.err
    assert not any("synthetic" in warning for warning in field.result["warnings"])
    learned(console, smooth_field, "--bbox", *console.FIELD_BOX)
    model = console.mission("--model", "m.npz", "--name", "model", "--json", box=console.FIELD_BOX)
    assert model.code == 0, model.err
    same = ("path_length_m", "expected_relative_error", "cost")
    assert [model.result[key] for key in same] == [field.result[key] for key in same]
    assert tomllib.loads(Path("missions/model/mission.toml").read_text())["prior"] == {"model": "../../m.npz"}
    again = console("generate-mission", "missions/field/mission.toml", "-q")
    assert again.code == 0, again.err


def test_the_same_field_under_another_name_is_named_as_given(console, smooth_field, tmp_path):
    """The second model comes out of the cache."""
    for name in ("one.tif", "two.tif"):
        shutil.copy(smooth_field, tmp_path / name)
        ran = console.mission("--field", name, "-o", name[:3], "--json", box=console.FIELD_BOX)
        assert ran.code == 0, ran.err
        assert name in read_sidecar(Path(ran.result["sidecar"])).model.provenance["source"]


def test_a_model_of_another_size_widens_the_expected_error(console, small_model):
    ran = console.mission("--model", small_model, "--json")
    assert ran.code == 0, ran.err
    assert any("35" in warning and "widened" in warning for warning in ran.result["warnings"])


def test_paper_takes_a_model_of_its_kind_only(console, smooth_field, small_model):
    for options, said in (
        (("--paper",), ("uncentred dictionary of 1024 atoms", "centred one of 64", "sparsor learn --uncentred")),
        (("--atoms", 32), ("holds 64 atoms", "--atoms asks for 32")),
    ):
        ran = console.mission("--model", small_model, *options)
        assert ran.code == 2
        assert all(words in ran.err for words in said), ran.err
    assert not Path("missions").exists()

    learned(console, smooth_field, "--dictionary", "dct", "--atoms", 1024, "--uncentred")
    ran = console.mission("--model", "m.npz", "--paper", "--name", "m", "--json", iterations=3)
    assert ran.code == 0, ran.err
    search = tomllib.loads(Path("missions/m/mission.toml").read_text())["search"]
    assert (search["paper"], search["probability"], search["theta"], search["rows"]) == (True, 0.03, 3, 35)
    assert "budget" not in search
    assert ran.result["coverage_fraction"] > 0.15


def test_inspect_tells_every_kind_of_file(console, small_model):
    made = console.mission("--name", "m", "--altitude", 62, "--hold", 4, "--json")
    stops = made.result["stops"]
    for file, kind, words in (
        ("missions/m/m.plan", "plan", (f"{stops} stops", "ArduPilot", "Unchanged")),
        ("missions/m", "plan", ("m.plan",)),
        ("missions/m/m.npz", "sidecar", (f"{stops} stops at 62 m", " s at most", "Expected error")),
        ("missions/m/mission.toml", "specification", ("flight.altitude_m: 62.0", "search.budget: 10%")),
        (small_model, "model", ("64 atoms", "smooth.tif")),
    ):
        ran = console("sparsor", "inspect", file)
        assert ran.code == 0, ran.err
        assert all(word in ran.out for word in words), ran.out
        as_json = console("sparsor", "inspect", file, "--json")
        assert as_json.result["kind"] == kind
        assert console("sparsor", "inspect", file, "-q").out == f"{kind}\n"
    contents = console("sparsor", "inspect", "missions/m/m.npz", "--json").result
    assert contents["expected"]["relative_error"] == made.result["expected_relative_error"]
    assert contents["model"]["atoms"] == 256


def test_inspect_sees_an_edit(console):
    console.mission("--name", "m")
    path = Path("missions/m/m.plan")
    document = json.loads(path.read_text())
    document["mission"]["items"][2]["params"][0] = 30
    path.write_text(json.dumps(document, indent=4))  # as QGroundControl saves it
    ran = console("sparsor", "inspect", path)
    assert ran.code == 0
    assert "Edited since sparsor wrote it." in ran.out
    assert console("sparsor", "inspect", path, "--json").result["edited"] is True
    path.rename("moved.plan")
    assert console("sparsor", "inspect", "moved.plan", "--json").result["edited"] is None


def test_inspect_refuses_what_it_does_not_know(console):
    Path("notes.txt").write_text("x")
    Path("cut.plan").write_text('{"fileType": "Plan"')
    Path("folder").mkdir()
    for file, said in (
        ("notes.txt", ".plan, .npz (model or sidecar), .toml and flight logs"),
        ("cut.plan", "not a usable plan"),
        ("folder", "without a .plan"),
        ("none.plan", "there is no file"),
    ):
        ran = console("sparsor", "inspect", file)
        assert ran.code == 2
        assert file in ran.err
        assert said in ran.err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("-o m.txt", ("'m.txt'", ".npz")),
        ("-o m.npz --dictionary fourier", ("'fourier'", "learned, dct, polynomial")),
        ("-o m.npz --atoms 1", ("atoms is 1", "at least 2")),
        ("-o m.npz --window 0 35", ("0 x 35 km", "0.2..3000 km")),
        ("-o m.npz --window 40 40 --bbox 51 25 51.4 25.4", ("--window", "--bbox", "not both")),
        ("-o m.npz --bbox 51.4 25 51 25.4", ("swapped?",)),
        ("-o m.npz --variable 7", ("'7'", "bands")),
    ],
)
def test_learn_refuses(console, smooth_field, options, said):
    ran = console("sparsor", "learn", smooth_field, *options.split())
    assert ran.code == 2
    assert all(words in ran.err for words in said), ran.err
    assert list(Path().iterdir()) == []


def test_a_flight_log_says_what_it_holds(console, tmp_path):
    flight = recorded_flight("ardupilot", tmp_path)
    path = tmp_path / "a.tlog"
    path.write_bytes(flight.tlog[:-3])  # the last record is cut short
    ran = console("sparsor", "inspect", path)
    assert ran.code == 0, ran.err
    assert "a telemetry log (tlog)" in ran.out
    assert "Vehicles with positions: 1. Heard (system/component): 1/1, 1/191." in ran.out
    assert "armings: 1." in ran.out
    assert "broken at 1 places" in ran.out
    held = console("sparsor", "inspect", path, "--json").result
    assert (held["kind"], held["log_kind"], held["vehicles"]) == ("log", "tlog", [1])
    assert {(one["name"], one["sender"]) for one in held["values"]} == {("NO2", "1/1"), ("NO2C", "1/191")}
    of_companion = next(one for one in held["values"] if one["name"] == "NO2C")
    assert of_companion["count"] > 30
    assert of_companion["highest"] > of_companion["lowest"] >= 0
    (boot,) = held["boots"]
    assert boot["seconds"] > 30
    assert held["damage"]["places"] == 1


def test_a_table_of_samples_is_a_log_too(console, tmp_path):
    path = tmp_path / "day.csv"
    path.write_text("time,lat,lon,alt,NO2\n0,25.28,51.51,30,12.5\n1,25.28,51.51,30,13.5\n")
    ran = console("sparsor", "inspect", path)
    assert ran.code == 0, ran.err
    assert "a table (CSV)" in ran.out
    assert "2, 12.5 to 13.5" in ran.out
    (tmp_path / "a.doc").write_text("x")
    ran = console("sparsor", "inspect", tmp_path / "a.doc")
    assert (ran.code, "flight logs (.tlog, .BIN, .ulg, .csv)" in ran.said) == (2, True)
