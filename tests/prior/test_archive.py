"""Archives: all time steps of a file are as many fields, and no more is kept of many than of some."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from sparsor.errors import FieldError
from sparsor.prior import learning
from sparsor.prior.archive import FieldFile, maps_of_files
from sparsor.prior.learning import maps_of_fields, untuned_model
from sparsor.prior.windows import ground_windows

SHAPE, WINDOW_M = (8, 8), (20_000.0, 20_000.0)
ROWS, COLUMNS, STEPS = 60, 100, 5


@pytest.fixture(scope="module")
def stack():
    rng = np.random.default_rng(3)
    values = rng.normal(5, 1, (STEPS, ROWS, COLUMNS)) + np.linspace(0, 4, STEPS)[:, None, None]
    values[2] = np.nan
    return values


def written(path, stack, zarr=False):
    axes = {
        "lat": ("lat", 25 + 0.02 * np.arange(ROWS), {"units": "degrees_north"}),
        "lon": ("lon", 50 + 0.02 * np.arange(COLUMNS), {"units": "degrees_east"}),
        "time": ("time", 1.0 + np.arange(len(stack)), {"units": "step"}),
    }
    dataset = xr.Dataset({"no2": (("time", "lat", "lon"), stack, {"units": "ppb"})}, coords=axes)
    dataset.to_zarr(path) if zarr else dataset.to_netcdf(path, engine="h5netcdf")
    return path


@pytest.mark.filterwarnings("ignore:Consolidated")
@pytest.mark.parametrize("zarr", [False, True])
def test_all_steps_are_learned_from_as_from_files_of_one_step(stack, tmp_path, zarr):
    archive = FieldFile(written(tmp_path / "all", stack, zarr), time="all")
    single = [FieldFile(written(tmp_path / f"{k}.nc", stack[k : k + 1])) for k in (0, 1, 3, 4)]
    (together, cut), (apart, cut_apart) = (maps_of_files(files, WINDOW_M, SHAPE) for files in ([archive], single))
    for name in ("training", "validation", "shapes"):
        np.testing.assert_array_equal(getattr(together, name), getattr(apart, name))
    assert (cut.maps, cut.filled) == (cut_apart.maps, cut_apart.filled)
    assert (cut.empty, cut_apart.empty) == (1, 0)
    assert cut.words == ("1 time steps were left out: too many gaps in all of their windows.",)
    assert archive.source(archive.first()) == f"{tmp_path / 'all'}: no2, 5 time steps"


def test_the_first_step_may_be_empty(stack, tmp_path):
    file = FieldFile(written(tmp_path / "a.nc", stack[2:4]), time="all")
    np.testing.assert_array_equal(file.first().values, stack[3, ::-1])


def test_an_archive_of_gaps_alone_is_refused(stack, tmp_path):
    file = FieldFile(written(tmp_path / "a.nc", stack[[2, 2]]), time="all")
    with pytest.raises(FieldError, match="empty"):
        file.first()
    with pytest.raises(FieldError, match="empty"):
        maps_of_files([file], WINDOW_M, SHAPE)


def test_a_file_without_time_has_one_step(stack, tmp_path):
    path = tmp_path / "a.nc"
    xr.open_dataset(written(tmp_path / "b.nc", stack[:1])).isel(time=0, drop=True).to_netcdf(path, engine="h5netcdf")
    assert list(FieldFile(path, time="all").steps()) == [None]
    np.testing.assert_array_equal(FieldFile(path, time="all").first().values, stack[0, ::-1])


def test_of_many_windows_a_sample_is_kept_and_all_of_them_count(stack, tmp_path, monkeypatch):
    files = [FieldFile(written(tmp_path / f"{k}.nc", stack[k : k + 1])) for k in (0, 1, 3, 4)]
    everything, _ = maps_of_files(files, WINDOW_M, SHAPE)
    assert everything.windows is None
    monkeypatch.setattr(learning, "MOST_TRAINING", 40)
    monkeypatch.setattr(learning, "_MOST_HELD", 20)
    some, _ = maps_of_files(files, WINDOW_M, SHAPE)
    assert (len(some.training), len(some.validation)) == (40, 20)
    assert {one.tobytes() for one in some.training} < {one.tobytes() for one in everything.training}
    assert some.windows == len(everything.training)
    assert some.extremes == (everything.training.min(), everything.training.max())
    np.testing.assert_array_equal(some.shapes, everything.shapes)
    model, whole = (untuned_model(maps, atoms=8, dictionary="dct") for maps in (some, everything))
    assert model.scale == whole.scale
    np.testing.assert_array_equal(model.covariance_factor, whole.covariance_factor)
    assert model.provenance["training_windows"] == str(len(everything.training))
    assert "training_windows" not in whole.provenance


def test_fields_are_taken_one_by_one(stack, tmp_path):
    file = FieldFile(written(tmp_path / "a.nc", stack[:1]))
    taken = []

    def fields():
        for number in range(3):
            taken.append(number)
            field = file.first()
            yield field, replace(ground_windows(field, *WINDOW_M, SHAPE), source=str(number))

    told = []
    maps = maps_of_fields(fields(), SHAPE, lambda _task, done, total: told.append((len(taken), done, total)), 3)
    assert told == [(1, 1, 3), (2, 2, 3), (3, 3, 3)]
    assert maps.source == "0; 1; 2"
