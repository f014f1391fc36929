"""A practice flight from options and a mission folder."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from sparsor.errors import BoxError, FieldError, InputError, MissionError
from sparsor.geodesy.lengths import offset_deg
from sparsor.journeys.practising import FieldRequest, PracticeRequest, prepare_practice, write_truth
from sparsor.journeys.uploading import upload_mission
from sparsor.link.practice import PracticeAutopilot, PracticeServer, RasterTruth, WindSettings, truth_netcdf
from sparsor.mission.sidecar import read_sidecar
from sparsor.prior.reading import read_field
from sparsor.vehicle import load_sensor

DOHA = Path(__file__).parents[2] / "missions" / "doha"
BOX = (51.50, 25.27, 51.53, 25.30)


@pytest.fixture
def gulf_field(tmp_path):
    """A file of a field that is a thousand kilometres wide."""
    values = np.add.outer(np.linspace(1, 0, 20), np.linspace(0, 1, 20))
    path = tmp_path / "gulf.nc"
    path.write_bytes(truth_netcdf(RasterTruth(values / 2, (48.0, 23.0, 58.0, 31.0), "made up"), 0, 100))
    return path


def test_a_mission_folder_says_home_autopilot_vehicle_and_box():
    practice = prepare_practice(PracticeRequest(mission=DOHA))
    sidecar = read_sidecar(DOHA / "doha.npz")
    home, settings = practice.settings.home, practice.settings
    assert (home.lon_deg, home.lat_deg, home.alt_amsl_m) == sidecar.home
    assert (settings.flavour.name, settings.vehicle.name) == ("ardupilot", "quad")
    assert practice.truth.box == pytest.approx(BOX)
    assert (practice.truth.values.min(), practice.truth.values.max()) == (0, 1)


def test_what_is_asked_for_goes_before_the_mission():
    request = PracticeRequest(mission=DOHA, home=(51.6, 25.4), home_altitude_m=0.0, autopilot="px4", sensor=None)
    practice = prepare_practice(request)
    home = practice.settings.home
    assert (home.lon_deg, home.lat_deg, home.altitude_known) == (51.6, 25.4, True)
    assert practice.settings.flavour.name == "px4"
    assert practice.truth is None
    assert practice.settings.truth is None


@pytest.mark.parametrize("mission", [DOHA, None])
def test_a_field_file_is_laid_over_the_mission_or_the_box_that_is_given(gulf_field, mission):
    asked = FieldRequest(gulf_field, over=None if mission else BOX)
    practice = prepare_practice(PracticeRequest(mission=mission, home=(51.51, 25.28), through=asked))
    assert practice.truth.box == pytest.approx(BOX)
    assert practice.truth(51.5005, 25.2705) < 0.05
    assert practice.truth(51.5295, 25.2995) > 0.95
    assert practice.notes == ()


def test_a_field_that_is_flat_round_home_or_elsewhere_is_doubted(gulf_field):
    here = prepare_practice(PracticeRequest(home=(51.51, 25.28), through=FieldRequest(gulf_field)))
    assert any("hardly any" in note and "--field-over" in note for note in here.notes)
    away = prepare_practice(PracticeRequest(home=(10.0, 50.0), through=FieldRequest(gulf_field)))
    assert any("outside the field" in note for note in away.notes)


def test_gaps_are_said(tmp_path):
    values = np.random.default_rng(1).random((8, 8))
    values[3, 3] = np.nan
    (tmp_path / "holed.nc").write_bytes(truth_netcdf(RasterTruth(values, BOX, "made up"), 0, 1))
    through = FieldRequest(tmp_path / "holed.nc")
    practice = prepare_practice(PracticeRequest(home=(51.51, 25.28), through=through))
    assert any("1.6% of the field are gaps" in note for note in practice.notes)


def test_the_truth_is_written_whole_and_is_what_the_sensor_flies_through(tmp_path):
    practice = prepare_practice(PracticeRequest(mission=DOHA))
    write_truth(practice, tmp_path / "new" / "truth.nc")
    field = read_field(tmp_path / "new" / "truth.nc")
    assert field.values == pytest.approx(10 + 60 * practice.truth.values, abs=1e-4)
    with pytest.raises(InputError, match="--truth: without a sensor"):
        write_truth(prepare_practice(PracticeRequest(mission=DOHA, sensor=None)), tmp_path / "none.nc")


@pytest.mark.parametrize(
    ("request_of", "error", "sentence"),
    [
        (lambda _: PracticeRequest(), InputError, "Give --home LON LAT, or --mission DIR"),
        (lambda tmp: PracticeRequest(mission=tmp), MissionError, "no mission.toml; make one with 'sparsor plan'"),
        (lambda _: PracticeRequest(home=(-70, 40)), FieldError, "--field-over W S E N, or fly without a sensor"),
        (
            lambda _: PracticeRequest(home=(51.5, 25.3), through=FieldRequest(Path("none.tif"))),
            FieldError,
            "cannot read 'none.tif'",
        ),
        (
            lambda _: PracticeRequest(home=(51.5, 25.3), through=FieldRequest(over=(52, 25, 51, 24))),
            BoxError,
            "swapped",
        ),
        (
            lambda _: PracticeRequest(home=(51.5, 25.3), sensor=None, through=FieldRequest(over=BOX)),
            InputError,
            "--no-sensor flies through no field",
        ),
    ],
)
def test_what_is_wrong_is_said(tmp_path, request_of, error, sentence):
    with pytest.raises(error, match=sentence):
        prepare_practice(request_of(tmp_path))


def test_options_of_a_field_need_a_field():
    with pytest.raises(InputError, match=r"--variable, --field-range only make sense with --field"):
        FieldRequest(variable="NO2", value_range=(0, 1))


@pytest.mark.parametrize("away_m", [0.0, 1000.0])
def test_a_dry_run_says_how_far_the_plan_is_from_the_vehicle(away_m):
    lon, lat, _ = read_sidecar(DOHA / "doha.npz").home
    home = tuple(float(one) for one in offset_deg(lon, lat, away_m, 0.0))
    practice = prepare_practice(PracticeRequest(mission=DOHA, home=home, sensor=None))
    with PracticeServer(PracticeAutopilot(practice.settings), udp=("127.0.0.1", 0), speedup=20) as server:
        deadline = iter(range(200))
        while not server.autopilot.flight.has_fix and next(deadline, None) is not None:
            server._stop.wait(0.05)
        report = upload_mission(DOHA, f"udpout://127.0.0.1:{server.udp_port}", dry_run=True, timeout_s=30)
    said = [warning for warning in report.warnings if "from the vehicle" in warning or "where it is" in warning]
    assert said == ([] if away_m == 0 else ["The plan's home lies 1.0 km from the vehicle."])


def test_the_sensor_is_the_one_that_the_mission_was_planned_for(monkeypatch):
    planned = load_sensor().model_copy(update={"t90_s": 50.0, "noise_sd": 4.0})
    sidecar = dataclasses.replace(read_sidecar(DOHA / "doha.npz"), sensor=planned)
    monkeypatch.setattr("sparsor.journeys.practising.read_sidecar", lambda _: sidecar)

    def measured(**asked):
        sensor = prepare_practice(PracticeRequest(mission=DOHA / "doha.plan", **asked)).settings.sensor
        return sensor.t90_s, sensor.noise_ppb

    assert measured() == (50.0, 4.0)
    assert measured(t90_s=0.0) == (0.0, 4.0)
    assert measured(noise_ppb=0.5) == (50.0, 0.5)
    planned = planned.model_copy(update={"unit": "mg/m3"})  # whose noise is not one in ppb
    sidecar = dataclasses.replace(sidecar, sensor=planned)
    assert measured() == (50.0, 1.0)


def test_a_wind_that_it_cannot_fly_against_is_said():
    (note,) = prepare_practice(PracticeRequest(mission=DOHA, wind=WindSettings(20, 90))).notes
    assert "more than it flies against (15 m/s)" in note
